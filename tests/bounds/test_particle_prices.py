"""No road plan is worth more than any prices allow, and the best flight tells the slope."""

from dataclasses import replace

import numpy as np
import pytest

from planner.bounds.hops import hops_of
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


@pytest.mark.parametrize("seed", range(12))
def test_what_a_leg_before_surely_saw_it_saw(seed: int) -> None:
    """Whenever within its bins the hop begins, the leg flown just before has seen the particle."""
    problem, rng = random_problem(seed), np.random.default_rng(seed)
    hops, table = hops_of(problem.legs), small_table(problem)
    first, particle, _, known = table.columns.sightings
    first_into, into = table.columns.arrivals
    hop_of = np.searchsorted(first, np.arange(len(particle)), side="right") - 1
    told = np.flatnonzero(known)
    for e in rng.choice(told, min(60, len(told)), replace=False).tolist():
        i, hop = divmod(int(hop_of[e]), len(hops))
        before = [b for b in range(8) if known[e] >> b & 1]
        leg = int(into[first_into[hops.from_node[hop]] + before[0]])
        assert hops.to_node[leg] == hops.from_node[hop]
        for late in (-0.5, 0.0, 0.5):
            starts_s = table.bins.first_s + (i + late) * table.bins.step_s - hops.duration_s[leg]
            points = slice(hops.first_point[leg], hops.first_point[leg + 1])
            time_s = starts_s + hops.after_s[points]
            on = np.array([(time_s[0], time_s[-1])])
            track = Track(time_s, hops.x_m[points], hops.y_m[points], on)
            seen_at = first_detection(problem.futures, track, problem.sensor.radius_m)
            assert np.isfinite(seen_at[particle[e]])


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
        table_of(Movements(problem), 0.5)


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
