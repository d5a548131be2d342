"""No plan on the paper's grid is better than a certificate of another plan allows."""

import numpy as np
import pytest

from planner.bounds.certificate import Certificate, Effort, certified
from planner.detection.first_detection import first_detection
from planner.detection.objective import Objective
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from planner.search.rate import rate_order
from planner.search.stop import WorkDone
from planner.search.what_if import WhatIf
from support.grid_instance import grid_futures, grid_problem


def value_of(problem: Problem, order: list[int]) -> float:
    track = plan_of_legs(problem, "", order).tracks[0]
    seen_at = first_detection(problem.futures, track, problem.sensor.radius_m)
    return problem.objective.value(
        float(problem.futures.weight @ problem.objective.reward(seen_at))
    )


def changed(order: list[int], legs: int, rng: np.random.Generator) -> list[int]:
    """An order with one leg more, one less, another one, or one turned round."""
    i = int(rng.integers(len(order)))
    kind, leg = rng.integers(4), int(rng.integers(legs))
    middle = ([leg, order[i]], [], [leg], [order[i] ^ 1])[kind]
    return [*order[:i], *middle, *order[i + 1 :]] or [leg]


def is_never_passed(problem: Problem, certificate: Certificate, value: float) -> bool:
    if problem.objective.by_s is None:
        return value >= certificate.bound - 1e-9 * problem.horizon_s
    return value <= certificate.bound + 1e-9


@pytest.mark.parametrize("plans", [1000, pytest.param(4000, marks=pytest.mark.long)])
@pytest.mark.parametrize("distance_m", [0.0, 60_000.0, 180_000.0])
@pytest.mark.parametrize("deadline", [False, True])
@pytest.mark.parametrize("transit", [False, True])
def test_thousands_of_plans_stay_behind_the_bound(
    transit: bool, deadline: bool, distance_m: float, plans: int
) -> None:
    """Random ones, and ones that grow ever better by random changes to the plan certified."""
    rng = np.random.default_rng(int(distance_m) + 2 * transit + deadline)
    futures, ready_s = grid_futures(24, rng), distance_m / 100.0
    problem = grid_problem(futures, distance_m=distance_m, detects_in_transit=transit)
    problem = problem.replace(
        objective=Objective(ready_s + 3000.0, ready_s + 600.0 if deadline else None)
    )
    legs, best = len(problem.legs), rate_order(WhatIf(problem))
    certificate = certified(problem, plan_of_legs(problem, "", best), Effort(stop=WorkDone(60)))
    assert certificate.gap < 1.0
    for _ in range(plans):
        order = rng.integers(legs, size=12).tolist()
        assert is_never_passed(problem, certificate, value_of(problem, order))
    best, best_value = list(best), certificate.value
    for _ in range(plans):
        order = changed(best, legs, rng)
        value = value_of(problem, order)
        assert is_never_passed(problem, certificate, value)
        if value == best_value or (value < best_value) != deadline:
            best, best_value = order, value
