"""What a pilot who knows the streets would fly: the busiest ones, and the best crossing."""

from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.errors import NotApplicableError
from planner.futures.edges_driven import NO_EDGE
from planner.search.patterns import repeated
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult
from planner.search.tuning import Tuner, Whereabouts, sought

HUBS = 15  # the busiest nodes from which main streets are flown
MOST_STREETS = 4  # that are flown from one hub, at most


@dataclass(frozen=True)
class Route:
    """Which main streets are flown."""

    hub: int  # the node from which they are flown, out and back
    streets: int  # how many, the busiest first
    extent_m: float  # how far each


def main_streets(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:
    """Return the best flight out along the busiest streets from a node and back, by turns.

    Tuned are the node, the number of streets, and how far each is followed. A street goes on with
    the busiest road at each node.

    Raises
    ------
    NotApplicableError
        If the sensor only looks along roads, or no target drives on a road that is known.
    """
    tuner = Tuner(problem, budget, "main-streets")
    where, streets = Whereabouts.of(problem, rng), Streets(problem)
    hubs = streets.busiest_nodes[:HUBS].tolist()
    if not streets.traffic_at[hubs[0]] > 0.0:
        raise NotApplicableError(
            "main-streets: nothing is known of the roads on which targets drive during the flight"
        )

    def is_better(route: Route) -> bool:
        legs = streets.leaving(route.hub)[: route.streets]
        ways = [streets.out_and_back(route.hub, leg, route.extent_m) for leg in legs]
        return tuner.is_better(repeated(lambda number: ways[number % len(ways)], where.flight_m))

    best = Route(hubs[0], 2, where.far_m)
    is_better(best)
    while tuner.goes_on:
        route, step = best, tuner.step
        if step > 1.0:
            route = Route(int(rng.choice(hubs)), 1, where.any_extent_m(rng))
        further = float(np.exp(0.4 * min(1.0, step) * rng.normal()))
        many = int(rng.integers(1, MOST_STREETS + 1))
        route = Route(route.hub, many, route.extent_m * further)
        if is_better(route):
            best = route
    return tuner.result()


def best_crossing(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:  # noqa: ARG001
    """Return the plan that hovers over the best of the busiest nodes.

    Unlike ``wait`` it minds who comes by when, not where targets end.

    Raises
    ------
    NotApplicableError
        If the sensor only looks along roads.
    """
    tuner, streets = Tuner(problem, budget, "best-crossing"), Streets(problem)
    for node in streets.busiest_nodes[: tuner.most].tolist():
        if not tuner.goes_on:
            break
        tuner.is_better(problem.network.node_xy_m[[node]])
    return tuner.result()


class Streets:
    """How likely the target is to pass each road while the UAV is in the air."""

    def __init__(self, problem: Problem) -> None:
        self._legs = problem.legs
        ends = np.stack([self._legs.from_node, self._legs.to_node], axis=1)
        # Both directions of a street, and roads side by side, are one street to whoever looks down.
        pairs, street = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
        street = street.ravel()
        on_street = _passing(problem, street[::2])
        self.traffic = on_street[street]  # (L,) probability
        nodes = len(problem.network.node_ids)
        at_ends = [np.bincount(end, weights=on_street, minlength=nodes) for end in pairs.T]
        self.traffic_at = at_ends[0] + at_ends[1]  # (V,) sums of probabilities
        self._leaving: dict[int, list[int]] = {}

    @property
    def busiest_nodes(self) -> Offsets:
        """All nodes, those with the most traffic around them first, (V,)."""
        return np.argsort(-self.traffic_at, kind="stable")

    def leaving(self, node: int) -> list[int]:
        """Return a leg to each neighbour of a node, those with the most traffic first."""
        if node not in self._leaving:
            legs = np.flatnonzero(self._legs.from_node == node)
            legs = legs[self._legs.to_node[legs] != node]
            _, first = np.unique(self._legs.to_node[legs], return_index=True)
            legs = legs[np.sort(first)]
            order = np.argsort(-self.traffic[legs], kind="stable")
            self._leaving[node] = legs[order].tolist()
        return self._leaving[node]

    def out_and_back(self, hub: int, leg: int, extent_m: float) -> Floats:
        """Return the points of a flight along a street and back to its hub, (W, 2) metres.

        The street ends after the given distance, in the middle of a road if need be, where it has
        no way on but to nodes that it has passed, or where no target drives.
        """
        way, passed, left_m = [self._points(leg)], {hub}, extent_m
        while True:
            here = int(self._legs.to_node[leg])
            passed.add(here)
            left_m -= self._legs.speed_mps * float(self._legs.duration_s[leg])
            on = [one for one in self.leaving(here) if self._legs.to_node[one] not in passed]
            if left_m <= 0.0 or not on or not self.traffic[on[0]] > 0.0:
                break
            leg = on[0]
            way.append(self._points(leg)[1:])
        out = cut_to(np.vstack(way), extent_m)
        return np.vstack([out, out[-2::-1]])

    def _points(self, leg: int) -> Floats:
        points = slice(self._legs.first_point[leg], self._legs.first_point[leg + 1])
        return np.stack([self._legs.x_m[points], self._legs.y_m[points]], axis=1)


def cut_to(points: Floats, length_m: float) -> Floats:
    """Return the first so many metres of a polyline, (W, 2); all of it if it is shorter."""
    after_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    if after_m[-1] <= length_m:
        return points
    whole = points[after_m < length_m]
    end = [np.interp(length_m, after_m, column) for column in points.T]
    return np.vstack([whole, end])


def _passing(problem: Problem, street: Ints | Offsets) -> Floats:
    """Return the probability that the target is on each street after take-off, (S,).

    Parameters
    ----------
    street
        Which street each road belongs to, (R,).
    """
    futures, edges = problem.futures, problem.futures.edges
    known = np.diff(edges.first_change) > 0
    leaves_s = np.roll(edges.time_s, -1)
    over_s = np.where(futures.gone, futures.end_s, np.inf)
    leaves_s[edges.first_change[1:][known] - 1] = over_s[known]
    counts = (edges.edge != NO_EDGE) & (leaves_s > problem.uav_at_start.take_off_s)
    on = street[problem.network.edge_road[edges.edge[counts]]]
    who = edges.particle[counts]
    passed, particle = np.unique(np.stack([on, who], axis=1), axis=0).T
    weight = sought(problem)[particle]
    sums = np.bincount(passed, weights=weight, minlength=int(street.max()) + 1)
    return np.asarray(sums, dtype=np.float64)
