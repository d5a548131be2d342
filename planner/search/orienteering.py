"""A planner from outside: a tour over the roads that targets are likely to pass, by OR-Tools.

The usual static formulation, an orienteering problem: each road is worth the probability that the
target passes it, whenever that may be, and the tour of greatest worth that fits into the time is
flown. It knows where targets pass and not when, which is what simulation adds.
"""

from typing import Any

import numpy as np

from planner.arrays import Floats, Offsets
from planner.errors import NotApplicableError
from planner.flight.legs import Legs
from planner.futures.edges_driven import NO_EDGE
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.result import SearchLog, SearchResult

WORK_PER_TOUR = 1000  # units of work that a tour improved by local search is charged
TICKS_PER_S = 10  # OR-Tools counts in whole numbers
WORTH = 10**9  # of a road that every target passes, in ticks: no detour is as dear


def orienteering(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:  # noqa: ARG001
    """Return the plan that flies OR-Tools' tour: guided local search from the cheapest arcs.

    Each road at most once, in either direction. The budget's work bounds the tours tried.

    Raises
    ------
    NotApplicableError
        If OR-Tools is not installed.
    """
    try:
        from ortools.constraint_solver import pywrapcp, routing_enums_pb2
    except ImportError as error:
        raise NotApplicableError(
            "OR-Tools is not installed; type: pip install 'sumo-search-planner[orienteering]'"
        ) from error
    log = SearchLog(problem, budget)
    lasts, worth = _flight_ticks(problem), passing_probability(problem)
    manager = pywrapcp.RoutingIndexManager(len(lasts), 1, [0], [len(lasts) - 1])
    routing = pywrapcp.RoutingModel(manager)
    index = [manager.NodeToIndex(node) for node in range(len(lasts))]
    flight = routing.RegisterTransitMatrix(lasts.tolist())
    routing.SetArcCostEvaluatorOfAllVehicles(flight)
    routing.AddDimension(flight, 0, _most_ticks(problem), True, "time")
    for road, share in enumerate(worth.tolist()):
        both = [index[1 + leg] for leg in Legs.both(road)]  # place 0 is the take-off
        routing.AddDisjunction(both, int(share * WORTH))
    rules: Any = pywrapcp.DefaultRoutingSearchParameters()
    rules.first_solution_strategy = routing_enums_pb2.FirstSolutionStrategy.PATH_CHEAPEST_ARC
    meta = routing_enums_pb2.LocalSearchMetaheuristic
    rules.local_search_metaheuristic = meta.GUIDED_LOCAL_SEARCH
    rules.solution_limit = max(1, budget.work // WORK_PER_TOUR)
    routing.AddSearchMonitor(routing.solver().CustomLimit(log.stop))
    tour = routing.SolveWithParameters(rules)
    order, at = [], routing.Start(0)
    while tour is not None and not routing.IsEnd(at):
        order += [manager.IndexToNode(at) - 1]
        at = tour.Value(routing.NextVar(at))
    return log.result(plan_of_legs(problem, "orienteering", order[1:]))


def passing_probability(problem: Problem) -> Floats:
    """Return the probability that the target drives on each road, (R,)."""
    futures, network = problem.futures, problem.network
    edges = futures.edges
    known = edges.edge != NO_EDGE
    passed = np.stack([network.edge_road[edges.edge[known]], edges.particle[known]], axis=1)
    road, who = np.unique(passed, axis=0).T
    weight = problem.weight_at_start[who]
    sums = np.bincount(road, weights=weight, minlength=len(network.road_ids))
    return np.asarray(sums, dtype=np.float64)


def _flight_ticks(problem: Problem) -> Offsets:
    """Return how long it takes from the end of each leg to that of each other, (L + 2, L + 2).

    The first place is the take-off, the last one the end of the tour, at home where there is one.
    """
    legs, uav = problem.legs, problem.uav_at_start
    ends_xy_m = np.vstack([[[uav.x_m, uav.y_m]], legs.node_xy_m[legs.to_node]])
    offset = ends_xy_m[:, None] - legs.node_xy_m[legs.from_node]
    lasts_s = np.zeros((len(legs) + 2, len(legs) + 2))
    lasts_s[:-1, 1:-1] = np.hypot(*np.moveaxis(offset, -1, 0)) / legs.speed_mps + legs.duration_s
    lasts_s[1:-1, -1] = problem.legs.home_s[legs.to_node]
    return np.asarray(np.round(TICKS_PER_S * lasts_s), dtype=np.int64)


def _most_ticks(problem: Problem) -> int:
    uav = problem.uav_at_start
    return int(TICKS_PER_S * (min(problem.objective.ends_s, uav.landing_s) - uav.take_off_s))
