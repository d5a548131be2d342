"""Where ``wait`` flies, and what it sees there."""

import numpy as np
import pytest

from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.errors import NotApplicableError
from planner.flight.plan import Plan
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.search.problem import Budget, Problem
from planner.search.wait import busiest_end, wait
from support.instances import figure3, physics_futures

TO_E, TO_F, TO_G = ["AB", "BC", "CE"], ["AB", "BC", "CF"], ["AB", "BD", "DG"]
E, F, G = (15e3, 8e3), (15e3, 0.0), (15e3, -8e3)


def futures_to(*routes: list[str], weight: list[float], **options: float | bool) -> Futures:
    return physics_futures(figure3(), routes, 0.0, 20.0, weight=weight, **options)


def problem_with(
    futures: Futures, *, max_flight_time_s: float = np.inf, in_transit: bool = True
) -> Problem:
    uav = Uav(0.0, 8e3, 10.0, 100.0, max_flight_time_s=max_flight_time_s)
    return Problem(figure3(), futures, uav, Sensor(200.0, in_transit), Objective(3600.0))


def planned(problem: Problem) -> tuple[Plan, Evaluation]:
    plan = wait(problem, budget=Budget(), rng=np.random.default_rng(0)).plan
    return plan, evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective)


def test_weight_decides_not_number() -> None:
    futures = futures_to(TO_E, TO_F, TO_F, TO_G, weight=[0.6, 0.1, 0.1, 0.2])
    assert busiest_end(futures, futures.weight, 200.0) == E


def test_ends_within_the_radius_belong_together() -> None:
    # Two stop 150 m apart before F, and neither weighs as much as the one at E.
    futures = physics_futures(
        figure3(),
        [TO_E, TO_F, TO_F],
        0.0,
        20.0,
        weight=[0.4, 0.35, 0.25],
        stop_m=[np.inf, 12000.0, 12150.0],
    )
    assert busiest_end(futures, futures.weight, 100.0) == E
    assert busiest_end(futures, futures.weight, 200.0) == pytest.approx(tuple(futures.xy(1, 1e9)))


def test_ties_go_to_the_first_particle() -> None:
    weight = [1 / 3] * 3
    assert busiest_end(futures_to(TO_G, TO_E, TO_F, weight=weight), np.array(weight), 200.0) == G
    assert busiest_end(futures_to(TO_F, TO_G, TO_E, weight=weight), np.array(weight), 200.0) == F


@pytest.mark.parametrize("gone", [False, True])
def test_targets_are_seen_as_they_arrive(gone: bool) -> None:
    futures = futures_to(TO_E, TO_G, weight=[0.9, 0.1], gone=gone)
    plan, seen = planned(problem_with(futures, in_transit=False))
    assert plan.tracks[0].xy(3600.0).tolist() == list(E)
    before_end_s = 200.0 / 20.0  # the radius at the target's speed
    assert seen.seen_at[0] == pytest.approx(futures.end_s[0] - before_end_s)
    assert seen.seen_at[1] == np.inf


@pytest.mark.parametrize("in_transit", [True, False])
def test_landing_on_the_way(in_transit: bool) -> None:
    futures = futures_to(TO_E, weight=[1.0])
    problem = problem_with(futures, max_flight_time_s=75.0, in_transit=in_transit)
    track = planned(problem)[0].tracks[0]
    assert track.end_s == 85.0
    assert track.xy(85.0) == pytest.approx((7500.0, 8000.0))
    assert track.sensor_on.tolist() == ([[10.0, 85.0]] if in_transit else [])


def test_landing_while_waiting() -> None:
    futures = futures_to(TO_E, weight=[1.0])
    track = planned(problem_with(futures, max_flight_time_s=400.0))[0].tracks[0]
    assert track.time_s.tolist() == [10.0, 160.0, 410.0]


def test_nobody_to_wait_for() -> None:
    futures = futures_to(TO_E, weight=[1.0], depart_s=1e4, horizon_s=3600.0)
    with pytest.raises(NotApplicableError, match="no particle"):
        planned(problem_with(futures))
