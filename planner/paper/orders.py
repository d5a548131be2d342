"""Section 4.1 of the paper: every order and direction of a small net's roads, and where plans lie.

The paper names 2^7 7! = 645,120 search orders of its Figure 3 and then narrows them down; here all
of them are flown against all futures.
"""

from typing import Any

import numpy as np

from planner.arrays import Floats
from planner.detection.evaluate import evaluate
from planner.experiments.condition import Condition
from planner.mission.planning import make_plan, problem_of
from planner.mission.recorder import Recorder
from planner.search.exact import OrderValues, enumerate_orders
from planner.search.methods import method_named
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from planner.streams import stream

COMPARED = ("exact", "best", "lookahead", "rate", "greedy", "exhaustive", "exhaustive-shortest")
BINS = 120
FLOWN = 500  # orders drawn at random and flown on their own, to check the enumeration
SAME_S = 1e-6  # values this close are equal


def orders_of(condition: Condition) -> dict[str, Any]:
    """Return the distribution of E[min(tau, horizon)] over all orders, and each method's place.

    ``rows`` hold a value in seconds and the share of all orders that are better by more than
    rounding; ``edges_s`` and ``counts`` a histogram.
    """
    opened = condition.opened()
    futures = Recorder(opened, 1).planning().futures
    problem = problem_of(opened, futures)
    every = enumerate_orders(problem)
    rows = [
        _row("all orders: mean", float(every.value.mean()), every.value),
        _row("all orders: median", float(np.median(every.value)), every.value),
        _row("all orders: best", float(every.value.min()), every.value),
        _row("all orders: worst", float(every.value.max()), every.value),
        _random_row(problem, every, condition.seed),
    ]
    for name in COMPARED:
        plan = make_plan(method_named(name), opened, Recorder(opened, 1), futures).plan
        flown = evaluate(plan.tracks, futures, problem.sensor, problem.objective)
        rows.append(_row(name, flown.expected_detection_time_s, every.value))
    counts, edges_s = np.histogram(every.value, BINS)
    rows = [row | {"futures": len(futures)} for row in rows]
    return {"rows": rows, "edges_s": edges_s.tolist(), "counts": counts.tolist()}


def _row(name: str, value_s: float, values: Floats) -> dict[str, Any]:
    better = float((values < value_s - SAME_S).mean())
    return {
        "what": name,
        "expected_detection_time_s": value_s,
        "orders_better": better,
        "orders": len(values),
        "standard_error_s": None,
    }


def _random_row(problem: Problem, every: OrderValues, seed: int) -> dict[str, Any]:
    """Return the mean of orders drawn at random, each flown and evaluated as plans are."""
    drawn = stream(seed, "orders").integers(0, len(every), FLOWN).tolist()
    flown = np.array([_value(problem, every.order(index)) for index in drawn])
    row = _row(f"{FLOWN} random orders: mean", float(flown.mean()), every.value)
    apart = np.abs(flown - every.value[drawn]).max()
    assert apart < SAME_S, f"an order flown on its own differs by {apart} s from the enumeration"
    return row | {"standard_error_s": float(flown.std(ddof=1) / FLOWN**0.5)}


def _value(problem: Problem, order: tuple[int, ...]) -> float:
    plan = plan_of_legs(problem, "", order)
    flown = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective)
    return flown.expected_detection_time_s
