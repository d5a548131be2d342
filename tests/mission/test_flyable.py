"""Plans for a real aircraft: home in time, no worse than one retimed, never above a bound."""

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.bounds.certificate import Effort, certified
from planner.detection.evaluate import evaluate
from planner.errors import ScenarioError
from planner.flight.as_flown import as_flown
from planner.flight.law import Aircraft, FlightLaw
from planner.flight.plan import Plan
from planner.mission.flyable import at_speed, battery_of, planned_to_fly
from planner.mission.opening import open_scenario
from planner.mission.recorder import problem_of
from planner.search.problem import Budget, Problem
from planner.search.rate import rate
from planner.search.result import SearchResult
from planner.search.stop import WorkDone
from support.grid_instance import grid_futures
from support.search_instances import random_problem


def real(problem: Problem, rng: np.random.Generator) -> Problem:
    """The problem of an aircraft with inertia, in some wind, with a battery and a way home."""
    uav, speed = problem.uav, 60.0
    wind = rng.uniform(0, 8)
    angle = rng.uniform(0, 2 * math.pi)
    law = FlightLaw(
        speed,
        acceleration_mps2=rng.uniform(0.5, 3),
        corner_m=rng.uniform(1, 10),
        climb_mps=2.5,
        descend_mps=1.5,
        altitude_m=100.0,
        wind_mps=(wind * math.cos(angle), wind * math.sin(angle)),
    )
    aircraft = Aircraft(law, reserve_s=60.0, headwind_mps=wind)
    home = (uav.x_m, uav.y_m)
    changed = replace(
        uav, speed_mps=speed, aircraft=aircraft, max_flight_time_s=1500.0, return_to_m=home
    )
    return problem.replace(uav=changed)


def by_rate(problem: Problem) -> SearchResult:
    return rate(problem, budget=Budget(work=2000), rng=np.random.default_rng(1))


def expected_s(problem: Problem, plan: Plan) -> float:
    found = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective)
    return found.expected_detection_time_s


@pytest.mark.parametrize("seed", range(10))
def test_it_is_home_in_time_and_under_its_bound(seed: int) -> None:
    problem = real(random_problem(seed), np.random.default_rng(seed))
    found = planned_to_fly(by_rate, problem)
    (track,) = found.plan.tracks
    assert track.time_s[0] == pytest.approx(problem.uav.take_off_s)
    assert track.time_s[-1] <= problem.uav.take_off_s + 1500.0 - 60.0 + 1e-6
    bound = certified(problem, found.plan, Effort(stop=WorkDone(5)))
    assert bound.plan_class == "free"
    assert bound.bound <= bound.value * (1 + 1e-9)
    assert bound.value == pytest.approx(expected_s(problem, found.plan))


@pytest.mark.parametrize("seed", range(10))
def test_it_is_no_worse_than_the_plan_for_full_speed_retimed(seed: int) -> None:
    problem = real(random_problem(seed), np.random.default_rng(seed))
    speeds: list[float] = []

    def once(asked: Problem) -> SearchResult:
        speeds.append(asked.uav.speed_mps)
        return by_rate(asked)

    found = planned_to_fly(once, problem)
    speed = problem.uav.speed_mps
    made, uav = by_rate(at_speed(problem, speed)).plan, problem.uav
    assert uav.aircraft is not None
    retimed = as_flown(made, uav.aircraft.law, battery_of(uav, uav.aircraft), planned_mps=speed)
    assert expected_s(problem, found.plan) <= expected_s(problem, retimed) + 1e-9
    assert speeds[0] == problem.uav.speed_mps
    assert all(speed < problem.uav.speed_mps for speed in speeds[1:])


REAL = (
    "uav.acceleration_mps2=1.4",
    "uav.corner_m=2",
    "uav.climb_mps=2.5",
    "uav.max_flight_time_s=1500",
)


def test_a_scenario_makes_the_aircraft() -> None:
    opened = open_scenario("grid5x5", overrides=[*REAL, "uav.wind={speed_mps=4,from_deg=270}"])
    uav = problem_of(opened, grid_futures(3, np.random.default_rng(1))).uav
    assert uav.aircraft is not None
    assert uav.aircraft.law.wind_mps == pytest.approx((4.0, 0.0))
    assert (uav.aircraft.reserve_s, uav.aircraft.headwind_mps) == (300.0, 4.0)
    calm = open_scenario("grid5x5", overrides=REAL)
    uav = problem_of(calm, grid_futures(3, np.random.default_rng(1))).uav
    assert uav.aircraft is not None
    assert (uav.aircraft.law.wind_mps, uav.aircraft.headwind_mps) == ((0.0, 0.0), 5.0)
    ideal = problem_of(open_scenario("grid5x5"), grid_futures(3, np.random.default_rng(1))).uav
    assert ideal.aircraft is None


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("uav.acceleration_mps2=1.4", "uav.corner_m"),
        ("uav.corner_m=2", "uav.acceleration_mps2"),
        ("uav.acceleration_mps2=0", "uav.acceleration_mps2"),
        ("uav.wind={speed_mps=200,from_deg=0}", "wait for less wind"),
        ("uav.reserve_s=60", "uav.max_flight_time_s"),
    ],
)
def test_what_an_aircraft_cannot_do_is_refused(override: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        open_scenario("grid5x5", overrides=[override])


def test_a_battery_that_is_empty_at_height_is_refused() -> None:
    overrides = ["uav.climb_mps=1", "uav.max_flight_time_s=150", "uav.altitude_m=150"]
    with pytest.raises(ScenarioError, match="leaves no time to search"):
        open_scenario("grid5x5", overrides=overrides)
