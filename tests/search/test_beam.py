"""Beams, repairs and the portfolio against enumeration and against each other."""

from dataclasses import replace
from itertools import count

import numpy as np
import pytest

from planner.detection.first_detection import first_detection
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.search import beam as beams
from planner.search.beam import Beam, RewardToGo, beam, beam_order
from planner.search.best import best
from planner.search.exact import best_order
from planner.search.kernels.beam import pack, unpack
from planner.search.lns import lns, polished
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.rate import rate, rate_order
from planner.search.what_if import WhatIf
from planner.streams import stream
from support.grid_instance import grid_futures, grid_problem
from support.instances import figure3, physics_futures
from support.search_instances import orders, random_problem

PATHS = (["AB", "BC", "CE"], ["AB", "BC", "CF"], ["AB", "BD", "DF"], ["AB", "BD", "DG"])


def section4(*, gone: bool = False, start_km: float = 30.0, take_off_s: float = 0.0) -> Problem:
    """The 100 futures of Section 4.1."""
    speeds = np.repeat(np.arange(6.0, 31.0), 4)
    futures = physics_futures(
        figure3(), list(PATHS) * 25, np.zeros(100), speeds, horizon_s=3_600.0, gone=gone
    )
    uav = Uav(x_m=-1_000.0 * start_km, y_m=0.0, take_off_s=take_off_s, speed_mps=100.0)
    return Problem(figure3(), futures, uav, Sensor(200.0), Objective(3_600.0))


def reward(problem: Problem, order: list[int]) -> float:
    """What an order earns, by the detection along its whole track."""
    track = plan_of_legs(problem, "", order).tracks[0]
    seen_at = first_detection(problem.futures, track, problem.sensor.radius_m)
    return float(problem.futures.weight @ problem.objective.reward(seen_at))


@pytest.mark.parametrize("particles", [0, 1, 7, 8, 9, 100])
def test_what_is_unseen_fits_into_bits(particles: int) -> None:
    miss = (np.random.default_rng(particles).random(particles) < 0.5).astype(float)
    mask, again = np.full((particles + 7) // 8, 255, np.uint8), np.full(particles, np.nan)
    pack(miss, mask, 0.0)
    np.testing.assert_array_equal(mask, np.packbits(miss > 0.0, bitorder="little"))
    unpack(mask, again)
    np.testing.assert_array_equal(again, miss)


@pytest.mark.parametrize("by_s", [None, 520.0])
@pytest.mark.parametrize("gone", [False, True])
def test_a_beam_that_drops_nothing_finds_the_best_way_along_roads(
    by_s: float | None, gone: bool
) -> None:
    problem = section4(gone=gone).replace(objective=Objective(600.0, by_s))
    engine = WhatIf(problem)
    most = max(reward(problem, order) for order in orders(problem, []))
    found, grown = beam_order(engine, Beam(10**6, bucket_s=1.0), _outlook(problem))
    assert reward(problem, found) == pytest.approx(most, rel=1e-9)
    assert grown > 5


def _outlook(problem: Problem) -> RewardToGo:
    return RewardToGo.of(problem, rate_order(WhatIf(problem)))


def test_a_beam_goes_on_from_where_a_search_stands() -> None:
    problem = section4().replace(objective=Objective(560.0))
    engine = WhatIf(problem)
    first = 0
    seen = engine.fly(problem.first_state, np.array([first])).seen(0, 100)
    start = problem.first_state.after(problem.legs, first, seen)
    rest, _ = beam_order(engine, Beam(10**6, bucket_s=1.0), _outlook(problem), start=start)
    most = max(reward(problem, order) for order in orders(problem, [first]))
    assert reward(problem, [first, *rest]) >= most * (1 - 1e-9)  # it may fly to its next road


@pytest.mark.parametrize("seed", range(6))
def test_repairs_never_make_it_worse_and_repeat(seed: int) -> None:
    problem = random_problem(seed)
    engine = WhatIf(problem)
    order = list(rate_order(engine))
    twice = [
        list(polished(engine, order, 9000, stream(seed, "lns"), stop=lambda: False))
        for _ in range(2)
    ]
    assert twice[0] == twice[1]
    assert reward(problem, twice[0]) >= reward(problem, order) * (1 - 1e-12)


@pytest.mark.parametrize("gone", [False, True])
@pytest.mark.parametrize(("start_km", "take_off_s"), [(30, 0), (60, 0), (100, 300)])
def test_best_is_at_most_the_optimum_over_once_per_road_orders(
    gone: bool, start_km: float, take_off_s: float
) -> None:
    problem = section4(gone=gone, start_km=start_km, take_off_s=take_off_s)
    _, optimum_s = best_order(problem, 7)
    plan = best(problem, budget=Budget(work=9000), rng=stream(1, "best")).plan
    seen_at = first_detection(problem.futures, plan.tracks[0], problem.sensor.radius_m)
    assert problem.futures.weight @ np.minimum(seen_at, 3_600.0) <= optimum_s + 1e-6


@pytest.mark.parametrize("seed", range(4))
def test_best_is_the_best_on_its_own_particles_without_a_holdout(seed: int) -> None:
    problem = random_problem(seed)
    values = {}
    for planner in (best, beam, lns, rate):
        plan = planner(problem, budget=Budget(work=9000), rng=stream(seed, "p")).plan
        seen_at = first_detection(problem.futures, plan.tracks[0], problem.sensor.radius_m)
        values[plan.method] = problem.futures.weight @ problem.objective.reward(seen_at)
    assert values["best"] >= values["rate"] * (1 - 1e-12)
    assert values["lns"] >= values["rate"] * (1 - 1e-12)


def test_the_holdout_decides() -> None:
    problem = section4()
    only = problem.futures.take(np.arange(100) % 4 == 0)  # all of them go to E
    holdout = replace(only, weight=np.full(len(only), 1 / len(only)))
    chosen, own = (
        best(asked, budget=Budget(work=9000), rng=stream(1, "best")).plan
        for asked in (problem.replace(holdout=holdout), problem)
    )
    seen = [
        first_detection(holdout, plan.tracks[0], 200.0).clip(max=3_600.0).mean()
        for plan in (chosen, own)
    ]
    assert seen[0] <= seen[1]


def test_best_returns_what_it_has_when_it_is_stopped() -> None:
    problem = section4(start_km=60.0)
    heard: list[str] = []
    budget = Budget(
        work=10**6,
        on_progress=lambda *progress: heard.append(progress[2]),
        stop=lambda _: len(heard) == 2,
    )
    found = best(problem, budget=budget, rng=stream(1, "best"))
    assert found.stopped
    assert len(found.plan.legs[0]) > 0
    assert len(heard) == 2
    values = [point.value for point in found.trace]
    assert heard[-1] == problem.objective.as_text(values[-1])
    assert values == sorted(values, reverse=True)
    at_once = best(problem, budget=Budget(work=10**6, stop=lambda _: True), rng=stream(1, "best"))
    assert len(at_once.plan.legs[0]) > 0


def test_in_large_nets_beams_begin_with_the_most_promising_legs_and_come_to_an_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = grid_problem(grid_futures(200, np.random.default_rng(1)))
    engine = WhatIf(problem)
    outlook = RewardToGo.of(problem, rate_order(engine))
    whole, work = beam_order(engine, Beam(8), outlook)
    monkeypatch.setattr(beams, "FEW", 0)
    monkeypatch.setattr(beams, "FIRST_LEGS", 4)
    order, less = beam_order(engine, Beam(8), outlook)
    assert reward(problem, order) > 0.9 * reward(problem, whole)
    assert less < work
    most = less // 4
    ended, done = beam_order(engine, Beam(8), outlook, most=most)
    assert done <= 1.2 * most
    late_s = [plan_of_legs(problem, "", legs).legs[0][-1].end_s for legs in (ended, order)]
    assert late_s[0] > 0.5 * late_s[1]  # it got narrower, not shorter


def test_how_often_a_beam_is_asked_to_stop_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = grid_problem(grid_futures(100, np.random.default_rng(1)))
    engine = WhatIf(problem)
    to_go = RewardToGo.of(problem, rate_order(engine))
    for few in (512, 0):  # legs: in large nets it gets narrower to come to an end
        monkeypatch.setattr(beams, "FEW", few)
        found = []
        for between, at_least in ((1, 5), (10**6, 1)):
            asked = count()
            monkeypatch.setattr(beams, "BETWEEN_STOPS", between)
            stop = lambda asked=asked: next(asked) < 0  # noqa: E731
            found.append(beam_order(engine, Beam(8), to_go, most=900, stop=stop))
            assert next(asked) >= at_least
        assert found[0] == found[1]


def test_beams_land_in_time() -> None:
    problem = section4()
    uav = replace(problem.uav, max_flight_time_s=700.0)
    plan = beam(problem.replace(uav=uav), budget=Budget(work=9000), rng=stream(1, "b")).plan
    assert plan.tracks[0].end_s <= 700.0
    assert len(plan.legs[0]) > 0
