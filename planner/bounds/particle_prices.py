"""Particle prices: no road plan is worth more than the prices and what a flight earns above them.

Let r_ka be what hop a, begun at a certain time, earns with particle k when it sees it. A plan
earns the greatest r_ka of its hops with each particle, and for any prices p_k >= 0

    sum_k max_a r_ka  <=  sum_k p_k  +  sum over the plan's hops of sum_k max(0, r_ka - p_k),

where for each particle the last sum needs no hop but the first one that sees it: that sighting is
worth most. So a hop leaves out particles that whatever came to its first node has surely seen. It
also leaves out those that the hop before may see with as great a reward: that counts at least as
much for them as is due, whether it sees them or not. The right side is greatest along one flight,
which a dynamic programme over nodes and times finds. It remembers the last leg flown; after
straight flights nothing is remembered. `sighting_table` says how time is divided into bins; a hop
ends in the bins that all its starts end in.

Where the sensor may miss, hop a has particle k in reach for so long that it sees it with at most
the probability f_ka = 1 - exp(-rate * longest time in reach), and no hop surely does. Let S_ka be
the probability that k is unseen after hop a. A plan earns at most sum_a r_ka (S_k,a-1 - S_ka) with
k, which is at most

    sum_a p_k (S_k,a-1 - S_ka) + sum_a max(0, r_ka - p_k) (S_k,a-1 - S_ka),

where the first sum telescopes to at most p_k, and a factor of the second is at most f_ka. So the
right side above holds with f_ka max(0, r_ka - p_k) for what a hop earns. After a hop before that
may see k with as great a reward it is enough to count 1 - f_kb of it, b being that hop, whether or
not b has k in reach for as long as it may: write g_a for max(0, r_ka - p_k), and V_a for the most
that hops from a on can add of k while it is unseen. With a contact of any length up to the longest
V_a = max over s in [0, f_ka] of s g_a + (1 - s) V_a+1, so s is f_ka if g_a >= V_a+1, and otherwise
0. If it is f_ka for hop a then V_a <= g_a <= g_b for the hop b before it, so that it is f_kb for b
as well, and what a adds is at most (1 - f_kb) f_ka g_a. A sensor that misses nothing has f = 1, and
nothing is left after the hop before.

A landing by a certain time only means that nothing is seen after it. What is seen on a flight to a
certain place to land belongs to no hop, so such problems have no bound yet.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.bounds.hops import Hops
from planner.bounds.kernels.hops import Bins
from planner.bounds.kernels.prices import (
    HopColumns,
    PriceTable,
    Start,
    best_path,
    best_sightings,
    fill_values,
    most_onward,
    narrowed,
)
from planner.bounds.movements import Movements, Place
from planner.bounds.sighting_table import arrivals_of, sightings_of
from planner.errors import NotApplicableError

MOST_CELLS = 20_000_000  # hops times bins, of which a table is made


class Bounded(NamedTuple):
    """What prices prove, and in which direction they should change."""

    reward: float  # no expected reward is greater
    counts: Floats  # (N,) how often the best flight earns more with a particle than its price


@dataclass(frozen=True, eq=False)
class Table:
    """All that hops may see, and what the bound needs beside prices."""

    weight: Floats  # (N,); 0: seen before, and counted elsewhere
    floor: Floats  # (N,) reward; prices stay above, and sightings that earn less are left out
    columns: PriceTable
    starts: tuple[Start, ...]
    bins: Bins
    value_to_go: Floats  # (bins and some after the end, states), at the last prices asked for

    def bound(self, prices: Floats) -> Bounded:
        """Return the greatest expected reward that prices allow.

        Parameters
        ----------
        prices
            One per particle, (N,) in units of reward, none below the floor.
        """
        weighted = prices * self.weight
        since = min(start.bin for start in self.starts)
        fill_values(weighted, self.columns, self.value_to_go, since)
        sold = [(1.0 - start.missed) * prices for start in self.starts]
        above = [
            float(self.weight @ np.maximum(0.0, start.reward - paid)) + self._onward(start)
            for start, paid in zip(self.starts, sold, strict=True)
        ]
        most = int(np.argmax(above))
        start = self.starts[most]
        counts = np.where(start.reward > sold[most], 1.0 - start.missed, 0.0)
        best_path(weighted, self.columns, self.value_to_go, start, counts)
        return Bounded(float(weighted.sum()) + above[most], counts)

    def _onward(self, start: Start) -> float:
        """Return what flights on from a start can earn above the last prices."""
        i = start.bin
        return float(self.value_to_go[i, start.node]) if i < len(self.value_to_go) else 0.0

    def after(self, place: Place, prices: Floats, missed: Floats) -> float:
        """Return what flights on from a place can earn above the last prices asked for, (N,).

        Parameters
        ----------
        missed
            How probably each particle was unseen where the table's flights begin, (N,).
        """
        i = self.bins.at(place.time_s)
        if i >= self.bins.total:
            return 0.0
        left = np.divide(place.missed, missed, out=np.zeros(len(missed)), where=missed > 0.0)
        weighted, at = prices * self.weight, (place.node, i)
        return most_onward(weighted, self.columns, self.value_to_go, at, left)

    @property
    def size(self) -> int:
        """How many sightings there are."""
        return len(self.columns.sightings.particle)

    def lowered(self, prices: Floats, start: Start) -> Floats:
        """Return prices, (N,), none above the most that any sighting after a start earns."""
        best = np.zeros(len(prices))
        best_sightings(self.columns.sightings, self._cell(start.bin), best)
        earns = np.divide(best, self.weight, out=best, where=self.weight > 0.0)
        return np.minimum(prices, np.maximum(self.floor, earns))

    def _cell(self, i: int) -> int:
        return min(i, self.bins.total) * len(self.columns.hops.from_node)

    def narrowed(self, floor: Floats, missed: Floats, starts: tuple[Start, ...]) -> "Table":
        """Return the table of the flights on from some starts, of a table before take-off.

        It has values of its own: other threads may ask for other prices.

        Parameters
        ----------
        floor
            As of the table, none lower than before.
        missed
            How probably each particle is unseen there, (N,).
        """
        least = np.where(missed > 0.0, floor * self.weight, np.inf)
        cell = self._cell(min(start.bin for start in starts))
        sightings = narrowed(self.columns.sightings, least, missed, cell)
        return replace(
            self,
            weight=self.weight * missed,
            floor=floor,
            columns=self.columns._replace(sightings=sightings),
            starts=starts,
            value_to_go=np.zeros_like(self.value_to_go),
        )


def fresh_start(place: Place, bins: Bins) -> Start:
    """Return a start at a place at which nothing has been earned that counts."""
    many = len(place.reward)
    return Start(place.node, bins.at(place.time_s), np.zeros(many), np.ones(many))


def table_of(movements: Movements, bin_s: float, floors: Sequence[Floats] | None = None) -> Table:
    """Return the table of a problem's bound.

    Parameters
    ----------
    bin_s
        Length of a bin, seconds.
    floors
        Under all prices that will be asked for, (N,) each in units of reward, none lower than the
        one before: the table has the first one that makes it no too large one; left out: only 0.

    Raises
    ------
    NotApplicableError
        If the net is too large, or a bin longer than a hop.
    """
    problem = movements.problem
    if problem.uav.return_to_m is not None:
        raise NotApplicableError(
            "no bound is known for road plans that have to come home; leave out uav.return_to"
        )
    hops, nodes = movements.hops, len(problem.network.node_ids)
    if bin_s <= 0.0 or len(np.unique(problem.network.node_xy_m, axis=0)) < nodes:
        raise NotApplicableError(
            "the bound for road plans needs nodes that are apart and roads of some length; join "
            "nodes that are at one place"
        )
    first_s = min(place.time_s for place in movements.first_flights)
    ends_s = min(problem.objective.ends_s, problem.uav.landing_s)
    bins = Bins(first_s, bin_s, max(1, int(np.ceil((ends_s - first_s) / bin_s)) + 1))
    _check(hops, bins)
    arrivals, lasts = arrivals_of(hops, nodes), bins.lasting(hops.duration_s)
    floors = [np.zeros(len(problem.futures))] if floors is None else floors
    floor, sightings = sightings_of(movements, bins, arrivals, floors)
    return Table(
        weight=problem.futures.weight,
        floor=floor,
        columns=PriceTable(
            sightings=sightings,
            hops=HopColumns(hops.from_node, hops.to_node, lasts, hops.legs),
            arrivals=arrivals,
        ),
        starts=tuple(
            Start(place.node, bins.at(place.time_s), (1.0 - place.missed) * most, place.missed)
            for place, most in zip(movements.first_flights, movements.first_sights, strict=True)
        ),
        bins=bins,
        value_to_go=np.zeros((bins.total + int(lasts.most.max()), nodes + hops.legs)),
    )


def _check(hops: Hops, bins: Bins) -> None:
    shortest_s, cells = float(hops.duration_s.min()), len(hops) * bins.total
    if shortest_s < bins.step_s:
        raise NotApplicableError(
            f"the bound for road plans needs bins no longer than the shortest flight between "
            f"nodes, {shortest_s:.3g} s; {bins.step_s:g} s is longer"
        )
    if cells > MOST_CELLS:
        raise NotApplicableError(
            f"the bound for road plans takes {cells:,} flights here, more than "
            f"{MOST_CELLS:,}; take a smaller net or longer bins"
        )
