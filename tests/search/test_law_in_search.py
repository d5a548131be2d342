"""Searches know the flight law: what they promise is what the plan is worth as flown."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.bounds.certificate import Effort, certified
from planner.detection.chase import chased_alone
from planner.detection.evaluate import evaluate
from planner.flight.law import Aircraft, FlightLaw, timed
from planner.flight.plan import Plan
from planner.search.anneal_waypoints import waypoints_of
from planner.search.beam import RewardToGo, beam_of, beam_order
from planner.search.cell_flights import CellBeam, Cells, fly_beam
from planner.search.kernels.turning import corner_loss, loss_on_way
from planner.search.plan import plan_of_legs, plan_of_waypoints
from planner.search.problem import Budget, Problem
from planner.search.rate import rate, rate_order
from planner.search.stop import WorkDone
from planner.search.waypoint_rewards import WaypointRewards
from planner.search.what_if import WhatIf, turning_of
from support.search_instances import random_problem

DRIVEN = (1, 2, 4, 5, 7, 8)  # problems whose targets keep to roads: none jumps out of a sighting
ANGLES = st.floats(0, 2 * math.pi)
LAWS = st.builds(
    FlightLaw,
    st.floats(5, 25),
    acceleration_mps2=st.floats(0.5, 5),
    corner_m=st.floats(0.5, 10),
    wind_mps=st.tuples(st.floats(-3, 3), st.floats(-3, 3)),
)


def way(angle: float | None) -> np.ndarray:
    return np.zeros(2) if angle is None else np.array([math.cos(angle), math.sin(angle)])


def pair(vector: np.ndarray) -> tuple[float, float]:
    return float(vector[0]), float(vector[1])


@settings(max_examples=60, deadline=None)
@given(LAWS, ANGLES, ANGLES)
def test_a_corner_delays_as_the_exact_law_says(law: FlightLaw, first: float, second: float) -> None:
    """Two legs of 2 km, long enough to brake and accelerate on: from rest, round it, to rest."""
    before, after = way(first), way(second)
    xy_m = 2000.0 * np.array([[0.0, 0.0], before, before + after])
    even_s = float((2000.0 / law.over_ground_mps(np.array([before, after]))).sum())
    rest = np.zeros(2)
    ends_s = law.corner_loss_s(rest, before) + law.corner_loss_s(after, rest)
    exact_s = float(timed(xy_m, np.zeros(3), law).arrives_s[-1])
    lost_s = float(law.corner_loss_s(before, after))
    assert lost_s == pytest.approx(exact_s - even_s - float(ends_s), abs=1e-6)
    kernel_s = corner_loss(pair(before), pair(after), turning_of(law))
    assert kernel_s == pytest.approx(lost_s, abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(LAWS, st.none() | ANGLES, st.none() | ANGLES)
def test_rest_is_a_corner_too(law: FlightLaw, first: float | None, second: float | None) -> None:
    before, after = way(first), way(second)
    kernel_s = corner_loss(pair(before), pair(after), turning_of(law))
    assert kernel_s == pytest.approx(float(law.corner_loss_s(before, after)), abs=1e-9)
    assert kernel_s >= 0.0
    assert corner_loss(pair(before), pair(after), turning_of(FlightLaw(20.0))) == 0.0


def real(
    problem: Problem, rng: np.random.Generator, *, speed: float = 60.0, windy: float = 0.1
) -> Problem:
    """The problem of an aircraft with inertia, in some wind, with a battery and a way home."""
    uav = problem.uav
    wind, angle = rng.uniform(0, windy * speed), rng.uniform(0, 2 * math.pi)
    law = FlightLaw(
        speed,
        acceleration_mps2=rng.uniform(1, 3),
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


def ideal(problem: Problem) -> Problem:
    """The same problem of an aircraft at its height that flies at full speed at once."""
    return problem.replace(uav=replace(problem.uav.at_height, aircraft=None))


def reward_of(problem: Problem, plan: Plan) -> float:
    seen_at = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective).seen_at
    return float(problem.futures.weight @ problem.objective.reward(seen_at))


def by_rate(problem: Problem) -> Plan:
    return rate(problem, budget=Budget(work=2000), rng=np.random.default_rng(1)).plan


@pytest.mark.parametrize("seed", range(10))
def test_it_is_home_in_time_and_under_its_bound(seed: int) -> None:
    """Also for one that cuts corners: it sees as if its radius were that much larger."""
    problem = real(random_problem(seed), np.random.default_rng(seed))
    plan = by_rate(problem)
    (track,) = plan.tracks
    assert track.time_s[0] == pytest.approx(problem.uav.take_off_s)
    assert track.time_s[-1] <= problem.uav.take_off_s + 1500.0 - 60.0 + 1e-6
    bound = certified(problem, plan, Effort(stop=WorkDone(5)))
    assert bound.plan_class == "free"
    worth = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective)
    assert bound.value == pytest.approx(worth.expected_detection_time_s)
    wider = replace(problem.sensor, radius_m=problem.sensor.radius_m + problem.uav.strays_m)
    cut = evaluate(plan.tracks, problem.futures, wider, problem.objective)
    assert bound.bound <= cut.expected_detection_time_s * (1 + 1e-9)
    soonest = chased_alone(problem.futures, problem.uav, problem.sensor)
    assert np.all(soonest <= cut.seen_at + 1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_turns_on_the_way_to_legs_are_those_of_the_kernels(seed: int) -> None:
    problem = real(random_problem(seed), np.random.default_rng(seed))
    legs, turning = problem.legs, turning_of(problem.legs.law)
    for before in (None, 0, 3):
        node = 0 if before is None else int(legs.to_node[before])
        x_m, y_m = legs.node_xy_m[node].tolist()
        heading = (0.0, 0.0) if before is None else pair(legs.last_way[before])
        lost_s = legs.turns_s(x_m, y_m, before)
        for leg in range(len(legs)):
            offset = legs.node_xy_m[legs.from_node[leg]] - (x_m, y_m)
            away_m = float(np.hypot(*offset))
            transit = pair(offset / away_m) if away_m > 0.0 else (0.0, 0.0)
            slow_s = loss_on_way(heading, transit, pair(legs.first_way[leg]), turning)
            assert lost_s[leg] == pytest.approx(slow_s, abs=1e-9)


@pytest.mark.parametrize("seed", DRIVEN)
def test_a_road_beam_keeps_its_promise(seed: int) -> None:
    """The compiled beam, and the what-if engine leg by leg, know of the same corners."""
    problem = real(random_problem(seed), np.random.default_rng(seed), speed=25.0, windy=0.0)
    engine = WhatIf(problem)
    to_go = RewardToGo.of(problem, rate_order(engine))
    order, _ = beam_order(engine, beam_of(problem, 10), to_go)
    state, reward = problem.first_state, 0.0
    for leg in order:
        scores = engine.score(state, np.array([leg]))
        flights = engine.fly(state, np.array([leg]))
        reward += float(scores.reward[0])
        seen_at = np.minimum(state.seen_at, flights.seen(0, len(problem.futures)))
        after = state.after(problem.legs, leg, seen_at)
        assert after.time_s == pytest.approx(float(scores.end_s[0]))
        state = after
    even = ideal(problem)
    assert sum(problem.legs.duration_s[order]) > sum(even.legs.duration_s[order]) - 1e-9
    flown = reward_of(problem, plan_of_legs(problem, "any", order))
    assert reward == pytest.approx(flown, abs=10.0)


@pytest.mark.parametrize("seed", DRIVEN)
def test_a_cell_beam_keeps_its_promise(seed: int) -> None:
    problem = random_problem(seed, particles=200)
    problem = problem.replace(sensor=replace(problem.sensor, detects_in_transit=True))
    problem = real(problem, np.random.default_rng(seed), speed=25.0)
    found = fly_beam(Cells.of(problem, 3e4), CellBeam(4))
    flown = reward_of(problem, plan_of_waypoints(problem, "any", found.waypoints))
    assert found.reward == pytest.approx(flown, abs=10.0)


@pytest.mark.parametrize("seed", DRIVEN[:3])
def test_waypoints_are_worth_what_the_sweep_says(seed: int) -> None:
    """What patterns are tuned by, and waypoints annealed, knows of corners and stops too."""
    problem = random_problem(seed, particles=200)
    problem = problem.replace(sensor=replace(problem.sensor, detects_in_transit=True))
    problem = real(problem, np.random.default_rng(seed), speed=25.0, windy=0.0)
    rng = np.random.default_rng(seed)
    stops = problem.network.node_xy_m[rng.integers(0, len(problem.network.node_xy_m), 6)]
    waypoints = np.column_stack([stops, rng.choice([0.0, 40.0], 6)])
    plan = plan_of_waypoints(problem, "any", waypoints)
    said = WaypointRewards(problem).of(waypoints)
    assert said == pytest.approx(reward_of(problem, plan), abs=10.0)
    again = plan_of_waypoints(problem, "any", waypoints_of(problem, plan))
    assert reward_of(problem, again) == pytest.approx(reward_of(problem, plan), abs=0.1)
