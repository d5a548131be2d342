"""Both ways to the best order, against plain enumeration and the evaluation of whole plans."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor, rate_of
from planner.errors import NotApplicableError
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork
from planner.search import exact as exact_module
from planner.search.exact import best_order, enumerate_orders, exact, number_of_orders
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from support.cases import some_in_the_gate
from support.instances import (
    by_two_letters,
    figure1,
    figure3,
    grid,
    network_of_roads,
    physics_futures,
)

KM = 1000.0


def figure3_problem(*, gone: bool, x_m: float = -30 * KM, take_off_s: float = 0.0) -> Problem:
    """25 speeds times 4 paths, all taken, as in ``sumo_nets/figure3``."""
    network = figure3()
    paths = [path.split() for path in ("AB BC CE", "AB BC CF", "AB BD DF", "AB BD DG")]
    routes = [path for path in paths for _ in range(25)]
    speeds = np.tile(np.arange(6.0, 31.0), 4)
    return Problem(
        network=network,
        futures=physics_futures(network, routes, 0.0, speeds, gone=gone),
        uav=Uav(x_m, 0.0, take_off_s, 100.0),
        sensor=Sensor(200.0),
        objective=Objective(3600.0),
    )


def bent(network: RoadNetwork, rng: np.random.Generator) -> RoadNetwork:
    """The same roads, each with two corners on its way."""
    roads = len(network.road_ids)
    shapes = []
    for road in range(roads):
        start, end = network.shape(road)
        corners = start + np.outer([0.3, 0.6], end - start) + rng.uniform(-KM, KM, (2, 2))
        shapes.append(np.vstack([start, corners, end]))
    return replace(network, first_point=4 * np.arange(roads + 1), shape_xy_m=np.concatenate(shapes))


def random_futures(network: RoadNetwork, rng: np.random.Generator, *, count: int) -> Futures:
    """Some rest, some vanish, some start late, one is faster than the UAV, one never starts."""
    routes = []
    for _ in range(count):
        edge = int(rng.integers(len(network.edge_ids)))
        route = [edge]
        while len(turns := network.turns(edge)) and len(route) < 4:
            edge = int(rng.choice(turns))
            route.append(edge)
        routes.append([network.edge_ids[e] for e in route])
    speeds = rng.uniform(5.0, 40.0, count)
    speeds[0] = 130.0
    depart = rng.choice([0.0, 60.0, 200.0], count)
    depart[1] = 1e6
    return physics_futures(
        network,
        routes,
        rng.uniform(0.0, 300.0, count),
        speeds,
        gone=rng.random(count) < 0.5,
        weight=rng.dirichlet(np.ones(count)) * rng.choice([1.0, 0.7]),
        depart_s=depart,
        horizon_s=2000.0,
    )


def random_problem(seed: int, roads: int) -> Problem:
    rng = np.random.default_rng(seed)
    nodes = {name: (rng.uniform(0, 8 * KM), rng.uniform(0, 8 * KM)) for name in "ABCDE"}
    pairs = [a + b for a, b in itertools.permutations(nodes, 2)]
    network = by_two_letters(nodes, " ".join(rng.choice(pairs, roads, replace=False)))
    if seed % 3 == 0:
        network = bent(network, rng)
    flight_s, take_off_s, radius_m, horizon_s = (
        float(rng.choice(values))
        for values in ([np.inf, 300.0, 450.0], [0.0, 100.0], [20.0, 300.0], [250.0, 2000.0])
    )
    x_m, y_m = rng.uniform(-6 * KM, 8 * KM, 2).tolist()
    return Problem(
        network=network,
        futures=random_futures(network, rng, count=12),
        uav=Uav(x_m, y_m, take_off_s, 100.0, max_flight_time_s=flight_s),
        sensor=Sensor(radius_m, detects_in_transit=bool(rng.random() < 0.5)),
        objective=Objective(horizon_s),
    )


def missing(problem: Problem, detects: float) -> Problem:
    """The same with a sensor whose pass straight over a resting target misses it now and then."""
    sensor, speed_mps = problem.sensor, float(problem.uav.speed_mps)
    rate_per_s = rate_of(detects, sensor.radius_m, speed_mps)
    return problem.replace(sensor=replace(sensor, rate_per_s=rate_per_s))


def plain_orders(roads: int, flown: int) -> list[tuple[int, ...]]:
    return sorted(
        tuple(2 * road + way for road, way in zip(order, ways, strict=True))
        for order in itertools.permutations(range(roads), flown)
        for ways in itertools.product((0, 1), repeat=flown)
    )


def plain_value(problem: Problem, order: tuple[int, ...]) -> float:
    """E of the whole flight, as any other plan is evaluated."""
    tracks = plan_of_legs(problem, "", order).tracks
    result = evaluate(tracks, problem.futures, problem.sensor, problem.objective)
    return result.figure


@pytest.mark.parametrize(("roads", "count"), [(1, 2), (2, 8), (3, 48), (4, 384)])
@pytest.mark.parametrize("seed", range(6))
def test_enumeration_is_plain_enumeration(roads: int, count: int, seed: int) -> None:
    problem = random_problem(seed, roads)
    orders = plain_orders(roads, roads)
    result = enumerate_orders(problem)
    assert len(result) == len(orders) == count == number_of_orders(roads)
    assert [result.order(i) for i in range(count)] == orders
    expected = [plain_value(problem, order) for order in orders]
    np.testing.assert_allclose(result.value, expected, rtol=1e-10)


@pytest.mark.parametrize("by_s", [None, 200.0])
@pytest.mark.parametrize("seed", range(6))
def test_with_misses_too(seed: int, by_s: float | None) -> None:
    problem = missing(random_problem(seed, 3), 0.6)
    problem = problem.replace(objective=Objective(problem.horizon_s, by_s))
    values = enumerate_orders(problem).value
    expected = [plain_value(problem, order) for order in plain_orders(3, 3)]
    np.testing.assert_allclose(values, expected, rtol=1e-9, atol=1e-12)
    order, value = best_order(problem, 3)
    assert value == pytest.approx(values.min() if by_s is None else values.max(), abs=2e-6)
    assert plain_value(problem, order) == pytest.approx(value, abs=1e-9)


@pytest.mark.parametrize("seed", some_in_the_gate(50, 18))
def test_both_ways_agree_on_small_nets(seed: int) -> None:
    problem = random_problem(100 + seed, 3 + seed % 3)
    roads = len(problem.network.road_ids)
    order, value_s = best_order(problem, roads)
    assert value_s == pytest.approx(enumerate_orders(problem).value.min(), abs=2e-6)
    assert plain_value(problem, order) == pytest.approx(value_s, abs=1e-9)


def test_the_small_nets_are_worth_searching() -> None:
    spread = [np.ptp(enumerate_orders(random_problem(100 + s, 4)).value) for s in range(20)]
    assert np.median(spread) > 10.0


@pytest.mark.parametrize("flown", [0, 1, 2, 3])
@pytest.mark.parametrize("seed", range(5))
def test_the_best_of_fewer_legs_than_roads(flown: int, seed: int) -> None:
    problem = random_problem(200 + seed, 4)
    orders = plain_orders(4, flown)
    assert len(orders) == number_of_orders(4, flown)
    order, value_s = best_order(problem, flown)
    assert len(order) <= flown
    assert value_s == pytest.approx(min(plain_value(problem, o) for o in orders), abs=2e-6)


def star(lengths_m: list[float], odds: list[float], looks: int) -> Problem:
    """A target rests at the tip of an arm; so many roads lead out to each tip and back."""
    arms, center = len(odds), np.zeros(2)
    angles = 2.0 * np.pi * np.arange(arms) / arms
    tips = 0.5 * np.array(lengths_m)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    shapes = [np.stack([center, tip, center]) for tip in tips for _ in range(looks)]
    net = network_of_roads(
        {"A": (0.0, 0.0)}, [(f"{arm}-{k}", "A", "A") for arm in range(arms) for k in range(looks)]
    )
    net = replace(
        net, first_point=3 * np.arange(len(shapes) + 1), shape_xy_m=np.concatenate(shapes)
    )
    none = np.zeros(arms, dtype=bool)
    futures = Futures(np.zeros(arms), *tips.T, np.arange(arms + 1), np.array(odds), none)
    return Problem(net, futures, Uav(0.0, 0.0, 0.0, 100.0), Sensor(200.0), Objective(2000.0))


@pytest.mark.parametrize("seed", range(3))
def test_on_a_star_the_likelier_look_per_second_comes_first(seed: int) -> None:
    """Looks at places where a target may rest: by falling p q (1 - q)^(k - 1) / c."""
    rng, looks = np.random.default_rng(seed), 2
    lengths_m, odds = rng.uniform(4 * KM, 12 * KM, 3), rng.dirichlet(np.ones(3))
    problem = missing(star(lengths_m.tolist(), odds.tolist(), looks), 0.4)
    each = [(arm, look) for arm in range(3) for look in range(looks)]
    index = {one: odds[one[0]] * 0.6 ** one[1] / lengths_m[one[0]] for one in each}
    rule = [2 * (looks * arm + look) for arm, look in sorted(each, key=lambda one: -index[one])]
    order, value_s = best_order(problem, len(each))
    assert value_s == pytest.approx(plain_value(problem, tuple(rule)), abs=1e-6)
    arms = [leg // 2 // looks for leg in order]
    assert arms == [leg // 2 // looks for leg in rule]


@pytest.mark.parametrize("gone", [False, True])
def test_both_ways_agree_on_figure3(gone: bool) -> None:
    problem = figure3_problem(gone=gone)
    result = enumerate_orders(problem)
    assert len(result) == 645_120  # Section 4.1: 2^7 7!
    for index in np.random.default_rng(3).integers(len(result), size=100).tolist():
        value_s = plain_value(problem, result.order(index))
        assert result.value[index] == pytest.approx(value_s, abs=1e-9)
    _, value_s = best_order(problem, 7)
    assert value_s == pytest.approx(result.value.min(), abs=2e-6)


@pytest.mark.parametrize("gone", [False, True])
@pytest.mark.parametrize(("x_m", "take_off_s"), [(-60 * KM, 0.0), (-100 * KM, 300.0)])
def test_no_neighbour_of_the_best_order_is_better(
    gone: bool, x_m: float, take_off_s: float
) -> None:
    problem = figure3_problem(gone=gone, x_m=x_m, take_off_s=take_off_s)
    plan = exact(problem, budget=Budget(), rng=np.random.default_rng(0)).plan
    order = [flown.leg for flown in plan.legs[0]]
    best_s = plain_value(problem, tuple(order))
    for i, j in itertools.combinations(range(7), 2):
        swapped = order.copy()
        swapped[i], swapped[j] = order[j], order[i]
        assert plain_value(problem, tuple(swapped)) >= best_s - 1e-6
    for i in range(7):
        turned = [leg ^ (i == place) for place, leg in enumerate(order)]
        assert plain_value(problem, tuple(turned)) >= best_s - 1e-6


def test_the_plan_flies_every_road_once() -> None:
    problem = figure3_problem(gone=True)
    needed, _ = best_order(problem, 7)
    assert len(needed) < 7  # the rest is for targets unknown to the futures
    plan = exact(problem, budget=Budget(), rng=np.random.default_rng(0)).plan
    assert sorted(flown.road for flown in plan.legs[0]) == list(range(7))
    fewer = exact(problem, budget=Budget(roads=3), rng=np.random.default_rng(0)).plan
    assert len(fewer.legs[0]) == 3


def test_a_pause_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = random_problem(300, 5)
    at_once = best_order(problem, 5)
    monkeypatch.setattr(exact_module, "STEPS_AT_A_TIME", 1)
    assert best_order(problem, 5) == at_once


def test_more_orders_than_can_be_searched_are_refused() -> None:
    network = figure1()
    futures = physics_futures(network, [["AB"]], 0.0, 20.0)
    problem = figure3_problem(gone=True).replace(network=network, futures=futures)
    with pytest.raises(NotApplicableError, match="3,715,891,200 orders"):
        exact(problem, budget=Budget(), rng=np.random.default_rng(0))
    with pytest.raises(NotApplicableError, match="3,715,891,200 orders"):
        enumerate_orders(problem)
    assert exact(problem, budget=Budget(roads=2), rng=np.random.default_rng(0)).plan.legs
    with pytest.raises(NotApplicableError, match=r"10\^"):
        exact(problem.replace(network=grid(6, 6)), budget=Budget(), rng=np.random.default_rng(0))


def test_the_earliest_meeting_is_physics() -> None:
    """At the time given the particle is in reach, at no sampled time before it was."""
    from planner.search.kernels.exact import earliest_meeting

    reached = 0
    for seed in range(40):
        problem = random_problem(400 + seed, 5)
        case = exact_module._case(problem)
        futures, speed = problem.futures, problem.uav.speed_mps
        for k, time_s in itertools.product(range(len(futures)), (0.0, 150.0)):
            meeting_s = earliest_meeting(case, seed % 5, time_s, k)
            assert meeting_s >= time_s
            times = np.linspace(time_s, min(meeting_s, 3000.0), 500)
            times = times[times < meeting_s - 1e-6]
            away = futures.xy(k, times) - case.place_xy_m[seed % 5]
            reach = problem.sensor.radius_m + speed * (times - time_s)
            assert not np.any(np.linalg.norm(away, axis=1) < reach - 1e-6)
            if meeting_s < np.inf:
                away_m = np.linalg.norm(futures.xy(k, meeting_s) - case.place_xy_m[seed % 5])
                assert away_m <= problem.sensor.radius_m + speed * (meeting_s - time_s) + 1e-6
                reached += 1
    assert 200 < reached < 960


@pytest.mark.parametrize("detects", [1.0, 0.6])
def test_no_completion_beats_its_bound(detects: float) -> None:
    """For every first leg; some bounds of single particles are reached, so none is too low."""
    from planner.search.kernels.exact import completion_bound
    from planner.search.kernels.prefixes import fly

    reached = 0
    for seed in range(30):
        problem = missing(random_problem(500 + seed, 3), detects)
        single = replace(problem.futures.take(np.array([seed % 12])), weight=[1.0])
        for variant in (problem, problem.replace(futures=single)):
            case = exact_module._case(variant)
            states = exact_module._states(variant, case, 2)
            best_s = enumerate_orders(variant).value.reshape(6, -1).min(axis=1)
            for leg in range(6):
                if not fly(case, states, 0, leg, 1):
                    continue
                bound_s = completion_bound(case, states, 1, np.inf)
                assert bound_s <= best_s[leg] + 1e-6
                seen_later = states.opens[1] > 0 and best_s[leg] < problem.horizon_s
                reached += seen_later and best_s[leg] < bound_s + 0.5
    assert reached > 5


@pytest.mark.parametrize("by_s", [None, 900.0])
def test_of_several_targets_the_value_is_their_sum(by_s: float | None) -> None:
    one = figure3_problem(gone=False).replace(objective=Objective(3600.0, by_s))
    order, value = best_order(one, 2)
    often = one.futures.take(np.tile(np.arange(len(one.futures)), 2))
    two = one.replace(
        futures=often.reweighted(often.weight * 0.75),  # each of them may not be there
        objective=Objective(3600.0, by_s, sought=2),
    )
    same, figure = best_order(two, 2)
    flown = plan_of_legs(two, "exact", same)
    found = evaluate(flown.tracks, two.futures, two.sensor, two.objective)
    assert same == order
    assert figure == pytest.approx(found.figure)
    absent = 0.25 * 3600.0 if by_s is None else 0.0
    assert figure == pytest.approx(2.0 * (0.75 * value + absent))
