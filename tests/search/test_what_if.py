"""What-if flights must see exactly what the finished plan's track sees."""

from dataclasses import replace

import numpy as np
import pytest

from planner.arrays import Floats
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.search.problem import Problem, candidate_legs
from planner.search.state import SearchState
from planner.search.what_if import Sightings, WhatIf
from support.grid_instance import grid_futures, grid_problem
from support.instances import network_of_roads
from support.search_instances import flown, random_problem


def random_state(problem: Problem, rng: np.random.Generator) -> SearchState:
    """Between the roads, or at a node; some particles seen already."""
    nodes = problem.network.node_xy_m
    x_m, y_m = nodes[rng.integers(len(nodes))] if rng.random() < 0.5 else rng.uniform(-5e3, 2e4, 2)
    many = len(problem.futures)
    seen_at = np.where(rng.random(many) < 0.3, 5.0, np.inf)
    return SearchState.of_sightings(float(rng.uniform(-50, 1200)), float(x_m), float(y_m), seen_at)


def as_matrix(flights: Sightings, particles: int) -> Floats:
    return np.array([flights.seen(i, particles) for i in range(len(flights.leg))])


def expected(problem: Problem, state: SearchState) -> Floats:
    seen_at = [flown(problem, state, leg) for leg in range(len(problem.legs))]
    return np.where(np.isinf(state.seen_at), np.array(seen_at), np.inf)


@pytest.mark.parametrize("speed_mps", [100.0, 36.0, 20.0])
@pytest.mark.parametrize("seed", range(24))
def test_equal_to_the_detection_along_the_track(seed: int, speed_mps: float) -> None:
    problem = random_problem(seed)
    problem = problem.replace(uav=replace(problem.uav, speed_mps=speed_mps))
    engine, rng = WhatIf(problem), np.random.default_rng(seed)
    for _ in range(4):
        state = random_state(problem, rng)
        flights = engine.fly(state, np.arange(len(problem.legs), dtype=np.int32))
        wanted = expected(problem, state)
        assert as_matrix(flights, len(problem.futures)) == pytest.approx(wanted, abs=1e-6)
        assert len(flights.particle) == np.isfinite(wanted).sum()  # each particle once a flight


@pytest.mark.parametrize("transit", [True, False])
def test_equal_on_the_paper_grid(transit: bool) -> None:
    futures = grid_futures(300, np.random.default_rng(5))
    problem = grid_problem(futures, distance_m=60e3, detects_in_transit=transit)
    engine = WhatIf(problem)
    nodes = problem.network.node_xy_m
    for time_s, node in ((600.0, 0), (2500.0, 14), (7000.0, 35)):
        state = SearchState.of_sightings(time_s, *nodes[node], np.full(300, np.inf))
        flights = engine.fly(state, candidate_legs(problem, state))
        assert len(flights.particle) > 0
        assert as_matrix(flights, 300) == pytest.approx(expected(problem, state), abs=1e-6)


def test_asks_only_for_the_legs_and_particles_named() -> None:
    problem = random_problem(2).replace(sensor=Sensor(1500.0))
    engine, state = WhatIf(problem), problem.first_state
    everything = engine.fly(state, np.arange(len(problem.legs), dtype=np.int32))
    unseen = np.arange(len(problem.futures)) % 2 == 0
    some = engine.fly(state, np.array([7, 3], dtype=np.int32), miss=unseen.astype(float))
    assert some.leg.tolist() == [7, 3]
    for i, leg in enumerate(some.leg):
        whole = everything.seen(leg, len(unseen))
        assert some.seen(i, len(unseen)) == pytest.approx(np.where(unseen, whole, np.inf))
        assert (some.start_s[i], some.end_s[i]) == (everything.start_s[leg], everything.end_s[leg])


@pytest.mark.parametrize("by_s", [None, 700.0])
@pytest.mark.parametrize("seed", range(6))
def test_scores_are_the_sums_of_what_is_seen(seed: int, by_s: float | None) -> None:
    """A particle counts as far as it is still unseen; one that is seen for certain not at all."""
    problem = random_problem(seed)
    problem = problem.replace(objective=Objective(problem.horizon_s, by_s))
    engine, rng = WhatIf(problem), np.random.default_rng(seed)
    legs = np.arange(len(problem.legs), dtype=np.int32)
    for _ in range(4):
        state = random_state(problem, rng)
        miss = np.where(rng.random(len(state.miss)) < 0.5, state.miss, rng.random(len(state.miss)))
        for asked in (None, miss):
            unseen = problem.futures.weight * (state.miss if asked is None else asked)
            flights = engine.fly(state, legs, miss=asked)
            scores = engine.score(state, legs, miss=asked)
            assert (unseen[flights.particle] > 0.0).all()
            earned = unseen[flights.particle] * problem.objective.reward(flights.seen_at)
            assert scores.reward == pytest.approx(flights.per_flight(earned))
            assert scores.seen == pytest.approx(flights.per_flight(unseen[flights.particle]))
            np.testing.assert_array_equal(scores.end_s, flights.end_s)


def test_sums_and_choices_per_flight() -> None:
    flights = Sightings(
        leg=np.array([4, 6, 8], dtype=np.int32),
        start_s=np.zeros(3),
        end_s=np.ones(3),
        first=np.array([0, 2, 2, 3]),
        particle=np.array([1, 0, 1], dtype=np.int32),
        seen_at=np.array([5.0, 7.0, 6.0]),
        worth=np.ones(3),
        share=np.array([0.5, 1.0, 1.0]),
    )
    assert flights.missed(0, 3).tolist() == [0.0, 0.5, 1.0]
    assert flights.per_flight(np.array([1.0, 2.0, 4.0])).tolist() == [3, 0, 4]
    kept = flights.those(flights.particle == 1)
    assert kept.first.tolist() == [0, 1, 1, 2]
    assert kept.seen(2, 3).tolist() == [np.inf, 6, np.inf]
    assert kept.seen(1, 3).tolist() == [np.inf] * 3


@pytest.mark.parametrize("seed", range(12))
def test_by_ticks_sees_what_the_ticks_show(seed: int) -> None:
    problem, tick_s = random_problem(seed, particles=15), 7.0
    rng = np.random.default_rng(seed)
    state = random_state(problem, rng)
    legs = rng.choice(len(problem.legs), 6, replace=False).astype(np.int32)
    flights = WhatIf(problem).fly_by_ticks(state, legs, tick_s)
    for i, leg in enumerate(legs):
        seen_at = flights.seen(i, 15)
        for particle in np.flatnonzero(np.isinf(state.seen_at)):
            assert seen_at[particle] == pytest.approx(
                first_tick(problem, state, int(leg), int(particle), tick_s)
            )


def first_tick(
    problem: Problem, state: SearchState, leg: int, particle: int, tick_s: float
) -> float:
    legs = problem.legs
    points = slice(legs.first_point[leg], legs.first_point[leg + 1])
    start_s = state.time_s + legs.transit_s(state.x_m, state.y_m)[leg]
    time_s = np.concatenate(([state.time_s], start_s + legs.after_s[points]))
    ticks = np.arange(state.time_s + tick_s, time_s[-1] + 1e-9, tick_s)
    x_m = np.interp(ticks, time_s, np.concatenate(([state.x_m], legs.x_m[points])))
    y_m = np.interp(ticks, time_s, np.concatenate(([state.y_m], legs.y_m[points])))
    offset = (
        problem.futures.xy(particle, ticks)
        if problem.futures.end_s[particle] > -np.inf
        else (np.full((len(ticks), 2), np.nan))
    )
    inside = np.hypot(offset[:, 0] - x_m, offset[:, 1] - y_m) <= problem.sensor.radius_m
    if not problem.sensor.detects_in_transit:
        inside &= ticks >= start_s
    return float(ticks[inside][0]) if inside.any() else np.inf


def test_short_ticks_come_close_to_continuous_time() -> None:
    problem = random_problem(1).replace(sensor=Sensor(300.0))
    engine, state = WhatIf(problem), problem.first_state
    legs = np.arange(len(problem.legs), dtype=np.int32)
    exact = as_matrix(engine.fly(state, legs), 40)
    missed = []
    for tick_s in (20.0, 1.0, 0.05):
        by_ticks = as_matrix(engine.fly_by_ticks(state, legs, tick_s), 40)
        assert np.all(by_ticks >= exact - 1e-9)
        late = by_ticks[np.isfinite(exact)] - exact[np.isfinite(exact)]
        missed.append(np.mean(late > tick_s))
    assert missed[0] > missed[-1]
    assert missed[-1] < 0.002


def test_transits_that_overtake_slowly_and_are_met_from_behind() -> None:
    aside_m, turn = np.meshgrid(np.linspace(-1500.0, 600.0, 60), [0.02, 0.1, 0.3])
    many = aside_m.size
    lasts_s = 900.0
    x_m = np.stack([np.full(many, 2000.0), 2000.0 + 30 * lasts_s * np.cos(turn.ravel())], axis=1)
    y_m = np.stack([aside_m.ravel(), aside_m.ravel() + 30 * lasts_s * np.sin(turn.ravel())], axis=1)
    futures = Futures(
        time_s=np.tile([0.0, lasts_s], many),
        x_m=x_m.ravel(),
        y_m=y_m.ravel(),
        first_knot=np.arange(many + 1) * 2,
        weight=np.full(many, 1 / many),
        gone=np.zeros(many, dtype=bool),
    )
    net = network_of_roads({"A": (60e3, 0.0), "B": (61e3, 0.0)}, [("AB", "A", "B")])
    uav = Uav(0.0, 0.0, 0.0, 36.0)
    problem = Problem(net, futures, uav, Sensor(500.0), Objective(5000.0))
    state = problem.first_state
    flights = WhatIf(problem).fly(state, np.array([0], dtype=np.int32))
    seen_at = flown(problem, state, 0)
    assert seen_at is not None
    assert 20 < np.isfinite(seen_at).sum() < many
    assert flights.seen(0, many) == pytest.approx(seen_at, abs=1e-6)
