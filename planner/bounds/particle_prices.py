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

A landing by a certain time only means that nothing is seen after it. What is seen on a flight to a
certain place to land belongs to no hop, so such problems have no bound yet.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats
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
        above = [
            float(self.weight @ np.maximum(0.0, start.reward - prices)) + self._onward(start)
            for start in self.starts
        ]
        most = int(np.argmax(above))
        start = self.starts[most]
        counts = (start.reward > prices).astype(np.float64)
        best_path(weighted, self.columns, self.value_to_go, start, counts)
        return Bounded(float(weighted.sum()) + above[most], counts)

    def _onward(self, start: Start) -> float:
        """Return what flights on from a start can earn above the last prices."""
        i = start.bin
        return float(self.value_to_go[i, start.node]) if i < len(self.value_to_go) else 0.0

    def after(self, place: Place, prices: Floats) -> float:
        """Return what flights on from a place can earn above the last prices asked for, (N,)."""
        i = self.bins.at(place.time_s)
        if i >= self.bins.total:
            return 0.0
        at, unseen = (place.node, i), place.reward == 0.0
        weighted = prices * self.weight
        return most_onward(weighted, self.columns, self.value_to_go, at, unseen)

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

    def narrowed(self, floor: Floats, unseen: Flags, starts: tuple[Start, ...]) -> "Table":
        """Return the table of the flights on from some starts, when some particles are unseen.

        It has values of its own: other threads may ask for other prices.

        Parameters
        ----------
        floor
            As of the table, none lower than before.
        """
        least = np.where(unseen, floor * self.weight, np.inf)
        cell = self._cell(min(start.bin for start in starts))
        sightings = narrowed(self.columns.sightings, least, cell)
        return replace(
            self,
            weight=self.weight * unseen,
            floor=floor,
            columns=self.columns._replace(sightings=sightings),
            starts=starts,
            value_to_go=np.zeros_like(self.value_to_go),
        )


def table_of(movements: Movements, bin_s: float) -> Table:
    """Return the table of a problem's bound.

    Parameters
    ----------
    bin_s
        Length of a bin, seconds.

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
    return Table(
        weight=problem.futures.weight,
        floor=np.zeros(len(problem.futures)),
        columns=PriceTable(
            sightings=sightings_of(movements, bins, arrivals),
            hops=HopColumns(hops.from_node, hops.to_node, lasts, hops.legs),
            arrivals=arrivals,
        ),
        starts=tuple(
            Start(place.node, bins.at(place.time_s), place.reward)
            for place in movements.first_flights
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
