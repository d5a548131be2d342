"""Particle prices: no road plan is worth more than the prices and what a flight earns above them.

Let r_ka be what hop a, begun at a certain time, earns with particle k when it sees it. A plan
earns the greatest r_ka of its hops with each particle, and for any prices p_k >= 0

    sum_k max_a r_ka  <=  sum_k p_k  +  sum over the plan's hops of sum_k max(0, r_ka - p_k),

where the last sum may leave out particles that an earlier hop has surely seen: the earlier
sighting is worth more. The right side is greatest along one flight, which a dynamic programme over
nodes and times finds. It remembers the last leg flown, so that flying to and fro over the same
particles does not sell them twice. Straight flights forget. `sightings` says how times are binned;
a hop ends in the bins that all its starts end in.

Of a landing by a certain time it counts only that nothing is seen after it. What is seen on a
flight to a certain place to land is no hop's, so such problems have no bound yet.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner.arrays import Flags, Floats
from planner.bounds.hops import Hops, hops_of, passes_over
from planner.bounds.sighting_table import Arrivals, Bins, sightings_of
from planner.detection.first_detection import first_detection
from planner.errors import NotApplicableError
from planner.flight.track import Track
from planner.search.problem import Problem

MOST_CELLS = 4_000_000  # hops times bins, of which a table is made
Start = tuple[int, int, Floats]  # node, bin, reward of what is seen until there


@dataclass(frozen=True, eq=False)
class Table:
    """All that hops may see, and what the bound needs beside prices."""

    weight: Floats  # (N,); 0: seen before, and counted elsewhere
    floor: Floats  # (N,) reward; prices stay above, and sightings that earn less are left out
    world: tuple[Any, ...]  # sightings, hops and arrivals as ``kernels_prices`` takes them
    starts: tuple[Start, ...]
    bins: Bins
    worth: Floats  # (bins and some after the end, states), as the last prices asked for left it

    def bound(self, prices: Floats) -> tuple[float, Floats]:
        """Return the greatest expected reward that prices allow, and how often each is sold.

        Parameters
        ----------
        prices
            One per particle, (N,) in units of reward, none below the floor.
        """
        from planner.bounds.kernels.prices import dearest, worths

        asked = prices * self.weight
        worths(asked, self.world, self.worth, min(i for _, i, _ in self.starts))
        above = [
            float(self.weight @ np.maximum(0.0, reward - prices)) + self.onward(node, i)
            for node, i, reward in self.starts
        ]
        most = int(np.argmax(above))
        node, i, reward = self.starts[most]
        counts = (reward > prices).astype(np.float64)
        dearest(asked, self.world, self.worth, (node, i), counts)
        return float(asked.sum()) + above[most], counts

    def onward(self, state: int, i: int) -> float:
        """Return what flights from a node, or after a leg, can earn above the last prices."""
        return float(self.worth[i, state]) if i < len(self.worth) else 0.0

    @property
    def size(self) -> int:
        """How many sightings there are."""
        return len(self.world[0][1])

    def no_dearer(self, prices: Floats, start: Start) -> Floats:
        """Return prices lowered to the most that any sighting from a place on earns, (N,)."""
        from planner.bounds.kernels.prices import best_sightings

        best = np.zeros(len(prices))
        best_sightings(self.world[0], self._cell(start[1]), best)
        earns = np.divide(best, self.weight, out=best, where=self.weight > 0.0)
        return np.minimum(prices, np.maximum(self.floor, earns))

    def _cell(self, i: int) -> int:
        return min(i, self.bins.count) * len(self.world[1][0])

    def narrowed(self, floor: Floats, unseen: Flags, starts: tuple[Start, ...]) -> "Table":
        """Return the table of the flights on from some places, when some particles are unseen.

        Parameters
        ----------
        floor
            As of the table, none lower than before.
        """
        from planner.bounds.kernels.prices import narrowed

        least = np.where(unseen, floor * self.weight, np.inf)
        cell = self._cell(min(i for _, i, _ in starts))
        return replace(
            self,
            weight=self.weight * unseen,
            floor=floor,
            world=(narrowed(self.world[0], least, cell), *self.world[1:]),
            starts=starts,
        )


def table_of(problem: Problem, bin_s: float) -> Table:
    """Return the table of a problem's bound.

    Parameters
    ----------
    bin_s
        How finely it looks, seconds.

    Raises
    ------
    NotApplicableError
        If the net is too large, or a bin too long for the sensor to be sure of anything.
    """
    if problem.uav.return_to_m is not None:
        raise NotApplicableError(
            "no bound is known for road plans that have to come home; leave out uav.return_to"
        )
    hops, nodes = hops_of(problem), len(problem.network.node_ids)
    if bin_s <= 0.0 or len(np.unique(problem.network.node_xy_m, axis=0)) < nodes:
        raise NotApplicableError(
            "the bound for road plans needs nodes that are apart and roads of some length; join "
            "nodes that are at one place"
        )
    flights = first_flights(problem)
    first_s = min(at_s for _, at_s, _ in flights)
    ends_s = min(problem.objective.ends_s, problem.uav.landing_s)
    bins = Bins(first_s, bin_s, max(1, int(np.ceil((ends_s - first_s) / bin_s)) + 1))
    _check(hops, bins)
    arrivals = Arrivals.of(hops, nodes)
    lasts = np.ascontiguousarray(bins.lasting(hops.duration_s).T)
    return Table(
        weight=problem.futures.weight,
        floor=np.zeros(len(problem.futures)),
        world=(
            sightings_of(problem, hops, bins, arrivals),
            (hops.from_node, hops.to_node, lasts, hops.legs),
            (arrivals.first, arrivals.leg),
        ),
        starts=tuple((node, bins.at(at_s), seen) for node, at_s, seen in flights),
        bins=bins,
        worth=np.zeros((bins.count + int(lasts.max()), nodes + hops.legs)),
    )


def _check(hops: Hops, bins: Bins) -> None:
    shortest_s, cells = float(hops.duration_s.min()), len(hops) * bins.count
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


def fitting_bin_s(problem: Problem) -> float:
    """Return bins short enough for the sensor to be sure and for every hop to last one."""
    sure_s = problem.sensor.radius_m / problem.legs.speed_mps
    return min(5.0, sure_s, float(hops_of(problem).duration_s.min()))


def first_flights(problem: Problem) -> list[tuple[int, float, Floats]]:
    """Return node, arrival and reward of each flight from take-off that is no two hops.

    Where the UAV takes off at a node, that is the only one: all other flights are hops.
    """
    uav, xy = problem.uav, problem.network.node_xy_m
    start_m, flights = np.array([uav.x_m, uav.y_m]), []
    here = np.flatnonzero(np.all(xy == start_m, axis=1))[:1]
    for node in here if len(here) else range(len(xy)):
        if len(here) == 0 and passes_over(xy, start_m, xy[node]):
            continue
        at_s = uav.take_off_s + float(np.hypot(*(xy[node] - start_m))) / uav.speed_mps
        on = [(uav.take_off_s, at_s)] if problem.sensor.detects_in_transit else []
        path = np.array([start_m, xy[node]])
        track = Track(
            np.array([uav.take_off_s, at_s]), path[:, 0], path[:, 1], np.array(on).reshape(-1, 2)
        )
        seen_at = first_detection(problem.futures, track, problem.sensor.radius_m)
        flights.append((int(node), at_s, problem.objective.reward(seen_at)))
    return flights
