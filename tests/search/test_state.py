"""The state of a search between two legs, and what may be flown next."""

from dataclasses import replace

import numpy as np
import pytest

from planner.search.plan import plan_of_legs
from planner.search.problem import candidate_legs
from planner.search.state import SearchState
from support.search_instances import random_problem


@pytest.mark.parametrize("seed", range(4))
def test_legs_end_where_and_when_the_plan_says(seed: int) -> None:
    problem = random_problem(seed)
    order = np.random.default_rng(seed).choice(len(problem.legs), 5, replace=False)
    state = problem.first_state
    plan = plan_of_legs(problem, "some", order)
    for leg, flown in zip(order, plan.legs[0], strict=True):
        state = state.after(problem.legs, int(leg), state.seen_at)
        assert state.time_s == pytest.approx(flown.end_s)
    assert (state.x_m, state.y_m) == (plan.tracks[0].x_m[-1], plan.tracks[0].y_m[-1])
    assert state.roads == {leg // 2 for leg in order}


def test_the_earlier_sighting_counts() -> None:
    state = SearchState.of_sightings(0, 0, 0, [5, np.inf, 7, np.inf])
    assert state.absorb(np.array([6, 2, 3, np.inf])).seen_at.tolist() == [5, 2, 3, np.inf]
    assert state.seen_at.tolist() == [5, np.inf, 7, np.inf]


def test_directions() -> None:
    problem = random_problem(1)  # figure3
    roads = len(problem.network.road_ids)
    state = replace(problem.first_state, x_m=15000.0, y_m=0.0)  # at F
    own = candidate_legs(problem, state, directions="own")
    assert own.tolist() == list(range(0, 2 * roads, 2))
    both_ways = np.arange(roads) == 2
    driven = problem.replace(network=replace(problem.network, both_ways=both_ways))
    assert candidate_legs(driven, state, directions="own").tolist() == sorted([*own, 5])
    assert candidate_legs(problem, state).tolist() == list(range(2 * roads))
    near = candidate_legs(problem, state, directions="nearest end")
    ids = problem.network.road_ids
    names = [ids[leg // 2] + "'" * (leg % 2) for leg in near]
    assert names == ["AB'", "BC'", "BD'", "CE", "CF'", "DF'", "DG"]
    removed = candidate_legs(problem, state, removed=[0, 2])
    assert removed.tolist() == [2, 3, *range(6, 2 * roads)]


def test_nothing_that_ends_after_the_landing() -> None:
    problem = random_problem(1)
    state = problem.first_state
    end_s = state.time_s + problem.legs.transit_s(state.x_m, state.y_m) + problem.legs.duration_s
    limit_s = float(np.sort(end_s)[4])
    uav = replace(problem.uav, max_flight_time_s=limit_s - problem.uav.take_off_s + 1e-6)
    legs = candidate_legs(problem.replace(uav=uav), state)
    assert set(legs) == set(np.flatnonzero(end_s <= limit_s))
