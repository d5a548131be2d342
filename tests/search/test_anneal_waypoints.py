"""Free movement: what the incremental sweep sees, and what the annealed flights owe."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.arrays import Floats
from planner.detection.evaluate import evaluate
from planner.detection.first_detection import first_detection
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.errors import NotApplicableError
from planner.flight.plan import Plan
from planner.flight.uav import Uav
from planner.search.anneal_waypoints import (
    MOVE,
    AnnealedFlight,
    Annealing,
    anneal_waypoints,
    times_left,
    waypoints_of,
)
from planner.search.plan import plan_of_waypoints
from planner.search.problem import Budget, Problem
from support.grid_instance import grid_futures, grid_problem
from support.instances import figure3, physics_futures
from support.search_instances import driven, random_network, strayed


def some_problem(seed: int) -> Problem:
    """Roads or none, targets slow and fast, at rest, late and gone; a battery; a way home."""
    rng = np.random.default_rng(seed)
    network = random_network(rng)
    futures = driven(network, rng, 30) if rng.random() < 0.6 else strayed(rng, 30)
    lasts_s = float(rng.choice([np.inf, 300.0, 900.0]))
    home = (float(rng.uniform(0, 12e3)), 0.0) if rng.random() < 0.5 and lasts_s < np.inf else None
    x_m, y_m = rng.uniform(0, 12e3, 2)
    uav = Uav(x_m, y_m, float(rng.choice([0.0, 150.0])), 80.0, 0.0, lasts_s, home)
    sensor = Sensor(float(rng.choice([60.0, 400.0])))
    by_s = float(rng.uniform(200, 1200)) if rng.random() < 0.3 else None
    return Problem(network, futures, uav, sensor, Objective(1500.0, by_s))


def wandering(problem: Problem, rng: np.random.Generator, count: int = 8) -> Floats:
    waypoints = rng.uniform(-1e3, 13e3, (count, 3))
    waypoints[:, 2] = np.maximum(0.0, rng.uniform(-60, 60, count))
    return waypoints


def reward(problem: Problem, plan: Plan) -> float:
    seen_at = first_detection(problem.futures, plan.tracks[0], problem.sensor.radius_m)
    return float(problem.futures.weight @ problem.objective.reward(seen_at))


def annealed(problem: Problem, start: Floats | None, seed: int = 3, moves: int = 600) -> Plan:
    rng = np.random.default_rng(seed)
    return anneal_waypoints(problem, budget=Budget(work=MOVE * moves), rng=rng, start=start).plan


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_after_any_moves_the_known_flight_is_what_detection_says(seed: int) -> None:
    """Hot, so that nearly every move is taken; the finished way is flown by other code."""
    problem = some_problem(seed)
    rng = np.random.default_rng(seed)
    known = AnnealedFlight.of(problem, wandering(problem, rng))
    for _ in range(4):
        known.anneal(rng.random((15, 9)), np.full(15, 1e6))
        plan = plan_of_waypoints(problem, "", known.waypoints)
        seen_at = first_detection(problem.futures, plan.tracks[0], problem.sensor.radius_m)
        seen_at[seen_at > problem.objective.ends_s] = np.inf
        assert known.seen_at == pytest.approx(seen_at, abs=1e-6)
        expected = problem.futures.weight @ problem.objective.reward(seen_at)
        assert known.reward == pytest.approx(expected, rel=1e-9, abs=1e-7)
    assert known.taken > 10


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_never_worse_than_its_start_and_flown_as_the_uav_can(seed: int) -> None:
    problem = some_problem(seed)
    uav, start = problem.uav, wandering(problem, np.random.default_rng(seed))
    plan = annealed(problem, start, moves=300)
    track = plan.tracks[0]
    assert reward(problem, plan) >= reward(problem, plan_of_waypoints(problem, "", start)) - 1e-9
    metres = np.hypot(np.diff(track.x_m), np.diff(track.y_m))
    assert np.all(metres <= uav.speed_mps * np.diff(track.time_s) * (1 + 1e-9) + 1e-6)
    assert (track.time_s[0], track.x_m[0], track.y_m[0]) == (uav.take_off_s, uav.x_m, uav.y_m)
    assert track.end_s <= uav.landing_s + 1e-6
    assert track.sensor_on.tolist() == [[track.time_s[0], track.end_s]]
    assert plan.legs == ((),)
    if uav.return_to_m is not None and _near_enough(uav):
        assert (track.x_m[-1], track.y_m[-1]) == pytest.approx(uav.return_to_m, abs=1e-3)


def _near_enough(uav: Uav) -> bool:
    assert uav.return_to_m is not None
    home_m = np.hypot(uav.x_m - uav.return_to_m[0], uav.y_m - uav.return_to_m[1])
    return bool(home_m < 0.999 * uav.max_flight_time_s * uav.speed_mps)


def test_the_same_stream_gives_the_same_plan_and_another_another() -> None:
    problem = grid_problem(grid_futures(300, np.random.default_rng(1)), distance_m=60e3)
    plans = [annealed(problem, None, seed) for seed in (1, 1, 2)]
    tracks = [plan.tracks[0] for plan in plans]
    assert tracks[0].x_m.tobytes() == tracks[1].x_m.tobytes()
    assert tracks[0].time_s.tobytes() == tracks[1].time_s.tobytes()
    assert tracks[0].x_m.tobytes() != tracks[2].x_m.tobytes()


def test_free_movement_beats_the_roads_on_the_grid() -> None:
    """From above the start, most targets are met within minutes once roads need not be ended."""
    problem = grid_problem(grid_futures(2000, np.random.default_rng(2)))
    fresh = grid_futures(4000, np.random.default_rng(3))
    free = annealed(problem, None, moves=4000)
    result = evaluate(free.tracks, fresh, problem.sensor, problem.objective)
    assert result.expected_detection_time_s < 150.0  # the best road plans take over 200
    assert result.detection_probability >= 0.998


def test_on_figure_3_it_is_at_least_as_good_as_the_best_order_of_roads() -> None:
    from planner.search.exact import exact
    from planner.search.plan import plan_of_legs

    network = figure3()
    paths = [path.split() for path in ("AB BC CE", "AB BC CF", "AB BD DF", "AB BD DG")]
    speeds = np.tile(np.arange(6.0, 31.0), 4)
    futures = physics_futures(network, [p for p in paths for _ in range(25)], 0.0, speeds)
    problem = Problem(
        network, futures, Uav(-30e3, 0.0, 0.0, 100.0), Sensor(200.0), Objective(3600.0)
    )
    best = exact(problem, budget=Budget(roads=7), rng=np.random.default_rng(0)).plan
    order = [flown.leg for flown in best.legs[0]]
    start = waypoints_of(problem, plan_of_legs(problem, "", order))
    assert reward(problem, annealed(problem, start, moves=3000)) > reward(problem, best) + 1.0


def test_the_holdout_chooses_where_its_own_particles_would_mislead() -> None:
    """From far away, hunting for the last of a few particles loses many of the others."""
    rng = np.random.default_rng(5)
    own, holdout, fresh = (grid_futures(count, rng) for count in (60, 3000, 3000))
    problem = grid_problem(own, distance_m=300e3)
    alone, chosen = (
        evaluate(annealed(asked, None, moves=3000).tracks, fresh, problem.sensor, problem.objective)
        for asked in (problem, problem.replace(holdout=holdout))
    )
    assert chosen.expected_detection_time_s < alone.expected_detection_time_s


def test_a_stop_returns_the_best_so_far() -> None:
    problem = grid_problem(grid_futures(100, np.random.default_rng(1)), distance_m=10e3)
    asked: list[None] = []

    def stop(_: int) -> bool:
        asked.append(None)
        return len(asked) > 2

    start = np.array([[0.0, 0.0, 0.0], [15e3, 0.0, 0.0], [0.0, -15e3, 50.0]])
    budget, rng = Budget(stop=stop), np.random.default_rng(0)
    plan = anneal_waypoints(
        problem, budget=budget, rng=rng, start=start, annealing=Annealing(10**9)
    ).plan
    assert len(asked) == 3
    assert reward(problem, plan) >= reward(problem, plan_of_waypoints(problem, "", start))


def test_waypoints_of_a_plan_give_the_same_flight_again() -> None:
    problem = grid_problem(grid_futures(50, np.random.default_rng(1)), distance_m=5e3)
    waypoints = np.array([[0.0, 0.0, 30.0], [1e3, 2e3, 0.0], [1e3, 2e3, 10.0], [5e3, 0.0, 0.0]])
    plan = plan_of_waypoints(problem, "", waypoints)
    again = plan_of_waypoints(problem, "", waypoints_of(problem, plan))
    times = np.linspace(0.0, plan.tracks[0].end_s, 500)
    assert again.tracks[0].xy(times) == pytest.approx(plan.tracks[0].xy(times), abs=1e-6)
    assert times_left(problem, waypoints)[-1] == pytest.approx(plan.tracks[0].end_s)


def test_a_sensor_for_roads_only_is_refused() -> None:
    futures = grid_futures(20, np.random.default_rng(1))
    problem = grid_problem(futures, detects_in_transit=False)
    with pytest.raises(NotApplicableError, match="detects_in_transit"):
        annealed(problem, np.array([[0.0, 0.0, 0.0]]))
