"""Free flights over a space-time cell index: what flights see, and what beams of them owe."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.arrays import Floats
from planner.detection.evaluate import evaluate
from planner.detection.first_detection import first_detection
from planner.detection.kernels.closest_approach import Window
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.flight.uav import Uav
from planner.search.cell_beam import cells, free_plans
from planner.search.cell_flights import CellBeam, Cells, fly_beam
from planner.search.dashes import dashes, portfolio
from planner.search.kernels.cell_beam import nobody_seen
from planner.search.kernels.cell_index import SEEN, look
from planner.search.kernels.motion import Course
from planner.search.plan import plan_of_waypoints
from planner.search.problem import Budget, Problem
from support.grid_instance import grid_futures
from support.instances import figure3, grid, physics_futures
from support.search_instances import driven, random_network, strayed


def some_problem(seed: int, *, home: bool = False) -> Problem:
    """Roads or none, targets slow and fast, at rest, late and gone; a battery or none."""
    rng = np.random.default_rng(seed)
    network = random_network(rng)
    futures = driven(network, rng, 30) if rng.random() < 0.6 else strayed(rng, 30)
    x_m, y_m = rng.uniform(0, 12e3, 2)
    lasts_s = float(rng.choice([np.inf, 900.0]))
    land = (float(rng.uniform(0, 12e3)), 0.0) if home and lasts_s < np.inf else None
    uav = Uav(x_m, y_m, float(rng.choice([0.0, 150.0])), 80.0, 0.0, lasts_s, land)
    by_s = float(rng.uniform(200, 1200)) if rng.random() < 0.3 else None
    sensor = Sensor(float(rng.choice([60.0, 400.0])))
    return Problem(network, futures, uav, sensor, Objective(1500.0, by_s))


def expected_reward(problem: Problem, plan: Plan) -> float:
    seen_at = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective).seen_at
    return float(problem.weight_at_start @ problem.objective.reward(seen_at))


def ends(problem: Problem, plan: Plan) -> Floats:
    return np.array([plan.tracks[0].x_m[-1], plan.tracks[0].y_m[-1]])


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_a_flight_sees_whom_detection_sees(seed: int) -> None:
    problem, rng = some_problem(seed), np.random.default_rng(seed)
    index = Cells.of(problem).index
    x_m, y_m = rng.uniform(-1e3, 13e3, 2)
    vx, vy = rng.uniform(-90.0, 90.0, 2) * float(rng.random() < 0.8)
    searched_s = problem.objective.ends_s - problem.uav.take_off_s
    from_s = problem.uav.take_off_s + float(rng.uniform(0.0, 0.95 * max(searched_s, 0.0)))
    to_s = min(from_s + float(rng.exponential(150.0)), max(problem.objective.ends_s, from_s))
    looked = nobody_seen(len(problem.futures), False)
    seen_in = looked.seen_in
    already = rng.random(len(seen_in)) < 0.2
    seen_in[already] = SEEN
    gain = look(Course(x_m, y_m, vx, vy, from_s), Window(from_s, to_s), index, looked, 7)

    time_s, lasts_s = np.array([from_s, to_s]), to_s - from_s
    places = np.array([x_m, x_m + vx * lasts_s]), np.array([y_m, y_m + vy * lasts_s])
    track = Track(time_s, *places, time_s[None])
    seen_at = first_detection(problem.futures, track, problem.sensor.radius_m)
    seen_at[already] = np.inf
    assert np.array_equal(seen_in == 7, np.isfinite(seen_at))
    weight = problem.futures.weight
    assert gain.reward == pytest.approx(weight @ problem.objective.reward(seen_at), abs=1e-9)
    assert gain.weight == pytest.approx(weight[np.isfinite(seen_at)].sum())


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_a_beam_promises_what_its_flight_is_worth(seed: int) -> None:
    problem = some_problem(seed)
    first_m = (6e3, 6e3) if seed % 2 else None
    flight = fly_beam(Cells.of(problem), CellBeam(2, headings=8), first_m)
    plan = plan_of_waypoints(problem, "", flight.waypoints)
    # The deadline may fall on a sighting, which rounding then decides.
    assert expected_reward(problem, plan) == pytest.approx(flight.reward, rel=1e-6, abs=1e-9)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_the_uav_always_comes_home(seed: int) -> None:
    problem = some_problem(seed, home=True)
    flight = fly_beam(Cells.of(problem), CellBeam(1, headings=8))
    plan = plan_of_waypoints(problem, "", flight.waypoints)
    assert plan.end_s <= problem.uav.landing_s + 1e-6
    # The way home is flown after all that has been promised, and may see more.
    assert expected_reward(problem, plan) >= flight.reward * (1.0 - 1e-6)
    if problem.uav.return_to_m is not None and len(flight.waypoints):
        assert ends(problem, plan) == pytest.approx(problem.uav.return_to_m)


@pytest.mark.parametrize("seed", range(3))
def test_a_beam_wide_enough_finds_the_best_of_all_flights(seed: int) -> None:
    """All chains of moves of two lengths in four headings, or none, in three ticks."""
    rng = np.random.default_rng(seed)
    futures = strayed(rng, 30)
    uav, sensor = Uav(6e3, 6e3, 0.0, 50.0), Sensor(1500.0)
    problem = Problem(random_network(rng), futures, uav, sensor, Objective(180.0))
    cells_, stops = Cells.of(problem), (1, 2)
    beam = CellBeam(10**6, headings=4, stops=stops, places=0, apart_radii=1e-9, dense=10**6)
    found = fly_beam(cells_, beam)

    step_m = uav.speed_mps * cells_.ticks.lasts_s
    ways = [*(step_m * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])), np.zeros(2)]
    field, best = cells_.field, 0.0
    for moves in product(product(ways, stops), repeat=3):
        way, at, ticks = [], np.array([uav.x_m, uav.y_m]), 0
        for step, many in moves:
            if ticks + many > 3:
                break
            at, ticks = at + many * step, ticks + many
            if not (field.low_x_m <= at[0] <= field.high_x_m):
                break
            if not (field.low_y_m <= at[1] <= field.high_y_m):
                break
            way.append([*at, 0.0 if step.any() else many * cells_.ticks.lasts_s])
        best = max(best, expected_reward(problem, plan_of_waypoints(problem, "", np.array(way))))
    assert found.reward == pytest.approx(best)


def test_budgets_are_kept_and_a_stop_is_heard() -> None:
    problem = some_problem(3)
    for work in (50, 4000, 30_000):
        flights, done = portfolio(problem, work)
        assert flights
        assert len(flights[0].waypoints)
        # The last tick of each flight is grown whole, however few rays there are.
        assert done <= 1.1 * work + 1000
    asked = iter(range(10**9))
    flights, done = portfolio(problem, 10**7, stop=lambda: next(asked) >= 40)
    assert flights
    assert done < 10**5


def test_some_particles_stand_for_all() -> None:
    all_of_them = Cells.of(some_problem(3))
    few = all_of_them.some(10, 33)
    assert few.ticks.many == 34
    assert few.index.weight.sum() == pytest.approx(all_of_them.index.weight.sum())
    assert (few.index.weight > 0.0).sum() == 10


def test_what_unseen_particles_bring_is_what_the_flight_earns_later() -> None:
    problem = some_problem(8)
    cells_ = Cells.of(problem)
    flight = fly_beam(cells_, CellBeam(1))
    plan = plan_of_waypoints(problem, "", flight.waypoints)
    seen_at = first_detection(problem.futures, plan.tracks[0], problem.sensor.radius_m)
    brings, weight = cells_.brings(flight), problem.futures.weight
    for tick in (0, 3, 200, 700):
        later = seen_at > cells_.ticks.begin_s + tick * cells_.ticks.lasts_s
        earned = weight[later] @ problem.objective.reward(seen_at[later])
        assert brings[tick] == pytest.approx(earned / weight[later].sum())


def test_dashes_start_out_all_around_and_from_outside_go_all_over() -> None:
    problem = some_problem(4).replace(uav=Uav(6e3, 6e3, 0.0, 80.0))
    inside = dashes(Cells.of(problem))
    far = dashes(Cells.of(problem.replace(uav=Uav(-90e3, 6e3, 0.0, 80.0))))
    for goals, start in ((inside, (6e3, 6e3)), (far, None)):
        assert (goals[0] is None) == (start is not None)
        assert len(set(goals)) == len(goals) > 20
        if start is not None:
            offset = np.subtract(np.array(goals[1:6]), start)
            assert len(np.unique(np.arctan2(offset[:, 1], offset[:, 0]).round(3))) >= 2


def test_proposals_are_searched_and_the_holdout_chooses() -> None:
    network = figure3()
    targets = [
        physics_futures(network, [path.split()] * 20, 0.0, np.linspace(8.0, 25.0, 20))
        for path in ("AB BC CE", "AB BD DG")
    ]
    uav = Uav(-5e3, 0.0, 0.0, 100.0)
    problem = Problem(network, targets[0], uav, Sensor(200.0), Objective(3600.0))
    proposed = problem.replace(proposals=targets[1])
    flights, _ = portfolio(proposed, 2000)
    again, _ = portfolio(problem.replace(futures=targets[1]), 2000)
    assert [flight.reward for flight in flights] == [flight.reward for flight in again]
    # A search that has begun has seen some of its own particles, none of the others.
    begun = proposed.replace(start=problem.first_state)
    assert Cells.of(begun).index.weight.sum() == pytest.approx(problem.weight_at_start.sum())
    assert np.array_equal(Cells.of(begun).index.weight, problem.weight_at_start)


def test_a_plan_that_sees_nearly_all_may_end_on_patrol() -> None:
    rng = np.random.default_rng(5)
    uav = Uav(-2e3, 2e3, 0.0, 100.0)
    problem = Problem(
        grid(3, 3), grid_futures(60, rng, size=3), uav, Sensor(500.0), Objective(10000.0)
    )
    flights, _ = portfolio(problem, 40_000)
    assert len(free_plans(problem, flights, "cells")) > len(flights)
    made = cells(problem, budget=Budget(work=40_000), rng=rng)
    best = max(expected_reward(problem, plan) for plan in free_plans(problem, flights, "cells"))
    assert expected_reward(problem, made.plan) == pytest.approx(best)
