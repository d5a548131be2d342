"""The fastest legs, found by ceilings, against flights along all legs."""

from collections.abc import Iterator, Sequence

import numpy as np
import pytest

from planner.search import fastest
from planner.search.fastest import Before, Unseen, fly_fastest
from planner.search.lookahead import lookahead
from planner.search.methods import Planner
from planner.search.patrol import MISSED, Missed
from planner.search.problem import Budget, Problem
from planner.search.rate import rate
from planner.search.state import SearchState
from planner.search.stepwise import legs_ahead, rate_of
from planner.search.what_if import WhatIf
from support.grid_instance import grid_futures, grid_problem
from support.search_instances import random_problem

RNG = np.random.default_rng(0)


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nets count as large, and hardly a leg is flown untold."""
    monkeypatch.setattr(fastest, "FEW", 0)
    monkeypatch.setattr(fastest, "FIRST", 2)


def states_of(problem: Problem, rng: np.random.Generator) -> Iterator[SearchState]:
    """States along random legs, in which some particles are seen; the first has seen none."""
    engine, state = WhatIf(problem), problem.first_state
    for _ in range(4):
        yield state
        legs = legs_ahead(problem, state)
        if len(legs) == 0:
            return
        flights = engine.fly(state, rng.choice(legs, 1))
        seen_at = np.minimum(state.seen_at, flights.seen(0, len(state.seen_at)))
        state = state.after(problem.legs, int(flights.leg[0]), seen_at)


@pytest.mark.parametrize("speed_mps", [12.0, 25.0, 60.0])
@pytest.mark.parametrize("seed", range(12))
def test_no_flight_earns_more_than_its_ceiling(seed: int, speed_mps: float) -> None:
    problem = random_problem(seed, by_s=900.0 if seed % 5 == 0 else None)
    problem = problem.replace(uav=problem.uav.__class__(0.0, 0.0, 0.0, speed_mps))
    engine, low = WhatIf(problem), 0
    for state in states_of(problem, np.random.default_rng(seed)):
        for following in (Unseen(engine, state), Missed(engine, state)):
            legs = legs_ahead(problem, state)
            _, gained = following.fly(legs)
            most = following.ceilings(legs)
            assert (gained <= most * (1 + 1e-9) + 1e-12).all()
            low += int((most < 0.9 * following.ceilings(legs).max()).sum())
    assert low > 0  # they tell legs apart


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("seed", range(12))
def test_the_fastest_are_among_those_flown(seed: int, count: int) -> None:
    problem = random_problem(seed)
    engine, left_out = WhatIf(problem), 0
    for state in states_of(problem, np.random.default_rng(seed)):
        for before in (None, Before(0.1 * problem.horizon_s, state.time_s - 500.0)):
            earlier, since_s = before or (0.0, state.time_s)
            legs = legs_ahead(problem, state)
            flights, gained = Unseen(engine, state).fly(legs)
            wanted = np.sort(rate_of(earlier + gained, flights.end_s - since_s))[-count:]
            some, earns = fly_fastest(Unseen(engine, state), count=count, before=before)
            found = np.sort(rate_of(earlier + earns, some.end_s - since_s))[-count:]
            np.testing.assert_array_equal(found[found > 0.0], wanted[wanted > 0.0])
            left_out += len(legs) - len(some.leg)
    assert left_out > 0


@pytest.mark.parametrize("planner", [rate, lookahead])
@pytest.mark.parametrize("seed", [1, 2, 3, 5])
def test_plans_are_the_same(seed: int, planner: Planner, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = random_problem(seed)
    whole = planner(problem, budget=Budget(), rng=RNG).plan
    monkeypatch.setattr(fastest, "FEW", 0)
    monkeypatch.setattr(fastest, "FIRST", 2)
    assert planner(problem, budget=Budget(), rng=RNG).plan.legs == whole.legs


def test_on_the_paper_grid_plans_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = grid_problem(grid_futures(200, np.random.default_rng(1)))
    whole = rate(problem, budget=Budget(), rng=RNG).plan
    monkeypatch.setattr(fastest, "FEW", 0)
    assert rate(problem, budget=Budget(), rng=RNG).plan.legs == whole.legs


def test_who_was_seen_long_ago_counts_more() -> None:
    problem = random_problem(1)
    engine, legs = WhatIf(problem), None
    seen_at = np.full(len(problem.futures), problem.uav.take_off_s)
    ceilings: list[Sequence[float]] = []
    for later_s in (100.0, 1000.0):
        state = SearchState.of_sightings(problem.uav.take_off_s + later_s, 0.0, 0.0, seen_at)
        legs = legs_ahead(problem, state)
        ceilings.append(engine.ceilings(state, legs, problem.futures.weight, missed=MISSED))
    unmissed = engine.ceilings(state, legs, problem.futures.weight)
    assert not unmissed.any()
    assert np.max(ceilings[0]) > 0.0
