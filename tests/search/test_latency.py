"""Targets at rest at the nodes: the minimum latency problem, whose optima are known from outside.

With one target at each node and a small radius, the expected detection time of the best flight is
the least weighted sum of arrival times (the travelling repairman's), less the radius that a target
is seen ahead. On a line it is found by dynamic programming over intervals (Afrati et al., RAIRO
20, 1986); where any two nodes are joined by a road, over sets of nodes; and where the nodes can all
be passed at the shortest step there is, in closed form.
"""

from itertools import combinations, pairwise

import numpy as np
import pytest

from planner.arrays import Floats
from planner.bounds.certificate import Certificate, Effort, certified
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork
from planner.search.exact import best_order
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from planner.search.stop import WorkDone
from support.instances import grid, network_of_roads

SPEED_MPS, RADIUS_M, HORIZON_S = 100.0, 100.0, 1200.0


def at_rest(net: RoadNetwork, weight: Floats, start: int, *, transit: bool) -> Problem:
    """A target at rest at each node, and the UAV above one of them."""
    count, (x_m, y_m) = len(weight), net.node_xy_m.T
    futures = Futures(
        time_s=np.zeros(count),
        x_m=x_m,
        y_m=y_m,
        first_knot=np.arange(count + 1),
        weight=weight,
        gone=np.zeros(count, dtype=bool),
    )
    uav = Uav(x_m[start], y_m[start], 0.0, SPEED_MPS)
    return Problem(net, futures, uav, Sensor(RADIUS_M, transit), Objective(HORIZON_S))


def ahead_s(problem: Problem, start: int) -> float:
    """How much sooner targets are seen on average than the UAV is above them."""
    others = 1.0 - problem.futures.weight[start]
    return float(others * RADIUS_M / SPEED_MPS)


def along(problem: Problem, nodes: list[int]) -> list[int]:
    """The legs from node to node."""
    ends = zip(problem.legs.from_node.tolist(), problem.legs.to_node.tolist(), strict=True)
    leg = {pair: i for i, pair in enumerate(ends)}
    return [leg[pair] for pair in pairwise(nodes)]


def certificate_of(problem: Problem, order: list[int], steps: int) -> Certificate:
    return certified(problem, plan_of_legs(problem, "", order), Effort(stop=WorkDone(steps)))


def latency_on_a_line(x_m: Floats, weight: Floats, start: int) -> float:
    """Least weighted sum of arrival times, seconds, by what interval has been passed."""
    cost = {(start, start): {start: 0.0}}
    for width in range(1, len(x_m)):
        for i in range(len(x_m) - width):
            j = i + width
            inner = ((i, (i + 1, j)), (j, (i, j - 1)))
            cost[i, j] = {
                end: min(
                    before + (x_m[b] - x_m[a]) * left_of(weight, passed)
                    for at, before in cost[passed].items()
                    for a, b in [sorted((at, end))]
                )
                for end, passed in inner
                if passed in cost
            }
            if not cost[i, j]:
                del cost[i, j]
    return min(cost[0, len(x_m) - 1].values()) / SPEED_MPS


def left_of(weight: Floats, passed: tuple[int, int]) -> float:
    return float(1.0 - weight[passed[0] : passed[1] + 1].sum())


def latency_of_sets(xy_m: Floats, weight: Floats, start: int) -> tuple[float, list[int]]:
    """Least weighted sum of arrival times, seconds, and its order, by what set has been passed."""
    step_s = np.linalg.norm(xy_m[:, None] - xy_m, axis=2) / SPEED_MPS
    others = [node for node in range(len(xy_m)) if node != start]
    best = {(frozenset([start]), start): (0.0, [start])}
    for size in range(1, len(xy_m)):
        for group in combinations(others, size):
            passed = frozenset([start, *group])
            for end in group:
                before = passed - {end}
                left = 1.0 - float(weight[list(before)].sum())
                best[passed, end] = min(
                    (cost + step_s[at, end] * left, [*order, end])
                    for at in before
                    if (before, at) in best
                    for cost, order in [best[before, at]]
                )
    return min(found for (passed, _), found in best.items() if len(passed) == len(xy_m))


def line(x_m: Floats) -> RoadNetwork:
    names = {f"n{i}": (float(x), 0.0) for i, x in enumerate(x_m)}
    return network_of_roads(names, [(f"{a}{b}", a, b) for a, b in pairwise(names)])


def complete(xy_m: Floats) -> RoadNetwork:
    names = {f"n{i}": (float(x), float(y)) for i, (x, y) in enumerate(xy_m)}
    return network_of_roads(names, [(f"{a}{b}", a, b) for a, b in combinations(names, 2)])


def far_apart(rng: np.random.Generator, count: int) -> Floats:
    """Places none of which is seen from a straight flight between others, (count, 2) metres."""
    while True:
        xy = rng.uniform(0.0, 30_000.0, (count, 2))
        apart = [
            abs(float((xy[c] - xy[a]) @ (-way[1], way[0]))) / float(np.hypot(*way))
            for a, b in combinations(range(count), 2)
            for way in [xy[b] - xy[a]]
            for c in range(count)
            if c not in (a, b)
        ]
        if min(apart) > 1.5 * RADIUS_M:
            return xy


def on_the_way(nodes: list[int]) -> list[int]:
    """The nodes of a line passed from each to the next, both ends with them."""
    steps = [range(a, b, 1 if b > a else -1) for a, b in pairwise(nodes)]
    return [*(node for step in steps for node in step), nodes[-1]]


@pytest.mark.parametrize("transit", [False, True])
@pytest.mark.parametrize("seed", range(20))
def test_on_a_line(seed: int, transit: bool) -> None:
    """Two dynamic programmes, the exact planner and the flown plan agree; the bound is below."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(4, 9))
    x_m, start = 100.0 * np.cumsum(rng.integers(10, 100, count)), int(rng.integers(count))
    weight = rng.dirichlet(np.ones(count))
    problem = at_rest(line(x_m), weight, start, transit=transit)
    latency_s = latency_on_a_line(x_m, weight, start)
    by_sets_s, nodes = latency_of_sets(problem.network.node_xy_m, weight, start)
    assert by_sets_s == pytest.approx(latency_s)
    optimum = latency_s - ahead_s(problem, start)
    certificate = certificate_of(problem, along(problem, on_the_way(nodes)), 200)
    assert certificate.value == pytest.approx(optimum)
    assert certificate.bound <= optimum + 1e-6
    if transit:
        assert best_order(problem, count - 1)[1] == pytest.approx(optimum, abs=1e-6)
    else:
        assert certificate.gap < 0.1


@pytest.mark.parametrize("seed", range(8))
def test_where_roads_join_all(seed: int) -> None:
    """From any node to any other: the order of the nodes is all there is to choose."""
    rng = np.random.default_rng(seed)
    xy_m = far_apart(rng, 4 + seed % 3)
    weight = rng.dirichlet(np.ones(len(xy_m)))
    problem = at_rest(complete(xy_m), weight, 0, transit=seed % 2 == 0)
    latency_s, nodes = latency_of_sets(xy_m, weight, 0)
    optimum = latency_s - ahead_s(problem, 0)
    certificate = certificate_of(problem, along(problem, nodes), 100)
    assert certificate.value == pytest.approx(optimum)
    assert certificate.bound <= optimum + 1e-6
    if len(xy_m) == 4:
        assert best_order(problem, 6)[1] == pytest.approx(optimum, abs=1e-6)


@pytest.mark.parametrize("transit", [False, True])
@pytest.mark.parametrize("size", [2, 3, 4])
def test_row_by_row(size: int, transit: bool) -> None:
    """No node is nearer to another than a road is long, so the rows flown to and fro are best."""
    road_m, count = 3000.0, size * size
    problem = at_rest(
        grid(size, size, road_m=road_m), np.full(count, 1.0 / count), 0, transit=transit
    )
    problem = problem.replace(objective=Objective(3.0 * count * road_m / SPEED_MPS))
    rows = [list(range(row * size, (row + 1) * size)) for row in range(size)]
    nodes = [node for row, passed in enumerate(rows) for node in passed[:: -1 if row % 2 else 1]]
    optimum = (count - 1) / 2 * road_m / SPEED_MPS - ahead_s(problem, 0)
    certificate = certificate_of(problem, along(problem, nodes), 600)
    assert certificate.value == pytest.approx(optimum)
    assert certificate.bound <= optimum + 1e-6
    if not transit:
        assert certificate.gap < 0.02
