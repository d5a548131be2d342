"""What every planner owes, whichever it is: put it in the list and it is tested."""

import dataclasses
from functools import cache

import numpy as np
import pytest

from planner.arrays import Floats
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.errors import InputError, NotApplicableError
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.search import contract
from planner.search.contract import BUDGET, CLAUSES, SEED, Case, Clause, cost_s, fingerprint
from planner.search.contract_problems import PROBLEMS
from planner.search.methods import METHODS, Method, method_named
from planner.search.problem import Problem
from planner.search.sightings import holdout_value
from planner.search.stepwise import MOST_FLIGHTS
from support.cases import some_in_the_gate
from support.instances import network_of_roads, physics_futures

OWED = [clause for clause in CLAUSES if not clause.is_advice]
SEARCHING = ("greedy", "random", "exact")  # the others fly what their rule says
PATTERNS = tuple(method.name for method in METHODS if method.is_pattern)
HOVERING = ("wait", "anneal-waypoints", "cells", "hover", "best-crossing")
REVISITING = (
    "anneal-waypoints",
    "cells",
    "rate",
    "lookahead",
    "best",
    "beam",
    "lns",
)  # roads may be flown again, until the horizon


REFUSED = {
    ("exhaustive", "two_way"),
    ("exhaustive-shortest", "two_way"),
    ("anneal-waypoints", "short_flight"),  # the sensor only looks along roads
    ("anneal-waypoints", "by_deadline"),
    *((name, instance) for name in PATTERNS for instance in ("short_flight", "by_deadline")),
    ("cells", "short_flight"),
    ("cells", "by_deadline"),
}
# Where a method is not meant to do well: those that follow no future come too late from far
# away, and waiting needs time and one place where targets end. Patterns are for towns, not for
# a few roads of kilometres; only that along main streets follows these.
NOT_MEANT_FOR = REFUSED | {
    *((name, one) for name in PATTERNS for one in PROBLEMS if name != "main-streets"),
    ("main-streets", "paper_figure3"),
    ("breadth-first", "two_way"),
    *(("wait", name) for name in PROBLEMS if name != "far_grid"),
    ("breadth-first", "by_deadline"),
    ("exhaustive", "by_deadline"),
    ("exhaustive-shortest", "by_deadline"),
    *((name, "far_grid") for name in ("exhaustive", "breadth-first", "exhaustive-shortest")),
}


@cache
def instance(name: str) -> Problem:
    return PROBLEMS[name]()


def planned(method: Method, problem: Problem, seed: int = SEED) -> Plan:
    return method.load()(problem, budget=BUDGET, rng=np.random.default_rng(seed)).plan


@cache
def case(method: Method, name: str) -> Case:
    """A method on a problem: what the tests below ask of its plan changes nothing."""
    return Case(method.load(), PROBLEMS[name])


def plan_on(method: Method, name: str) -> Plan:
    return case(method, name).plan


@cache
def random_s(name: str, roads: int) -> float:
    return contract.random_s(instance(name), roads)


def pairs(without: set[tuple[str, str]]) -> list[object]:
    return [
        pytest.param(method, name, id=f"{method.name}-{name}")
        for method in METHODS
        for name in PROBLEMS
        if (method.name, name) not in without
    ]


every_pair = pytest.mark.parametrize(("method", "name"), pairs(REFUSED))


@pytest.mark.parametrize("clause", OWED, ids=[clause.name for clause in OWED])
@every_pair
def test_the_contract_is_kept(method: Method, name: str, clause: Clause) -> None:
    assert clause.broken(case(method, name)) is None


@every_pair
def test_a_plan_is_called_by_its_method(method: Method, name: str) -> None:
    assert plan_on(method, name).method == method.name


@every_pair
def test_the_budget_is_kept(method: Method, name: str) -> None:
    legs = plan_on(method, name).legs
    roads = [flown.road for flown in legs[0]]
    assert len(legs) == 1
    assert method.name in REVISITING or len(roads) == len(set(roads))
    assert len(roads) <= (BUDGET.roads if method.name in SEARCHING else 100)


@every_pair
def test_tracks_obey_the_uav(method: Method, name: str) -> None:
    problem = instance(name)
    uav, plan = problem.uav, plan_on(method, name)
    (track,) = plan.tracks
    assert (track.time_s[0], track.x_m[0], track.y_m[0]) == (uav.take_off_s, uav.x_m, uav.y_m)
    assert track.end_s <= uav.landing_s + 1e-9
    if uav.return_to_m is not None:
        assert (track.x_m[-1], track.y_m[-1]) == pytest.approx(uav.return_to_m)
    metres = np.hypot(np.diff(track.x_m), np.diff(track.y_m))
    seconds = np.diff(track.time_s)
    flies = metres > 0
    assert metres[flies] == pytest.approx(uav.speed_mps * seconds[flies], rel=1e-9)
    assert method.name in HOVERING or np.all(flies | (seconds == 0))
    assert_sensor_on(problem, plan, track)


def home_s(uav: Uav, place: Floats) -> float:
    """Seconds of flight from a place to the landing."""
    home = place if uav.return_to_m is None else uav.return_to_m
    return float(np.linalg.norm(np.subtract(home, place))) / uav.speed_mps


def assert_sensor_on(problem: Problem, plan: Plan, track: Track) -> None:
    on = track.sensor_on.ravel()
    assert np.all(np.diff(on) >= 0)
    if problem.sensor.detects_in_transit:
        assert on.tolist() == [track.time_s[0], track.end_s]
        return
    inside = [flown.start_s <= t <= flown.end_s for flown in plan.legs[0] for t in on]
    assert not plan.legs[0] or sum(inside) >= len(on)
    on_road_s = sum(flown.end_s - flown.start_s for flown in plan.legs[0])
    if plan.legs[0]:
        assert np.sum(on[1::2] - on[::2]) == pytest.approx(on_road_s)


@pytest.mark.parametrize(
    ("method", "name"), pairs(NOT_MEANT_FOR | {("random", name) for name in PROBLEMS})
)
def test_better_than_random(method: Method, name: str) -> None:
    problem = instance(name)
    plan = plan_on(method, name)
    roads = len(plan.legs[0]) or len(problem.network.road_ids)
    assert cost_s(problem, plan) < random_s(name, roads) - 1.0


@pytest.mark.parametrize("name", PROBLEMS)
def test_nothing_within_the_budget_beats_exact(name: str) -> None:
    problem = instance(name)
    best_s = cost_s(problem, plan_on(method_named("exact"), name))
    for method, seed in [("greedy", 0), *(("random", seed) for seed in range(60))]:
        assert best_s <= cost_s(problem, planned(method_named(method), problem, seed)) + 1e-6


@pytest.mark.parametrize(("method", "name"), sorted(REFUSED))
def test_a_method_that_does_not_apply_says_why(method: str, name: str) -> None:
    with pytest.raises(NotApplicableError, match=r"cycle|detects_in_transit"):
        planned(method_named(method), instance(name))


def test_chance_comes_from_the_stream() -> None:
    plans = [planned(method_named("random"), instance("far_grid"), seed) for seed in range(5)]
    assert len({fingerprint(plan) for plan in plans}) == 5


def test_an_unknown_method_lists_those_there_are() -> None:
    names = [method.name for method in METHODS]
    assert len(set(names)) == len(names)
    with pytest.raises(InputError, match="'gredy' is unknown; choose one of best, beam,"):
        method_named("gredy")
    assert all(method_named(name).name == name for name in names)


@every_pair
def test_every_planner_goes_on_from_where_the_search_stands(method: Method, name: str) -> None:
    problem = instance(name)
    on_its_way = dataclasses.replace(problem.first_state, time_s=200.0, x_m=1e3, y_m=-2e3)
    seen_at = np.full(len(problem.futures), np.inf)
    seen_at[::2] = 150.0
    problem = problem.replace(start=on_its_way.absorb(seen_at))
    plan = planned(method, problem)
    track = plan.tracks[0]
    assert (track.time_s[0], track.x_m[0], track.y_m[0]) == (200.0, 1e3, -2e3)
    assert track.end_s <= problem.uav.landing_s + 1e-6
    (first,) = plan.legs[0][:1] or (None,)
    assert first is None or first.depart_s == 200.0


def odd_net(number: int) -> Problem:
    """A small random net of metres or kilometres, some roads loops or far off, with a holdout."""
    rng = np.random.default_rng([39, number])
    scale = float(10.0 ** rng.uniform(-2.5, 0.3))
    places = {f"n{i}": tuple(scale * rng.uniform(0, 9000, 2)) for i in range(5)}
    places["far"], places["off"] = (scale * 60e3, 0.0), (scale * 61e3, 900.0 * scale)
    ends = [rng.choice(5, 2, replace=number % 3 == 0) for _ in range(int(rng.integers(3, 12)))]
    roads = [(f"e{k}", f"n{a}", f"n{b}") for k, (a, b) in enumerate(ends) if a != b]
    network = network_of_roads(places, [*roads, ("apart", "far", "off")])

    def targets(count: int) -> Futures:
        routes = [[str(road)] for road in rng.choice(network.road_ids, count)]
        speeds = scale * rng.uniform(2, 30, count)
        return physics_futures(network, routes, 0.0, speeds, gone=bool(number % 2))

    uav = Uav(-300.0 * scale, 0.0, 0.0, float(rng.uniform(20, 120)) * scale ** float(number % 2))
    futures, holdout = targets(40), targets(40) if number % 4 else None
    return Problem(network, futures, uav, Sensor(60.0 * scale), Objective(900.0), holdout=holdout)


@pytest.mark.parametrize("number", some_in_the_gate(24, 12))
@pytest.mark.parametrize("name", ["best", "beam"])
def test_a_choice_is_never_worse_than_the_simplest_rules(name: str, number: int) -> None:
    problem = odd_net(number)
    values = {
        method: holdout_value(problem, planned(method_named(method), problem))
        for method in (name, "rate", "random")
    }
    assert values[name] >= max(values.values()) - 1e-9


@pytest.mark.parametrize("most", [20_000, pytest.param(MOST_FLIGHTS, marks=pytest.mark.long)])
def test_work_bounds_a_search_over_roads_flown_in_no_time(
    most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("planner.search.stepwise.MOST_FLIGHTS", most)
    tiny = odd_net(0).replace(uav=Uav(0.0, 0.0, 0.0, 1e5))
    made = method_named("beam").load()(tiny, budget=BUDGET, rng=np.random.default_rng(1))
    assert made.work is not None
    assert made.work <= 2 * BUDGET.work
    (legs,) = made.plan.legs
    assert len(legs) * 2 * len(tiny.network.road_ids) <= 3 * most
