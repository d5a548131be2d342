"""Exhaustive search in topological order (Figure 2 of the paper), and what it is compared with."""

from collections import deque

import numpy as np

from planner.errors import NotApplicableError
from planner.flight.legs import Legs
from planner.network.road_network import RoadNetwork
from planner.network.topology import find_cycle, sources
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult


def exhaustive(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:  # noqa: ARG001
    """Return the plan that flies every road once, in its direction, in topological order.

    On a directed acyclic network it finds every target that only follows the roads or stops.
    Neither futures nor budget change it.

    Raises
    ------
    NotApplicableError
        If the network has a cycle, which is named.
    """
    order = topological_search(problem.network)
    return SearchResult(plan_of_legs(problem, "exhaustive", [Legs.along(road) for road in order]))


def breadth_first(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:  # noqa: ARG001
    """Return the plan of standard breadth-first search, the paper's example of one that fails.

    It flies no road to a node that was examined before, and so can leave a target on such a road
    behind it (Section 3).
    """
    order = breadth_first_search(problem.network)
    return SearchResult(plan_of_legs(problem, "breadth-first", order))


def topological_search(network: RoadNetwork) -> list[int]:
    """Return all roads in the order of Figure 2, roads out of a node in the network's order.

    Comments give the figure's line numbers. Its lines 7 to 9, return once the target is found,
    are the flight's, not the plan's.

    Raises
    ------
    NotApplicableError
        If the network has a cycle, which is named.
    """
    incoming = np.bincount(network.road_to, minlength=len(network.node_ids))
    order: list[int] = []
    Q = deque(sources(network).tolist())  # 1, 2
    while Q:  # 3
        n = Q.popleft()  # 4
        for road in np.flatnonzero(network.road_from == n).tolist():  # 5
            order.append(road)  # 6
            m = network.road_to[road]
            incoming[m] -= 1  # 10
            if incoming[m] == 0:  # 11
                Q.append(m)  # 12
    if len(order) < len(network.road_ids) or network.both_ways.any():  # 16
        raise NotApplicableError(_has_a_cycle(network))  # 17
    return order


def breadth_first_search(network: RoadNetwork) -> list[int]:
    """Return the legs that breadth-first search from the sources flies, in its order.

    A road to a node already examined is left out: on Figure 1, where D is examined before E, the
    road ED. The list printed in Section 3 lacks DF as well, although D is examined before F; with
    the rule as the text states it, DF is flown, and it is ED alone that lets a target escape.
    Without a source the search starts at the first node.
    """
    Q = deque(sources(network).tolist() or [0])
    queued, examined = set(Q), set[int]()
    order: list[int] = []
    while Q:
        n = Q.popleft()
        examined.add(n)
        out = network.road_from == n
        for road in np.flatnonzero(out | (network.both_ways & (network.road_to == n))).tolist():
            m = int(network.road_to[road] if out[road] else network.road_from[road])
            if m in examined:
                continue
            order.append(Legs.both(road)[not out[road]])
            if m not in queued:
                queued.add(m)
                Q.append(m)
    return order


def _has_a_cycle(network: RoadNetwork) -> str:
    cycle = find_cycle(network)
    shown = " ".join(cycle[:8]) + (f" ... ({len(cycle)} roads)" if len(cycle) > 8 else "")
    return f"the network has a cycle: {shown}; exhaustive search needs one without cycles"
