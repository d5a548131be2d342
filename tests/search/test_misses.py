"""Planning with a sensor that misses, and beside flights of others that are decided."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from planner.detection.evaluate import evaluate_all
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor, rate_of
from planner.detection.survival import Searched, survival
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.search import best as search_best
from planner.search.beam import Beam, RewardToGo, beam_order
from planner.search.best import ALONG_ROADS, ELSEWHERE, Division, best
from planner.search.cell_flights import CellBeam, Cells, fly_beam
from planner.search.kernels.cell_beam import FORGOTTEN
from planner.search.patrol import after_legs
from planner.search.plan import plan_of_legs, plan_of_waypoints
from planner.search.problem import Budget, Problem, candidate_legs
from planner.search.rate import rate, rate_order
from planner.search.sightings import earned as reward_of
from planner.search.sightings import holdout_value
from planner.search.stepwise import after_flight, earned
from planner.search.what_if import WhatIf
from support.grid_instance import grid_futures, grid_problem
from support.instances import by_two_letters
from support.search_instances import random_problem


def missing(problem: Problem, detects: float) -> Problem:
    sensor, speed_mps = problem.sensor, float(problem.uav.speed_mps)
    rate_per_s = rate_of(detects, sensor.radius_m, speed_mps)
    return problem.replace(sensor=replace(sensor, rate_per_s=rate_per_s))


def beside(problem: Problem, detects: float, seed: int = 7) -> Problem:
    """The same, with another UAV that flies random legs at the same time."""
    order = np.random.default_rng(seed).permutation(len(problem.legs))[:6].tolist()
    other = missing(problem, detects)
    return problem.replace(
        flown=tuple(
            Searched(track, other.sensor) for track in plan_of_legs(other, "", order).tracks
        )
    )


CASES = [
    pytest.param(1.0, None, id="perfect"),
    pytest.param(0.6, None, id="misses"),
    pytest.param(1.0, 1.0, id="perfect beside perfect"),
    pytest.param(1.0, 0.5, id="perfect beside one that misses"),
    pytest.param(0.6, 1.0, id="misses beside perfect"),
    pytest.param(0.6, 0.5, id="misses beside one that misses"),
]


@pytest.mark.parametrize("by_s", [None, 900.0])
@pytest.mark.parametrize(("detects", "others"), CASES)
@pytest.mark.parametrize("speed_mps", [100.0, 20.0])
def test_what_legs_earn_adds_up_to_what_their_flight_achieves(
    detects: float, others: float | None, by_s: float | None, speed_mps: float
) -> None:
    """Leg by leg, in what-if flights, as by the exact evaluation of the whole flight."""
    for seed in range(2):
        problem = random_problem(seed).replace(objective=Objective(2000.0, by_s))
        problem = problem.replace(uav=replace(problem.uav, speed_mps=speed_mps))
        problem = missing(problem, detects)
        if others is not None:
            problem = beside(problem, others)
        engine, rng = WhatIf(problem), np.random.default_rng(seed)
        state, total = problem.first_state, 0.0
        for _ in range(6):
            legs = candidate_legs(problem, state)
            flights, scores = engine.fly(state, legs), engine.score(state, legs)
            each = earned(problem, state, flights)
            assert scores.reward == pytest.approx(each, rel=1e-9, abs=1e-12)
            unseen = (problem.futures.weight * state.miss)[flights.particle]
            assert scores.seen == pytest.approx(flights.per_flight(unseen * flights.share))
            flight = int(rng.integers(len(legs)))
            total += float(each[flight])
            state = after_flight(problem, state, flights, flight)
        own = [
            Searched(track, problem.sensor)
            for track in plan_of_legs(problem, "", state.order).tracks
        ]
        alone, both = (
            float(
                problem.futures.weight
                @ evaluate_all(some, problem.futures, problem.objective).reward
            )
            for some in (problem.flown, [*problem.flown, *own])
        )
        assert total == pytest.approx(both - alone, rel=1e-7, abs=1e-7)
        assert state.miss == pytest.approx(
            survival(problem.futures, own).at(state.time_s), abs=1e-9
        )


@pytest.mark.parametrize(("detects", "others"), CASES)
def test_a_beam_knows_what_its_order_earns(detects: float, others: float | None) -> None:
    problem = missing(
        grid_problem(grid_futures(60, np.random.default_rng(2)), distance_m=60e3), detects
    )
    if others is not None:
        problem = beside(problem, others)
    engine = WhatIf(problem)
    reward_to_go = RewardToGo.of(problem, rate_order(engine))
    order, _ = beam_order(engine, Beam(3, per_node=2), reward_to_go, most=4000)
    by_beam, by_rate = (
        reward_of(problem, plan, problem.futures, problem.weight_at_start)
        for plan in (plan_of_legs(problem, "", legs) for legs in (order, rate_order(engine)))
    )
    assert by_beam > 0.9 * by_rate
    state = after_legs(engine, order)
    assert state.order == tuple(order)


def test_planning_for_the_misses_there_are_pays() -> None:
    problem = missing(
        grid_problem(grid_futures(100, np.random.default_rng(2)), distance_m=60e3), 0.6
    )
    blind = problem.replace(sensor=Sensor(problem.sensor.radius_m))
    budget, rng = Budget(work=1000), np.random.default_rng(0)
    knowing, unknowing = (
        evaluate_all(
            [
                Searched(track, problem.sensor)
                for track in rate(asked, budget=budget, rng=rng).plan.tracks
            ],
            problem.futures,
            problem.objective,
        ).expected_detection_time_s
        for asked in (problem, blind)
    )
    assert knowing < 0.9 * unknowing


@pytest.mark.parametrize(("detects", "others"), CASES)
def test_a_free_flight_knows_what_it_earns(detects: float, others: float | None) -> None:
    futures = grid_futures(60, np.random.default_rng(2))
    problem = missing(grid_problem(futures, distance_m=30e3), detects)
    if others is not None:
        problem = beside(problem, others)
    flight = fly_beam(Cells.of(problem, 4000.0), CellBeam(1), most=2000.0)
    plan = plan_of_waypoints(problem, "", flight.waypoints)
    alone, both = (
        float(futures.weight @ evaluate_all(some, futures, problem.objective).reward)
        for some in (
            problem.flown,
            [*problem.flown, *(Searched(track, problem.sensor) for track in plan.tracks)],
        )
    )
    assert flight.reward > 0.0
    # It is written down how unseen a particle is with a precision of 1 / 65,535, and who is so
    # with less than `FORGOTTEN` counts as seen; a perfect sensor forgets nobody.
    rel = 1e-6 if problem.sensor.is_perfect else FORGOTTEN
    assert flight.reward == pytest.approx(both - alone, rel=rel)


def test_between_two_places_the_likelier_look_per_second_comes_first() -> None:
    """A target rests at the end of one of two roads: by falling p q (1 - q)^(k - 1) / c."""
    net = by_two_letters({"A": (0.0, 0.0), "B": (6e3, 0.0), "C": (-4e3, 0.0)}, "AB AC")
    futures = Futures(
        np.zeros(2),
        np.array([6e3, -4e3]),
        np.zeros(2),
        np.arange(3),
        np.array([0.7, 0.3]),
        np.zeros(2, dtype=bool),
    )
    uav, objective = Uav(0.0, 0.0, 0.0, 100.0), Objective(6000.0)
    problem = missing(Problem(net, futures, uav, Sensor(200.0), objective), 0.4)
    out, back = np.array([0, 2]), np.array([1, 3])
    looks, order = np.zeros(2), list[int]()
    for _ in range(60):
        index = futures.weight * 0.4 * 0.6**looks / np.array([12e3, 8e3])
        arm = int(np.argmax(index))
        looks[arm] += 1
        order += [int(out[arm]), int(back[arm])]
    by_rule = plan_of_legs(problem, "", order)
    rule_s, best_s = (
        evaluate_all(
            [Searched(track, problem.sensor) for track in plan.tracks], futures, objective
        ).expected_detection_time_s
        for plan in (
            by_rule,
            best(problem, budget=Budget(work=20_000), rng=np.random.default_rng(0)).plan,
        )
    )
    assert best_s == pytest.approx(rule_s, abs=1.0)


DETECTS = (0.05, 0.3, 0.5, 0.7, 0.9, 0.9999)


def parts_of_best(detects: float, budget: Budget, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the work that plans as if perfect get, and those for the sensor that there is."""
    problem = missing(grid_problem(grid_futures(20, np.random.default_rng(2))), detects)
    whole, given = search_best._best, list[int]()

    def noted(problem: Problem, budget: Budget, *rest: Any) -> Any:
        given.append(budget.work)
        return whole(problem, replace(budget, work=1, free=False), *rest)

    with monkeypatch.context() as patched:
        patched.setattr(search_best, "_best", noted)
        best(problem, budget=budget, rng=np.random.default_rng(1))
    return given


def test_the_more_a_pass_sees_the_more_work_goes_into_plans_for_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    parts = [parts_of_best(detects, Budget(work=10_000), monkeypatch) for detects in DETECTS]
    blind, own = zip(*parts, strict=True)
    assert len(set(blind)) == 1
    assert 0 < blind[0] < 10_000
    assert list(own) == sorted(own)
    assert 1500 < own[0] == own[2] < own[3] < own[4] < own[5] < 10_000


@pytest.mark.parametrize("free", [True, False])
def test_off_the_roads_and_in_dense_nets_a_fifth_goes_into_plans_for_misses(
    free: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not free:
        monkeypatch.setattr(search_best, "is_small", lambda _: False)
    for detects in DETECTS[::2]:
        budget = Budget(work=10_000, free=free)
        assert parts_of_best(detects, budget, monkeypatch) == [10_000, 2000]


@pytest.mark.parametrize("detects", [0.05, 0.9])
@pytest.mark.parametrize("free", [True, False])
def test_the_least_work_is_enough_for_a_plan(
    free: bool, detects: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert parts_of_best(detects, Budget(work=1, free=free), monkeypatch) == [1, 1]


@pytest.mark.parametrize(("free", "division"), [(True, ELSEWHERE), (False, ALONG_ROADS)])
def test_the_beams_for_misses_are_as_wide_as_the_movement_asks(
    free: bool, division: Division, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And take no more work than there is for them."""
    problem = missing(grid_problem(grid_futures(20, np.random.default_rng(2))), 0.7)
    widths, most, done = list[int](), list[float](), list[int]()

    def noted(engine: WhatIf, beam: Beam, *rest: Any, **more: Any) -> Any:
        order, work = beam_order(engine, beam, *rest, **more)
        if not engine.problem.sensor.is_perfect:
            widths.append(beam.width)
            most.append(more["most"])
            done.append(work)
        return order, work

    monkeypatch.setattr(search_best, "beam_order", noted)
    monkeypatch.setattr(search_best, "portfolio", lambda *_, **__: ([], 0))  # of free flights
    monkeypatch.setattr(search_best, "_polished", lambda _, found, *__: found)
    work = 400_000 if free else 20_000
    best(problem, budget=Budget(work=work, free=free), rng=np.random.default_rng(1))
    assert widths[0] == division.first_width
    assert len(widths) > 1
    for before, after in pairwise(widths):
        growth = (after + 1) / before
        assert division.least_growth <= growth
        assert after / before <= division.most_growth
    assert sum(done) <= most[0] < work


def test_best_is_never_worse_on_its_holdout_than_as_if_perfect() -> None:
    rng = np.random.default_rng
    problem = grid_problem(grid_futures(50, rng(2)), distance_m=60e3)
    problem = missing(problem.replace(holdout=grid_futures(100, rng(3))), 0.7)
    perfect = problem.replace(sensor=problem.sensor.without_misses)
    budget, part = Budget(work=500), Budget(work=125)
    own = best(problem, budget=budget, rng=rng(1)).plan
    blind = best(perfect, budget=part, rng=rng(1)).plan
    assert holdout_value(problem, own) >= holdout_value(problem, blind)
    again = best(problem, budget=budget, rng=rng(1)).plan
    assert again.legs == own.legs
