"""No flight whatever earns more than its groups allow, and where they can they allow no more."""

from dataclasses import replace
from itertools import pairwise, permutations

import numpy as np
import pytest

from planner.arrays import Ints
from planner.bounds.any_flight import PRICE_STEPS
from planner.bounds.certificate import Effort, certified
from planner.bounds.group_hunts import SIZES, STEPS, GroupHunts, split
from planner.bounds.kernels.group_orders import Whereabouts, most_reward, onward
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.futures.edges_driven import EdgesDriven
from planner.search.anneal_waypoints import anneal_waypoints
from planner.search.problem import Budget, Problem
from planner.streams import stream
from support.any_flights import earliest, random_flight, reward_of, toy, toy_flights
from support.grid_instance import grid_futures, grid_problem
from support.search_instances import random_problem


def hunts_of(problem: Problem) -> GroupHunts:
    return GroupHunts(problem, earliest(problem))


def most_of(problem: Problem) -> float:
    return hunts_of(problem).most(lambda _: False)


@pytest.mark.parametrize("by_s", [None, 35.0])
@pytest.mark.parametrize("radius_m", [50.0, 400.0])
@pytest.mark.parametrize("seed", range(3))
def test_all_flights_on_a_toy(seed: int, radius_m: float, by_s: float | None) -> None:
    problem = toy(seed, radius_m=radius_m, by_s=by_s)
    most = max(reward_of(problem, *flight) for flight in toy_flights(problem))
    assert 0.0 < most <= most_of(problem) + 1e-9


@pytest.mark.parametrize("seed", range(6))
def test_targets_that_stand_get_the_best_order(seed: int) -> None:
    """With a tiny radius a flight goes from target to target; weights make the order matter."""
    problem = toy(seed, radius_m=0.1, still=True)
    futures, uav = problem.futures, problem.uav
    places = np.stack([futures.x_m[::4], futures.y_m[::4]], axis=1)
    most = 0.0
    for order in permutations(range(len(places))):
        way = np.vstack([[(uav.x_m, uav.y_m)], places[list(order)]])
        seen_at = np.cumsum(np.hypot(*np.diff(way, axis=0).T)) / uav.speed_mps
        reward = problem.objective.reward(seen_at)
        most = max(most, float(futures.weight[list(order)] @ reward))
    physics = float(futures.weight @ problem.objective.reward(earliest(problem)))
    bound = most_of(problem)
    assert most <= bound < physics
    assert bound - most < 0.25 * (physics - most)


@pytest.mark.parametrize("seed", range(24))
def test_random_flights_earn_no_more(seed: int) -> None:
    """Also where particles jump, come late, vanish, or are faster than the UAV."""
    problem, rng = random_problem(seed, particles=20), np.random.default_rng(seed)
    problem = problem.replace(objective=Objective(1200.0, 600.0 if seed % 5 == 0 else None))
    physics = float(problem.futures.weight @ problem.objective.reward(earliest(problem)))
    most = max(reward_of(problem, *random_flight(problem, rng)) for _ in range(300))
    assert most - 1e-9 <= most_of(problem) <= physics + 1e-9


@pytest.mark.parametrize("distance_m", [0.0, 60_000.0])
def test_annealed_flights_earn_no_more(distance_m: float) -> None:
    futures = grid_futures(24, np.random.default_rng(3))
    problem = grid_problem(futures, distance_m=distance_m)
    found = anneal_waypoints(problem, budget=Budget(work=400_000), rng=stream(1, "test"))
    certificate = certified(problem, found.plan, Effort())
    assert certificate.plan_class == "free"
    assert certificate.physics is not None
    assert certificate.physics < certificate.bound <= certificate.value
    assert certificate.bound >= problem.objective.value(most_of(problem))
    assert certificate.trace[-1].value == certificate.bound


def test_a_wider_sensor_earns_no_less() -> None:
    problem, group = grid_problem(grid_futures(10, np.random.default_rng(5))), np.arange(10)
    rewards = [
        hunts_of(problem.replace(sensor=Sensor(radius_m))).reward(group)
        for radius_m in (10.0, 100.0, 300.0, 1000.0)
    ]
    assert rewards == sorted(rewards)
    assert rewards[0] < rewards[-1]


def test_alone_or_all_together_it_is_the_bound_of_physics() -> None:
    problem = grid_problem(grid_futures(12, np.random.default_rng(2)), distance_m=30_000.0)
    alone = problem.futures.weight * problem.objective.reward(earliest(problem))
    hunts = hunts_of(problem)
    rewards = [hunts.reward(np.array([k])) for k in range(12)]
    np.testing.assert_allclose(rewards, alone, rtol=1e-12)
    one = grid_futures(1, np.random.default_rng(2))
    crowd = replace(
        one,
        time_s=np.tile(one.time_s, 12),
        x_m=np.tile(one.x_m, 12),
        y_m=np.tile(one.y_m, 12),
        first_knot=len(one.time_s) * np.arange(13),
        weight=np.full(12, 1 / 12),
        gone=np.zeros(12, dtype=bool),
        target=np.zeros(12),
        edges=EdgesDriven.unknown(12),
    )
    together = problem.replace(futures=crowd)
    physics = float(crowd.weight @ problem.objective.reward(earliest(together)))
    assert most_of(together) == pytest.approx(physics, rel=1e-12)


def test_it_may_end_at_any_step() -> None:
    problem = grid_problem(grid_futures(40, np.random.default_rng(1)))
    heard: list[float] = []

    def stop(least: float) -> bool:
        heard.append(least)
        return len(heard) == 250

    assert hunts_of(problem).most(stop) == heard[-1]
    assert heard == sorted(heard, reverse=True)
    assert len(SIZES) * STEPS + PRICE_STEPS == 600  # as many steps as road plans take


def test_nobody_to_see_earns_nothing() -> None:
    problem = grid_problem(grid_futures(5, np.random.default_rng(1)), distance_m=2e6)
    assert most_of(problem) == 0.0


def slow_onward(places: Whereabouts, around_m: float, flown_m: float) -> Ints:
    """The least bin that any later departure leads to, pair by pair."""
    n, bins = places.x_m.shape
    found = np.full((n, n, bins), bins)
    for k, j in permutations(range(n), 2):
        step_m = max(flown_m, places.strays_m[k].max())
        for at in range(bins):
            for to in range(at, bins):
                way = (places.x_m[j, to] - places.x_m[k, at], places.y_m[j, to] - places.y_m[k, at])
                reach_m = around_m + places.strays_m[k, at] + places.strays_m[j, to]
                is_met = np.hypot(*way) <= reach_m + (to - at + 1) * step_m
                if is_met and places.is_there[j, to]:
                    found[k, j, at] = to
                    break
        found[k, j] = np.minimum.accumulate(found[k, j, ::-1])[::-1]
    return found


@pytest.mark.parametrize("seed", range(8))
def test_orders_against_all_permutations(seed: int) -> None:
    rng, (n, bins) = np.random.default_rng(seed), (5, 60)
    steps = rng.normal(0.0, 8.0, (2, n, bins))
    x_m, y_m = rng.uniform(0, 300, (2, n, 1)) + np.cumsum(steps, axis=2)
    strays_m = np.hypot(*np.diff(np.stack([x_m, y_m]), axis=2, append=0.0))
    strays_m[:, -1] = 0.0
    places = Whereabouts(x_m, y_m, strays_m, rng.random((n, bins)) < 0.9)
    onward_to = onward(places, 10.0, 12.0)
    np.testing.assert_array_equal(onward_to, slow_onward(places, 10.0, 12.0))
    first = rng.integers(0, 30, n).astype(np.int32)
    reward = np.maximum(0.0, 50.0 - np.arange(bins)) * rng.random((n, 1))
    most = 0.0
    for order in permutations(range(n)):
        at, earned = first[order[0]], reward[order[0], first[order[0]]]
        for k, j in pairwise(order):
            at = max(first[j], onward_to[k, j, at]) if at < bins else bins
            earned += reward[j, at] if at < bins else 0.0
        most = max(most, earned)
    assert most - 1e-9 <= most_reward(first, onward_to, reward) <= 1.1 * most


def test_clusters_are_near_and_even() -> None:
    rows = np.arange(40)
    places = np.random.default_rng(1).uniform(0, 1, (40, 2)) + 10.0 * (rows % 4)[:, None]
    parts = list(split(places, rows, 4))
    assert sorted(np.concatenate(parts).tolist()) == rows.tolist()
    assert [len(set((part % 4).tolist())) for part in parts] == [1, 1, 1, 1]
    assert {len(part) for part in split(places, rows, 16)} <= {2, 3}
    assert len(list(split(places, rows[:3], 16))) == 3
