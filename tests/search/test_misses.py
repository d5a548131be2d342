"""Planning with a sensor that misses, and beside flights of others that are decided."""

from dataclasses import replace

import numpy as np
import pytest

from planner.detection.evaluate import evaluate_all
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor, rate_of
from planner.detection.survival import Searched, survival
from planner.search.beam import Beam, RewardToGo, beam_order
from planner.search.patrol import after_legs
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem, candidate_legs
from planner.search.rate import rate, rate_order
from planner.search.sightings import earned as reward_of
from planner.search.stepwise import after_flight, earned
from planner.search.what_if import WhatIf
from support.grid_instance import grid_futures, grid_problem
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
    for seed in range(3):
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
