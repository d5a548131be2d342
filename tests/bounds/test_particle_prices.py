"""No road plan is worth more than any prices allow, and the best flight tells the slope."""

from dataclasses import replace

import numpy as np
import pytest

from planner.bounds.hops import hops_of
from planner.bounds.kernels.hops import Bins, blank, stay_through, sweep
from planner.bounds.movements import Movements
from planner.bounds.particle_prices import Table, table_of
from planner.bounds.subgradient import lowest
from planner.detection.first_detection import first_detection
from planner.detection.objective import Objective
from planner.errors import NotApplicableError
from planner.flight.track import Track
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from planner.search.rate import rate_order
from planner.search.what_if import WhatIf
from support.cases import some_in_the_gate
from support.grid_instance import grid_futures, grid_problem
from support.search_instances import random_problem


def reward_of(problem: Problem, order: list[int]) -> np.ndarray:
    track = plan_of_legs(problem, "", order).tracks[0]
    return problem.objective.reward(
        first_detection(problem.futures, track, problem.sensor.radius_m)
    )


def random_orders(problem: Problem, rng: np.random.Generator, many: int) -> list[list[int]]:
    """Orders with any roads any number of times, half of them without flights in between."""
    legs, orders = problem.legs, []
    for _ in range(many):
        order = [int(rng.integers(len(legs)))]
        while len(order) < 12:
            onward = np.flatnonzero(legs.from_node == legs.to_node[order[-1]])
            near = len(onward) > 0 and rng.random() < 0.7
            order.append(int(rng.choice(onward) if near else rng.integers(len(legs))))
        orders.append(order)
    return orders


def small_table(problem: Problem) -> Table:
    movements = Movements(problem)
    return table_of(movements, movements.fitting_bin_s)


@pytest.mark.parametrize("seed", some_in_the_gate(100, 30))
def test_no_plan_is_worth_more(seed: int) -> None:
    problem, rng = (
        random_problem(seed).replace(objective=Objective(1000.0)),
        np.random.default_rng(seed),
    )
    if seed % 5 == 0:
        problem = problem.replace(objective=Objective(1000.0, 700.0))
    weight, table = problem.futures.weight, small_table(problem)
    orders = [*random_orders(problem, rng, 60), rate_order(WhatIf(problem))]
    rewards = [reward_of(problem, order) for order in orders]
    best = max(rewards, key=lambda reward: weight @ reward)
    value = float(weight @ best)
    for prices in (0.0 * best, best, rng.uniform(0.0, problem.objective.most, len(best))):
        bound, _ = table.bound(prices)
        assert bound >= value - 1e-9
    least, prices = lowest(table, 0.9 * best, value, steps=20, stop=lambda _: False)
    assert value - 1e-9 <= least <= table.bound(0.9 * best)[0] + 1e-9
    assert table.bound(prices)[0] == pytest.approx(least)


@pytest.mark.parametrize("seed", range(8))
def test_counts_are_a_slope(seed: int) -> None:
    """The bound is convex in the prices; what is sold tells how it changes."""
    problem, rng = random_problem(seed), np.random.default_rng(seed)
    table, most = small_table(problem), problem.objective.most
    for _ in range(10):
        here, there = rng.uniform(0.3 * most, most, (2, len(problem.futures)))
        bound, counts = table.bound(here)
        change = (table.weight * (1.0 - counts)) @ (there - here)
        assert table.bound(there)[0] >= bound + change - 1e-7 * most


def sight_of(problem: Problem, hop: int, start_s: float) -> np.ndarray:
    """When a hop begun at a time sees each particle, by its whole track."""
    hops = hops_of(problem.legs)
    points = slice(hops.first_point[hop], hops.first_point[hop + 1])
    time_s = start_s + hops.after_s[points]
    on = np.array([(time_s[0], time_s[-1])])
    track = Track(time_s, hops.x_m[points], hops.y_m[points], on)
    return first_detection(problem.futures, track, problem.sensor.radius_m)


@pytest.mark.parametrize("seed", range(12))
def test_what_a_leg_before_makes_worthless(seed: int) -> None:
    """From wherever in its bin it begins, it may see as soon, or whatever came before it saw."""
    problem, rng = random_problem(seed), np.random.default_rng(seed)
    movements, table, radius_m = Movements(problem), small_table(problem), problem.sensor.radius_m
    hops, xy = movements.hops, problem.network.node_xy_m
    first, particle, reward, known, _ = table.columns.sightings
    first_into, into = table.columns.arrivals
    bins, told, as_soon = table.bins, np.flatnonzero(known), 0
    cell_of = np.searchsorted(first, np.arange(len(particle)), side="right") - 1
    for e in rng.choice(told, min(100, len(told)), replace=False).tolist():
        (i, hop), k = divmod(int(cell_of[e]), len(hops)), int(particle[e])
        bit = next(b for b in range(8) if known[e] >> b & 1)
        leg = int(into[first_into[hops.from_node[hop]] + bit])
        assert hops.to_node[leg] == hops.from_node[hop]
        for ago in set(map(int, bins.lasting(hops.duration_s[leg]))):
            cell = (i - ago) * len(hops) + leg
            rows = slice(first[cell], first[cell + 1])
            if np.any(reward[rows][particle[rows] == k] >= reward[e]):
                as_soon += 1
                continue
            for late in (-0.5, -0.2, 0.0, 0.3, 0.5):
                at_s = bins.first_s + (i - ago + late) * bins.step_s
                away_m = problem.futures.positions(at_s)[k] - xy[hops.from_node[leg]]
                assert np.hypot(*away_m) <= radius_m + 1e-6
    assert as_soon or len(told) < 10


@pytest.mark.parametrize("seed", range(12))
def test_a_bin_sees_what_any_start_in_it_sees(seed: int) -> None:
    """As early as the earliest of many starts, nearly, and never later."""
    problem, rng = random_problem(seed, particles=20), np.random.default_rng(seed)
    movements, radius_m = Movements(problem), problem.sensor.radius_m
    bins = Bins(float(rng.uniform(0.0, 300.0)), float(rng.choice([1.0, 5.0, 30.0])), 12)
    for hop in rng.choice(len(movements.hops), 3, replace=False).tolist():
        sight = blank(bins.total, len(problem.futures))
        sweep(movements.hops.motion(hop), movements.pieces, bins, radius_m, sight)
        may_s = sight.at_s
        for i in rng.choice(bins.total, 3, replace=False).tolist():
            starts_s = bins.first_s + (i + np.linspace(-0.5, 0.5, 41)) * bins.step_s
            seen_s = np.array([sight_of(problem, hop, start_s) for start_s in starts_s])
            earliest_s = seen_s.min(axis=0)
            assert np.all(may_s[i] <= earliest_s + 1e-6)
            met = np.isfinite(earliest_s)
            assert np.all(may_s[i][met] >= earliest_s[met] - bins.step_s / 10)
            # From between two starts more may be seen, but hardly by one that passes far off.
            assert np.count_nonzero(np.isfinite(may_s[i]) & ~met) <= 2


@pytest.mark.parametrize("seed", range(6))
def test_who_is_seen_before_was_in_reach_throughout(seed: int) -> None:
    problem, rng = random_problem(seed, particles=60), np.random.default_rng(seed)
    pieces, bins = Movements(problem).pieces, Bins(50.0, 4.0, 100)
    here = np.zeros((bins.total, len(problem.futures)), dtype=bool)
    at_m, reach_m = tuple(problem.network.node_xy_m[rng.integers(4)].tolist()), 1500.0
    stay_through(at_m, pieces, bins, reach_m, here)
    looks_s = bins.first_s + np.linspace(-0.5, 0.5, 21) * bins.step_s
    all_s = (looks_s[None] + bins.step_s * np.arange(bins.total)[:, None]).ravel()
    away = [np.hypot(*(problem.futures.positions(at_s) - at_m).T) <= reach_m for at_s in all_s]
    in_reach = np.array(away).reshape(bins.total, 21, -1).all(axis=1)
    assert np.array_equal(here & ~in_reach, np.zeros_like(here))
    assert np.count_nonzero(here != in_reach) <= 0.1 * np.count_nonzero(in_reach) + 5


def test_hops_of_the_grid() -> None:
    """Straight flights along rows and columns are legs; those over a crossroads are two hops."""
    hops = hops_of(grid_problem(grid_futures(1, np.random.default_rng(1))).legs)
    assert hops.legs == 120
    steps = np.stack([hops.x_m, hops.y_m], axis=1).reshape(-1, 2, 2)
    steps = np.abs(np.diff(steps[hops.legs :], axis=1)[:, 0] / 15_000.0).round().astype(int)
    assert np.all(np.gcd(steps[:, 0], steps[:, 1]) == 1)
    assert np.all(steps > 0)
    assert len(np.unique(hops.from_node * 36 + hops.to_node)) == len(hops)


def test_bins_must_fit() -> None:
    """A hop that ends in the bin it began in would be worth nothing to a programme over time."""
    problem = grid_problem(grid_futures(3, np.random.default_rng(1)))
    with pytest.raises(NotApplicableError, match="shortest flight"):
        table_of(Movements(problem), 200.0)
    with pytest.raises(NotApplicableError, match="smaller net"):
        table_of(Movements(problem), 0.1)


def test_a_table_has_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("planner.bounds.sighting_table.MOST_SIGHTINGS", 100)
    problem = grid_problem(grid_futures(3, np.random.default_rng(1)))
    with pytest.raises(NotApplicableError, match="more than 100 sightings"):
        table_of(Movements(problem), 5.0)


@pytest.mark.parametrize("seed", some_in_the_gate(40, 10))
def test_a_table_above_a_floor_proves_what_a_whole_one_does(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of sensors that may miss as well; and the first floor that makes it small is taken."""
    problem, rng = random_problem(seed), np.random.default_rng(seed)
    if seed % 2:
        problem = problem.replace(sensor=replace(problem.sensor, rate_per_s=0.02))
    movements, most = Movements(problem), problem.objective.most
    whole = table_of(movements, movements.fitting_bin_s)
    low = rng.uniform(0.3 * most, 0.9 * most, len(problem.futures))
    floors = [0.0 * low, low, low + 0.1 * most]
    monkeypatch.setattr("planner.bounds.sighting_table.MOST_SIGHTINGS", whole.size - 1)
    table = table_of(movements, movements.fitting_bin_s, floors)
    assert table.size < whole.size
    assert np.array_equal(table.floor, low)
    for prices in (low, low + rng.uniform(0.0, 0.3 * most, len(low))):
        bound, counts = table.bound(prices)
        assert bound == whole.bound(prices).reward
        assert np.array_equal(counts, whole.bound(prices).counts)


def test_two_nodes_at_one_place_have_no_bound() -> None:
    """No flight leads from one to the other, so what starts at the other would be left out."""
    net = grid_problem(grid_futures(3, np.random.default_rng(1))).network
    xy = net.node_xy_m.copy()
    xy[1] = xy[0]
    problem = random_problem(1)
    with pytest.raises(NotApplicableError, match="nodes that are at one place"):
        table_of(Movements(problem.replace(network=replace(net, node_xy_m=xy))), 1.0)


def test_a_road_plan_that_has_to_come_home_has_no_bound() -> None:
    problem = random_problem(1)
    uav = replace(problem.uav, return_to_m=(0.0, 0.0))
    with pytest.raises(NotApplicableError, match="return_to"):
        table_of(Movements(problem.replace(uav=uav)), 1.0)
