"""Rate, lookahead and the tail against slow twins made of whole tracks alone."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from planner.arrays import Floats
from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.search import patrol as tail
from planner.search.lookahead import fastest_pair, lookahead
from planner.search.patrol import most_with_patrol, with_patrol
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem, candidate_legs
from planner.search.rate import rate, rate_order
from planner.search.sightings import holdout_value
from planner.search.state import SearchState
from planner.search.stepwise import stepwise
from planner.search.what_if import WhatIf
from support.grid_instance import grid_futures, grid_problem
from support.instances import by_two_letters, physics_futures
from support.search_instances import flown, random_problem

RNG = np.random.default_rng(0)


def ways(problem: Problem, state: SearchState) -> dict[int, tuple[float, SearchState]]:
    """Each leg that may come next: what it earns, and the state after it."""
    found = {}
    for leg in candidate_legs(problem, state).tolist():
        seen_at = flown(problem, state, leg)
        assert seen_at is not None
        first = np.where(np.isinf(state.seen_at), seen_at, np.inf)
        earns = float(problem.futures.weight @ problem.objective.reward(first))
        after = state.after(problem.legs, leg, np.minimum(state.seen_at, first))
        if after.time_s > state.time_s:
            found[leg] = (earns, after)
    return found


def by_one(problem: Problem, state: SearchState) -> dict[int, float]:
    """Gain per second of each next leg."""
    return {
        leg: earns / (after.time_s - state.time_s)
        for leg, (earns, after) in ways(problem, state).items()
    }


def by_two(problem: Problem, state: SearchState) -> dict[int, float]:
    """Gain per second of each next leg, or of it with the best leg after it."""
    best = by_one(problem, state)
    for leg, (earns, after) in ways(problem, state).items():
        for more, last in ways(problem, after).values():
            best[leg] = max(best[leg], (earns + more) / (last.time_s - state.time_s))
    return best


def assert_follows(
    problem: Problem,
    order: list[int],
    rates_of: Callable[[Problem, SearchState], dict[int, float]],
    *,
    least: int = 0,
) -> None:
    """Every leg of an order is the first of the best, as long as any leg earns something."""
    state = problem.first_state
    for number, leg in enumerate(order):
        if not any(earns for earns, _ in ways(problem, state).values()):
            assert number >= least
            return
        rates = rates_of(problem, state)
        scale = problem.objective.most / problem.horizon_s
        good = [other for other in rates if rates[other] >= max(rates.values()) - 2e-10 * scale]
        assert leg in good
        assert leg == good[0] or rates[good[0]] < max(rates.values())
        state = ways(problem, state)[leg][1]


@pytest.mark.parametrize("by_s", [None, 500.0])
@pytest.mark.parametrize("seed", range(6))
def test_rate_flies_what_earns_most_per_second(seed: int, by_s: float | None) -> None:
    problem = random_problem(seed, particles=20, by_s=by_s)
    assert_follows(problem, list(rate_order(WhatIf(problem))), by_one)


@pytest.mark.parametrize("by_s", [None, 300.0])
@pytest.mark.parametrize("seed", [1, 2, 4])
def test_lookahead_flies_the_pair_that_earns_most_per_second(
    seed: int, by_s: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("planner.search.lookahead.FIRST_LEGS", 10**6)
    problem = random_problem(seed, particles=12, by_s=by_s)
    engine, start = WhatIf(problem), problem.first_state
    state = start
    for _ in range(2):  # the twin is slow
        after = fastest_pair(engine, state)
        if after is None:
            break
        state = after
    assert_follows(problem, list(state.order[:2]), by_two)


def test_few_first_legs_are_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    futures = grid_futures(150, np.random.default_rng(1), size=4)
    problem = grid_problem(futures, distance_m=60e3, size=4)
    orders = []
    for first_legs in (8, 10**6):
        monkeypatch.setattr("planner.search.lookahead.FIRST_LEGS", first_legs)
        orders.append(stepwise(WhatIf(problem), problem.first_state, fastest_pair).order)
    values = [
        evaluate(
            plan_of_legs(problem, "", order).tracks, futures, problem.sensor, problem.objective
        ).expected_detection_time_s
        for order in orders
    ]
    assert values[0] <= 1.01 * values[1]


def late(*, depart_s: float, gone: bool) -> Problem:
    """One target that sets out late on the far one of two roads."""
    nodes = {"A": (0.0, 0.0), "B": (3000.0, 0.0), "C": (9000.0, 0.0)}
    network = by_two_letters(nodes, "AB BC")
    futures = physics_futures(network, [["BC"]], 0.0, 20.0, depart_s=depart_s, gone=gone)
    return Problem(network, futures, Uav(0.0, 0.0, 0.0, 100.0), Sensor(200.0), Objective(2000.0))


@pytest.mark.parametrize("method", [rate, lookahead])
@pytest.mark.parametrize("gone", [True, False])
def test_what_earns_nothing_yet_is_waited_for(method: Callable[..., object], gone: bool) -> None:
    problem = late(depart_s=1234.0, gone=gone)
    plan = method(problem, budget=Budget(), rng=RNG).plan
    seen = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective).seen_at[0]
    assert 1234.0 <= seen <= 1234.0 + 120.0  # to and fro above the road: at most one way and back


def test_nobody_to_be_met_ends_the_plan() -> None:
    problem = late(depart_s=2500.0, gone=True)
    assert rate_order(WhatIf(problem)) == ()
    assert with_patrol(problem, ()) == ()


@pytest.mark.parametrize("name", ["rate", "lookahead"])
def test_the_horizon_ends_the_flight_not_the_depth(name: str) -> None:
    problem = grid_problem(grid_futures(200, np.random.default_rng(1)), distance_m=30e3)
    plan = {"rate": rate, "lookahead": lookahead}[name](problem, budget=Budget(1), rng=RNG).plan
    legs = plan.legs[0]
    assert legs[-1].start_s < problem.horizon_s + 1e-6 <= legs[-1].end_s + 1e-6
    assert len({leg.road for leg in legs}) < len(legs)


def test_a_tail_goes_on_where_the_plan_ended() -> None:
    futures = grid_futures(300, np.random.default_rng(4))
    problem = grid_problem(futures, distance_m=120e3)
    order = rate_order(WhatIf(problem))
    longer = with_patrol(problem, order)
    assert longer[: len(order)] == order
    assert len(longer) > len(order)
    assert with_patrol(problem, longer) == longer


@pytest.mark.parametrize("seed", range(8))
def test_no_tail_earns_more_than_is_said_of_it(seed: int) -> None:
    made, holdout = random_problem(seed), random_problem(seed, particles=60).futures
    problem = made.replace(holdout=holdout)
    order = rate_order(WhatIf(problem))
    for part in (order[:1], order[: len(order) // 2], order):
        most = most_with_patrol(problem, part)
        own, longer = (
            holdout_value(problem, plan_of_legs(problem, "", legs))
            for legs in (part, with_patrol(problem, part))
        )
        assert own <= longer * (1.0 + 1e-12)
        assert longer <= most * (1.0 + 1e-12)
    misses = made.replace(sensor=replace(made.sensor, rate_per_s=1.0))
    assert most_with_patrol(misses, order) == np.inf


@pytest.mark.parametrize("distance_km", [120, 300, 500])
def test_a_tail_finds_those_that_slipped_through(distance_km: int) -> None:
    """Plans made from few particles lose some targets; with the tail hardly any."""
    fresh = grid_futures(4000, np.random.default_rng(50))
    problem = grid_problem(
        grid_futures(200, np.random.default_rng(6)), distance_m=1000.0 * distance_km
    )
    order = rate_order(WhatIf(problem))
    lost = [
        1
        - evaluate(
            plan_of_legs(problem, "", legs).tracks, fresh, problem.sensor, problem.objective
        ).detection_probability
        for legs in (order, with_patrol(problem, order))
    ]
    assert lost[0] > 0.002
    assert lost[1] <= 0.0005


def test_the_tail_looks_first_for_those_not_seen() -> None:
    """Two targets rest: the one not seen yet is worth more than the one already seen."""
    nodes = {"A": (-4000.0, 0.0), "O": (0.0, 0.0), "B": (4000.0, 0.0)}
    network = by_two_letters(nodes, "OA OB")
    futures = physics_futures(network, [["OA"], ["OB"]], 3900.0, 20.0)
    uav = Uav(0.0, 0.0, 10.0, 100.0)
    problem = Problem(network, futures, uav, Sensor(200.0), Objective(1000.0))
    to_a, to_b = 0, 2
    longer = with_patrol(problem, [to_a])
    assert to_b in longer[1:3]  # by way of O, or straight
    seen_at = evaluate(
        plan_of_legs(problem, "", longer).tracks, futures, problem.sensor, problem.objective
    ).seen_at
    assert np.isfinite(seen_at).all()


def doubts(since_s: list[float], horizon_s: float) -> Floats:
    problem = late(depart_s=0.0, gone=False).replace(objective=Objective(horizon_s))
    state = SearchState.of_sightings(100.0, 0.0, 0.0, np.array([np.inf]))
    flights = WhatIf(problem).fly(state, np.array([2], dtype=np.int32))
    assert len(flights.seen_at) == 1
    return np.array(
        [
            tail._doubt(
                problem,
                SearchState.of_sightings(100.0, 0.0, 0.0, flights.seen_at - since),
                flights,
            )[0]
            for since in since_s
        ]
    )


def test_doubt_grows_with_time_and_is_one_for_the_unseen() -> None:
    found = doubts([0.0, 100.0, 400.0, 1e9, -np.inf], 1000.0)
    assert found == pytest.approx([0, 0.1 * tail.MISSED, 0.4 * tail.MISSED, tail.MISSED, 1.0])
