"""Fleets: flight by flight and all at once, several flights of one UAV, and who adds nothing."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor, rate_of
from planner.flight.law import Aircraft, FlightLaw
from planner.flight.plan import Plan
from planner.flight.separation import APART_M, course_of, keeps_apart
from planner.flight.uav import Uav
from planner.search.best import best
from planner.search.fleet import fleet
from planner.search.methods import Planner
from planner.search.problem import Budget, Problem
from planner.search.rate import rate
from planner.streams import stream
from support.instances import figure3, physics_futures

PATHS = (["AB", "BC", "CE"], ["AB", "BC", "CF"], ["AB", "BD", "DF"], ["AB", "BD", "DG"])


def on_figure3(*, detects: float = 1.0) -> Problem:
    speeds = np.repeat(np.linspace(8.0, 40.0, 6), 4)
    futures = physics_futures(figure3(), list(PATHS) * 6, 0.0, speeds, horizon_s=1_500.0)
    uav = Uav(x_m=-3_000.0, y_m=0.0, take_off_s=200.0, speed_mps=100.0)
    sensor = Sensor(300.0, rate_per_s=rate_of(detects, 300.0, 100.0))
    return Problem(figure3(), futures, uav, sensor, Objective(1_500.0))


def above(problem: Problem, **changes: object) -> Problem:
    """Return the problem of another UAV, which flies higher."""
    height_m = problem.uav.altitude_m + APART_M
    return problem.replace(uav=replace(problem.uav, altitude_m=height_m, **changes))  # type: ignore[arg-type]


def planned(problems: Sequence[Problem], planner: Planner = best, work: int = 500) -> Plan:
    budget, rng = Budget(work=work), stream(1, "fleet")
    found = fleet(problems, planner, budget=budget, rng=rng, together=planner is best)
    return found.plan


def value_s(problem: Problem, plan: Plan) -> float:
    """Return the expected detection time of all flights of a plan together."""
    flown = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective)
    return flown.expected_detection_time_s


def tracks_of(plan: Plan) -> list[list[list[float]]]:
    return [np.stack([one.time_s, one.x_m, one.y_m]).tolist() for one in plan.tracks]


@pytest.mark.parametrize("detects", [1.0, 0.7])
def test_two_find_sooner_than_one_and_together_sooner_than_apart(detects: float) -> None:
    problem = on_figure3(detects=detects)
    alone = best(problem, budget=Budget(work=500), rng=stream(1, "fleet")).plan
    pair = (problem, above(problem))
    both = planned(pair)
    twice = Plan("twice", alone.tracks * 2, alone.legs * 2)
    by_rate = planned(pair, rate)
    assert len(both.tracks) == 2
    assert value_s(problem, both) < value_s(problem, twice) - 1.0
    assert value_s(problem, both) < value_s(problem, by_rate) + 1e-6
    assert value_s(problem, both) < value_s(problem, alone)


def test_the_same_fleet_is_planned_the_same() -> None:
    problem = on_figure3()
    one, again = (planned((problem, above(problem)), rate) for _ in range(2))
    assert tracks_of(one) == tracks_of(again)


def test_who_takes_off_after_the_horizon_adds_nothing() -> None:
    problem = on_figure3()
    late = above(problem, take_off_s=2_000.0)
    alone = fleet((problem,), rate, budget=Budget(), rng=stream(1, "fleet"), together=False).plan
    with_late = planned((problem, late), rate)
    assert tracks_of(with_late) == tracks_of(alone)
    assert [flight.uav for flight in with_late.flights] == [0]


def test_a_uav_flies_again_once_its_battery_is_swapped() -> None:
    problem = on_figure3()
    uav = replace(
        problem.uav, max_flight_time_s=450.0, return_to_m=(-3_000.0, 0.0), sorties=3, swap_s=40.0
    )
    again = problem.replace(uav=uav)
    plan = planned((again,), best, 500)
    assert [flight.number for flight in plan.flights] == [0, 1, 2]
    for one, after in pairwise(plan.tracks):
        assert one.end_s - one.time_s[0] <= 450.0 + 1e-6
        assert after.time_s[0] >= one.end_s + 40.0 - 1e-6
        assert (one.x_m[-1], one.y_m[-1]) == (-3_000.0, 0.0)
    once = problem.replace(uav=replace(uav, sorties=1))
    assert value_s(problem, plan) < value_s(problem, planned((once,), rate))


def test_two_uavs_in_relay_are_never_both_down_for_long() -> None:
    problem = on_figure3()
    uav = replace(
        problem.uav, max_flight_time_s=300.0, return_to_m=(-3_000.0, 0.0), sorties=2, swap_s=300.0
    )
    first = problem.replace(uav=uav)
    second = above(first, take_off_s=500.0)
    plan = planned((first, second), rate)
    spans = sorted((float(track.time_s[0]), track.end_s) for track in plan.tracks)
    assert len(spans) == 4
    assert max(b[0] - a[1] for a, b in pairwise(spans)) < 150.0


@pytest.mark.parametrize("seed", range(4))
def test_random_fleets_of_real_aircraft_keep_apart(seed: int) -> None:
    rng = np.random.default_rng(seed)
    home_m = (float(rng.uniform(-900.0, 900.0)), 0.0)
    problems = []
    for number in range(int(rng.integers(2, 4))):
        height_m = 60.0 + 15.0 * number * float(rng.random() < 0.7)
        law = FlightLaw(60.0, 5.0, 5.0, climb_mps=2.5, descend_mps=2.0, altitude_m=height_m)
        uav = Uav(
            *home_m,
            0.0,
            60.0,
            height_m,
            max_flight_time_s=500.0,
            return_to_m=home_m,
            aircraft=Aircraft(law),
        )
        problems.append(on_figure3().replace(uav=uav))
    plan = planned(problems, rate)
    courses = [
        course_of(track, problem.uav) for track, problem in zip(plan.tracks, problems, strict=True)
    ]
    assert all(keeps_apart(one, courses[:i]) for i, one in enumerate(courses))
