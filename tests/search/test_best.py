"""The portfolio: free movement, and an end when nothing is left to try."""

from dataclasses import replace

import numpy as np
import pytest

from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.errors import NotApplicableError
from planner.search.best import best
from planner.search.problem import Budget, Problem
from planner.streams import stream
from support.grid_instance import grid_futures, grid_problem


def value_s(problem: Problem, budget: Budget, seed: int = 1) -> float:
    plan = best(problem, budget=budget, rng=stream(seed, "best")).plan
    found = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective)
    return found.expected_detection_time_s


def grid_3x3() -> Problem:
    futures = grid_futures(200, np.random.default_rng(4), size=4)
    return grid_problem(futures, distance_m=30e3, size=4)


def test_free_movement_finds_sooner_than_roads() -> None:
    problem, work = grid_3x3(), 200_000
    roads, free = (value_s(problem, Budget(work=work, free=free)) for free in (False, True))
    assert free < 0.98 * roads
    assert free == value_s(problem, Budget(work=work, free=True))


def test_a_plan_that_may_leave_the_roads_is_never_worse_than_the_one_it_starts_from() -> None:
    problem = grid_3x3()
    hardly_any = Budget(work=2000, free=True)
    start = replace(hardly_any, work=200, free=False)
    assert value_s(problem, hardly_any) <= value_s(problem, start) + 1e-9


def test_a_sensor_for_roads_alone_keeps_to_them() -> None:
    problem = grid_3x3().replace(sensor=Sensor(500.0, detects_in_transit=False))
    with pytest.raises(NotApplicableError, match="across country"):
        value_s(problem, Budget(work=2000, free=True))


def test_the_search_ends_when_wider_beams_find_nothing_new() -> None:
    """The few orders of a search that is over in minutes; the budget alone would last for hours."""
    near = grid_problem(grid_futures(50, np.random.default_rng(2), size=3), size=3)
    heard: list[int] = []
    problem = near.replace(objective=Objective(400.0))
    budget = Budget(work=10**9, on_progress=lambda done, *_: heard.append(done))
    best(problem, budget=budget, rng=stream(1, "best"))
    assert heard == sorted(heard)
    assert heard[-1] < 10**8
