"""Split by their first hops, plans of small nets are bounded by what their enumeration finds."""

from dataclasses import replace

import numpy as np
import pytest

from planner.arrays import Floats
from planner.bounds.branch_and_bound import Search
from planner.bounds.movements import Movements
from planner.bounds.particle_prices import table_of
from planner.detection.first_detection import first_detection
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.track import Track
from planner.flight.uav import Uav
from planner.network.road_network import RoadNetwork
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from support.cases import some_in_the_gate
from support.search_instances import driven, random_network, strayed

Way = list[tuple[float, float]]


def least_way_m(net: RoadNetwork) -> float:
    xy = net.node_xy_m
    return min(float(np.hypot(*(xy[a] - xy[b]))) for a, b in ((0, 1), (0, 2), (1, 2)))


def small_problem(seed: int) -> Problem:
    rng = np.random.default_rng(seed)
    net = random_network(rng, nodes=3, roads=3)
    while least_way_m(net) < 6000.0:  # not too many ways until the horizon
        net = random_network(rng, nodes=3, roads=3)
    futures = strayed(rng, 12) if seed % 3 == 0 else driven(net, rng, 12)
    start = rng.uniform(0, 12000, 2) if seed % 4 else net.node_xy_m[0]
    return Problem(
        network=net,
        futures=futures,
        uav=Uav(*map(float, start), float(rng.uniform(0, 100)), 100.0),
        sensor=Sensor(float(rng.choice([300.0, 1500.0])), bool(seed % 2)),
        objective=Objective(450.0, 350.0 if seed % 5 == 0 else None),
    )


def ways_from(problem: Problem, node: int) -> list[tuple[int, Way, bool]]:
    """Where one can go: to each other node straight, and along each road at the node."""
    net, sensor = problem.network, problem.sensor
    ways = [
        (
            other,
            [tuple(net.node_xy_m[node]), tuple(net.node_xy_m[other])],
            sensor.detects_in_transit,
        )
        for other in range(len(net.node_ids))
        if other != node
    ]
    for road in range(len(net.road_ids)):
        shape = [tuple(point) for point in net.shape(road)]
        ends = (net.road_from[road], net.road_to[road])
        ways += [(int(ends[1]), shape, True)] if ends[0] == node else []
        ways += [(int(ends[0]), shape[::-1], True)] if ends[1] == node else []
    return ways


def reward_on(problem: Problem, at_s: float, way: Way, on: bool) -> tuple[float, Floats]:
    """When a way that begins at a time ends, and the reward of what is seen on it."""
    xy = np.array(way)
    steps_s = np.hypot(*np.diff(xy, axis=0).T) / problem.uav.speed_mps
    time_s = at_s + np.concatenate(([0.0], np.cumsum(steps_s)))
    spans = np.array([(time_s[0], time_s[-1])] if on else []).reshape(-1, 2)
    track = Track(time_s, xy[:, 0], xy[:, 1], spans)
    seen_at = first_detection(problem.futures, track, problem.sensor.radius_m)
    return float(time_s[-1]), problem.objective.reward(seen_at)


def enumerated(problem: Problem) -> tuple[float, Floats]:
    """The most that any chain of ways earns until the horizon, and with which particles."""
    weight, ends_s = problem.futures.weight, problem.objective.ends_s
    best = np.zeros(len(weight))
    uav, net = problem.uav, problem.network
    waiting = []
    for node, place in enumerate(net.node_xy_m):
        way = [(uav.x_m, uav.y_m), tuple(place)]
        on = problem.sensor.detects_in_transit
        waiting.append((node, *reward_on(problem, uav.take_off_s, way, on)))
    while waiting:
        node, at_s, earned = waiting.pop()
        best = max(best, earned, key=lambda reward: float(weight @ reward))
        if at_s < ends_s:
            for other, way, on in ways_from(problem, node):
                end_s, more = reward_on(problem, at_s, way, on)
                waiting.append((other, end_s, np.maximum(earned, more)))
    return float(weight @ best), best


@pytest.mark.parametrize("seed", some_in_the_gate(110, 30))
def test_the_bound_meets_the_optimum(seed: int) -> None:
    problem = small_problem(seed)
    optimum, earned = enumerated(problem)
    movements = Movements(problem)
    table = table_of(movements, movements.fitting_bin_s)
    search = Search(movements, table, optimum, lambda _: False)
    search.begin(earned, 20)
    for _ in range(3000):
        if search.done:
            break
        search.split(6)
    value, bound = problem.objective.value(optimum), problem.objective.value(search.bound)
    assert search.bound >= optimum - 1e-9 * problem.objective.most
    assert abs(value - bound) <= 0.01 * bound


@pytest.mark.parametrize("share", [0.3, 0.985])
@pytest.mark.parametrize("seed", some_in_the_gate(30, 12))
def test_a_poor_plan_does_not_lower_the_bound(seed: int, share: float) -> None:
    """What the search knows of no good plan closes nothing that is worth more."""
    problem = small_problem(seed).replace(objective=Objective(400.0))
    optimum, earned = enumerated(problem)
    movements = Movements(problem)
    table = table_of(movements, movements.fitting_bin_s)
    search = Search(movements, table, share * optimum, lambda _: False)
    search.begin(share * earned, 20)
    for _ in range(60):
        if not search.done:
            search.split(3)
        assert search.bound >= optimum - 1e-9 * problem.objective.most


@pytest.mark.parametrize("seed", some_in_the_gate(30, 12))
def test_a_better_plan_is_met(seed: int) -> None:
    """Once nothing can be tighter, some beginning met earns what the best plan does, or nearly."""
    problem = small_problem(seed)
    optimum, earned = enumerated(problem)
    movements = Movements(problem)
    table = table_of(movements, movements.fitting_bin_s)
    search = Search(movements, table, 0.9 * optimum, lambda _: False)
    search.begin(0.9 * earned, 20)
    while not search.done:
        search.split(6)
    assert 0.99 * optimum <= search.flown.reward <= optimum + 1e-9 * problem.objective.most
    flown = plan_of_legs(problem, "", search.better).tracks[0]
    seen_at = first_detection(problem.futures, flown, problem.sensor.radius_m)
    reward = float(problem.futures.weight @ problem.objective.reward(seen_at))
    assert reward <= optimum + 1e-9 * problem.objective.most


@pytest.mark.parametrize("seed", [3, 5])
def test_any_number_of_threads_finds_the_same(seed: int) -> None:
    problem = small_problem(seed)
    _, earned = enumerated(problem)
    movements = Movements(problem)
    table, found = table_of(movements, movements.fitting_bin_s), []
    for workers in (1, 3):
        heard: list[float] = []

        def stop(bound: float, heard: list[float] = heard) -> bool:
            heard.append(bound)
            return len(heard) >= 70

        value = 0.95 * float(problem.futures.weight @ earned)
        search = Search(movements, table, value, stop, workers=workers)
        search.begin(0.9 * earned, 20)
        while not search.done and not search.stopped:
            search.split(3)
        proof = {prefix: price.tolist() for prefix, price in search.proof.items()}
        found.append((heard, search.bound, proof, search.better))
    assert found[0] == found[1]
    assert len(found[0][0]) > 20


@pytest.mark.parametrize("seed", range(6))
def test_what_is_left_out_only_lowers_the_bound(seed: int) -> None:
    """At any prices it is not below the optimum, and no more than with what is known as well."""
    problem, rng = small_problem(seed), np.random.default_rng(seed)
    optimum, earned = enumerated(problem)
    movements = Movements(problem)
    table = table_of(movements, movements.fitting_bin_s)
    sightings = table.columns.sightings
    nothing_known = sightings._replace(known=np.zeros_like(sightings.known))
    whole = replace(table, columns=table.columns._replace(sightings=nothing_known))
    for prices in (earned, 0.5 * earned, rng.uniform(0.0, problem.objective.most, len(earned))):
        bound = table.bound(prices).reward
        assert optimum - 1e-9 * problem.objective.most <= bound
        assert bound <= whole.bound(prices).reward + 1e-9 * problem.objective.most
