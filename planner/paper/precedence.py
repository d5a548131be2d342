"""Section 3 of the paper: which orders of roads are bound to find the target, and when."""

from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from planner.detection.evaluate import evaluate
from planner.errors import InputError
from planner.experiments.condition import Condition
from planner.experiments.target_sets import targets_of
from planner.flight.legs import Legs, legs_named
from planner.flight.plan import Plan
from planner.mission.planning import problem_of
from planner.mission.recorder import Recorder
from planner.network.road_network import RoadNetwork
from planner.network.topology import sources
from planner.search.exhaustive import breadth_first_search, topological_search
from planner.search.exhaustive_shortest import exhaustive_shortest
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from planner.streams import stream

# Orders that Section 3 prints for its Figure 1; what it calls DB is road BD flown against.
PRINTED = {
    "breadth-first, as printed": "AB BC BD BE CD CF EF FG",
    "topological A B C E D F G, as printed": "AB BC BD BE CD CF ED EF DF FG",
    "topological A B E C D F G": "AB BC BD BE ED EF CD CF DF FG",
    "optimised, as printed": "AB BC !BD BE ED EF !CF CD DF FG",
}


def precedence_of(condition: Condition) -> dict[str, Any]:
    """Return for each order what it takes and whom it finds, without a horizon.

    A row for each order and each set of targets: the probability of being found at all, the time
    at which the last of them is, and that at which the flight ends; a search that keeps the
    precedence is then bound to have found the target.
    """
    opened = condition.opened()
    problem = problem_of(opened, Recorder(opened, 1).planning().futures)
    plans = _plans(problem)
    rows = []
    for target_set in condition.sets:
        futures = targets_of(target_set, condition).futures
        for name, plan in plans.items():
            flown = evaluate(plan.tracks, futures, problem.sensor, problem.objective)
            row = {
                "order": name,
                "targets": target_set.name,
                "detection_probability": flown.detection_probability,
                "expected_detection_time_s": flown.expected_detection_time_s,
                "last_found_s": float(flown.seen_at[flown.found].max(initial=0.0)),
                "flight_ends_s": max(track.end_s for track in plan.tracks),
                "roads": sum(map(len, plan.legs)),
                "extra_movements": _movements(problem, plan),
                "never_flown": _never_flown(problem, plan),
            }
            rows.append(row)
    return {"rows": rows}


def _plans(problem: Problem) -> dict[str, Plan]:
    network = problem.network
    printed = {name: _legs(network, roads.split()) for name, roads in PRINTED.items()}
    orders = {name: legs for name, legs in printed.items() if legs is not None}
    orders["breadth-first"] = breadth_first_search(network)
    orders["topological, first in first out"] = _forward(topological_search(network))
    orders["topological, last in first out"] = _forward(last_in_first_out(network))
    plans = {name: plan_of_legs(problem, name, legs) for name, legs in orders.items()}
    rng = stream(0, "precedence")  # the search draws nothing
    plans["topological, shortest"] = exhaustive_shortest(problem, budget=Budget(), rng=rng).plan
    return plans


def last_in_first_out(network: RoadNetwork) -> list[int]:
    """Return the roads in the order of Figure 2 with a set in place of the queue.

    Section 3 allows any set; this one gives back what was put in last, the most lopsided search.
    """
    incoming = np.bincount(network.road_to, minlength=len(network.node_ids))
    waiting = deque(sources(network).tolist())
    order: list[int] = []
    while waiting:
        node = waiting.pop()
        for road in np.flatnonzero(network.road_from == node).tolist():
            order.append(road)
            end = network.road_to[road]
            incoming[end] -= 1
            if incoming[end] == 0:
                waiting.append(end)
    return order


def _forward(roads: Sequence[int]) -> list[int]:
    return [Legs.along(road) for road in roads]


def _legs(network: RoadNetwork, names: Sequence[str]) -> list[int] | None:
    """Return the legs with these names, None if the network has other roads."""
    try:
        return legs_named(network, names)
    except InputError:
        return None


def _movements(problem: Problem, plan: Plan) -> int:
    """Return how often the UAV moves from the end of a road to the start of another place."""
    flights = ([flown.leg for flown in legs] for legs in plan.legs)
    hops = [hop for legs in flights for hop in pairwise(legs)]
    return sum(problem.legs.ends(a)[1] != problem.legs.ends(b)[0] for a, b in hops)


def _never_flown(problem: Problem, plan: Plan) -> str:
    """Return the names of the roads that a plan leaves out, with spaces between."""
    flown = {leg.road for legs in plan.legs for leg in legs}
    roads = enumerate(problem.network.road_ids)
    return " ".join(name for road, name in roads if road not in flown)
