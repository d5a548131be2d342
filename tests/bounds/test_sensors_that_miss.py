"""Bounds for sensors that may miss: longest contacts, prefixes, enumerations and random plans."""

import gc
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from planner.arrays import Floats
from planner.bounds.branch_and_bound import Search
from planner.bounds.certificate import FALLS, Effort, _floors, certified, proven_bound
from planner.bounds.fleet_prices import FleetTable, fitting_bin_s
from planner.bounds.flights import Flights
from planner.bounds.kernels.hops import Bins, blank, listed, sweep
from planner.bounds.kernels.prices import SightingColumns, by_bin
from planner.bounds.movements import Movements
from planner.bounds.particle_prices import Table, table_of
from planner.bounds.sighting_table import _OfHop
from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor, rate_of
from planner.detection.survival import Searched, contacts, survival
from planner.errors import NotApplicableError
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.flight.uav import Uav
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from planner.search.stop import WorkDone
from support.cases import some_in_the_gate
from support.instances import figure3, physics_futures
from support.search_instances import orders, random_problem


def missing(problem: Problem, detects: float) -> Problem:
    """The same problem with a sensor that sees a resting target in one pass so probably."""
    sensor = problem.sensor
    rate = rate_of(detects, sensor.radius_m, problem.uav.speed_mps)
    return problem.replace(sensor=replace(sensor, rate_per_s=rate))


def random_case(seed: int, *, particles: int = 20) -> Problem:
    rng = np.random.default_rng(seed)
    by_s = 700.0 if seed % 5 == 0 else None
    problem = random_problem(seed, particles=particles).replace(objective=Objective(1000.0, by_s))
    return missing(problem, float(rng.uniform(0.2, 0.99)))


def hop_track(movements: Movements, hop: int, start_s: float) -> Track:
    hops = movements.hops
    points = slice(hops.first_point[hop], hops.first_point[hop + 1])
    time_s = start_s + hops.after_s[points]
    on = np.array([(time_s[0], time_s[-1])])
    return Track(time_s, hops.x_m[points], hops.y_m[points], on)


def in_reach_s(problem: Problem, track: Track) -> Floats:
    """For how long a flight has each particle in reach, (N,) seconds."""
    first, from_s, to_s = contacts(problem.futures, track, problem.sensor.radius_m)
    return np.array([(to_s - from_s)[a:b].sum() for a, b in pairwise(first)])


@pytest.mark.parametrize("seed", range(12))
def test_no_contact_is_longer(seed: int) -> None:
    """Than a bin says of all starts in it; and some are nearly as long."""
    problem, rng = random_problem(seed, particles=20), np.random.default_rng(seed)
    movements, radius_m, ratios = Movements(problem), problem.sensor.radius_m, []
    bins, many = Bins(float(rng.uniform(0.0, 300.0)), float(rng.choice([1.0, 5.0, 30.0])), 12), 20
    for hop in rng.choice(len(movements.hops), 3, replace=False).tolist():
        sight = blank(bins.total, many, lasting=True)
        sweep(movements.hops.motion(hop), movements.pieces, bins, radius_m, sight)
        seen = listed(sight, np.inf, np.zeros((bins.total, many), dtype=bool))
        most_s = np.zeros((bins.total, many))
        most_s[np.repeat(np.arange(bins.total), seen.counts), seen.particle] = seen.lasts_s
        assert not np.any(sight.reached.total_s)  # and all is clear for the next hop
        for i in rng.choice(bins.total, 4, replace=False).tolist():
            starts_s = bins.first_s + (i + np.linspace(-0.5, 0.5, 21)) * bins.step_s
            tracks = [hop_track(movements, hop, start_s) for start_s in starts_s]
            longest_s = np.max([in_reach_s(problem, track) for track in tracks], axis=0)
            assert np.all(longest_s <= most_s[i] + 1e-6)
            ratios += (longest_s[longest_s > 0.1] / most_s[i][longest_s > 0.1]).tolist()
    assert len(ratios) < 8 or np.mean(ratios) > 0.6


@pytest.mark.parametrize("seed", range(8))
def test_prefixes_do_what_their_flights_do(seed: int) -> None:
    problem, rng = random_case(seed), np.random.default_rng(seed)
    flights, movements = Flights(Movements(problem)), Movements(problem)
    _, place = next(flights.begin())
    begun, searched = place, list[Searched]()
    for _ in range(4):
        onward = list(flights.onward(place))
        hop, there = onward[int(rng.integers(len(onward)))]
        if problem.sensor.detects_in_transit or hop < movements.hops.legs:
            track = hop_track(movements, hop, place.time_s)
            searched.append(Searched(track, problem.sensor))
        place = there
    unseen = survival(problem.futures, searched)
    assert place.missed == pytest.approx(begun.missed * unseen.at(place.time_s), abs=1e-9)
    tracks = [one.track for one in searched]
    reward = evaluate(tracks, problem.futures, problem.sensor, problem.objective).reward
    more = begun.reward + begun.missed * reward
    assert place.reward == pytest.approx(more, abs=1e-6)


def rewards_of(problem: Problem, tracks: Sequence[Track]) -> Floats:
    return evaluate(tracks, problem.futures, problem.sensor, problem.objective).reward


@pytest.mark.parametrize("seed", some_in_the_gate(60, 15))
def test_no_plan_is_worth_more(seed: int) -> None:
    """Whatever the prices, and after branching."""
    problem, rng = random_case(seed), np.random.default_rng(seed)
    weight, legs = problem.futures.weight, len(problem.legs)
    plans = [plan_of_legs(problem, "", rng.integers(legs, size=12).tolist()) for _ in range(30)]
    rewards = [rewards_of(problem, plan.tracks) for plan in plans]
    best = max(rewards, key=lambda reward: weight @ reward)
    value, movements = float(weight @ best), Movements(problem)
    table = table_of(movements, movements.fitting_bin_s)
    for prices in (0.0 * best, best, rng.uniform(0.0, problem.objective.most, len(best))):
        assert table.bound(prices).reward >= value - 1e-9 * problem.objective.most
    search = Search(movements, table, 0.8 * value, lambda _: False)
    search.begin(best, 10)
    for _ in range(5):
        if not search.done:
            search.split(3)
    assert search.bound >= value - 1e-9 * problem.objective.most


@pytest.mark.parametrize("seed", range(6))
def test_counts_are_a_slope(seed: int) -> None:
    problem, rng = random_case(seed), np.random.default_rng(seed)
    movements, most = Movements(problem), problem.objective.most
    table = table_of(movements, movements.fitting_bin_s)
    for _ in range(5):
        here, there = rng.uniform(0.3 * most, most, (2, len(problem.futures)))
        bound, counts = table.bound(here)
        change = (table.weight * (1.0 - counts)) @ (there - here)
        assert table.bound(there).reward >= bound + change - 1e-6 * most


def on_figure3(detects: float) -> Problem:
    speeds_mps = np.random.default_rng(1).uniform(8, 40, 12)
    paths = [["AB", "BC", "CE"], ["AB", "BC", "CF"], ["AB", "BD", "DF"], ["AB", "BD", "DG"]]
    futures = physics_futures(figure3(), paths * 3, 0.0, speeds_mps, horizon_s=500.0)
    uav = Uav(x_m=-3_000.0, y_m=0.0, take_off_s=60.0, speed_mps=100.0)
    problem = Problem(figure3(), futures, uav, Sensor(300.0), Objective(400.0))
    return missing(problem, detects)


@pytest.mark.parametrize("detects", [0.7, 0.95])
def test_the_bound_meets_the_best_of_all_orders(detects: float) -> None:
    """On figure 3, where each order is flown; the rest are flights that leave the roads."""
    problem = on_figure3(detects)
    weight = problem.futures.weight
    tracks = [plan_of_legs(problem, "", order).tracks for order in orders(problem, [])]
    optimum = max(float(weight @ rewards_of(problem, one)) for one in tracks)
    best = max(tracks, key=lambda one: float(weight @ rewards_of(problem, one)))
    movements = Movements(problem)
    table = table_of(movements, movements.fitting_bin_s)
    search = Search(movements, table, optimum, lambda _: False)
    search.begin(rewards_of(problem, best), 30)
    for _ in range(300):
        if not search.done:
            search.split(6)
    assert optimum - 1e-9 * problem.horizon_s <= search.bound <= 1.03 * optimum


def unseen_by(problem: Problem, plan: Plan) -> Floats:
    """How probably a plan leaves each particle unseen at each of many times, in one row."""
    unseen = survival(problem.futures, [Searched(plan.tracks[0], problem.sensor)])
    return np.array([unseen.at(time_s) for time_s in np.arange(60.0, 400.0, 2.0)]).ravel()


@pytest.mark.parametrize("detects", [0.7, 0.95])
def test_no_pair_of_orders_is_better_than_the_bound(detects: float) -> None:
    """Two UAVs that start apart; the exposures of both add up."""
    first = on_figure3(detects)
    other = replace(first.uav, x_m=16_000.0, speed_mps=80.0, altitude_m=15.0)
    both, second = first.replace(others=(other,)), first.replace(uav=other)
    ways = [[plan_of_legs(one, "", order) for order in orders(one, [])] for one in (first, second)]
    unseen = [np.array([unseen_by(first, plan) for plan in plans]) for plans in ways]
    best = int(np.argmin(unseen[0] @ unseen[1].T))  # of all pairs, the least time unseen
    one, two = ways[0][best // len(ways[1])], ways[1][best % len(ways[1])]
    pair = Plan("two", one.tracks + two.tracks, one.legs + two.legs)
    value = evaluate(pair.tracks, first.futures, first.sensor, first.objective).figure
    certificate = certified(both, pair, Effort())
    assert certificate.value == pytest.approx(value)
    assert 0.8 * value <= certificate.bound <= value + 1e-6


@pytest.mark.parametrize("seed", some_in_the_gate(40, 8))
def test_no_random_fleet_is_worth_more(seed: int) -> None:
    """Than any prices allow, of UAVs with random starts, speeds and sensors."""
    first, rng = random_case(seed, particles=12), np.random.default_rng(seed)
    others = tuple(
        replace(
            first.uav,
            x_m=float(rng.uniform(-8e3, 8e3)),
            take_off_s=float(rng.uniform(0, 300)),
            speed_mps=float(rng.choice([60.0, 100.0])),
            altitude_m=50.0 * (number + 1),
        )
        for number in range(int(rng.integers(1, 4)))
    )
    both = first.replace(others=others)
    legs, fleet = len(first.legs), FleetTable.of(both, fitting_bin_s(both))
    weight, most = first.futures.weight, first.objective.most
    for _ in range(10):
        tracks = [
            plan_of_legs(first.replace(uav=uav), "", rng.integers(legs, size=8).tolist()).tracks[0]
            for uav in (first.uav, *others)
        ]
        earned = rewards_of(first, tracks)
        for prices in (earned, rng.uniform(0.0, most, len(weight))):
            assert fleet.bound(prices).reward >= weight @ earned - 1e-9 * most


@pytest.mark.parametrize("detects", [0.7, 0.95, 1.0])
def test_where_a_whole_table_is_too_large_the_best_of_all_orders_is_within_the_bound(
    detects: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whose table leaves out what earns too little, and whose prices prove it all the same."""
    problem = on_figure3(detects)
    movements = Movements(problem)
    whole = table_of(movements, movements.fitting_bin_s)
    plans = [plan_of_legs(problem, "", order) for order in orders(problem, [])]
    least_s, best = min(
        (evaluate(one.tracks, problem.futures, problem.sensor, problem.objective).figure, k)
        for k, one in enumerate(plans)
    )
    monkeypatch.setattr("planner.bounds.sighting_table.MOST_SIGHTINGS", 3 * whole.size // 4)
    certificate = certified(problem, plans[best], Effort(stop=WorkDone(400)))
    assert len(certificate.proof) > 1
    assert certificate.rate_per_s == problem.sensor.rate_per_s
    assert 0.8 * least_s <= certificate.bound <= least_s + 1e-6
    assert proven_bound(problem, certificate) == pytest.approx(certificate.bound)


@pytest.mark.parametrize("present", [1.0, 0.5])
def test_floors_are_below_what_a_plan_earns_with_those_who_are_there(present: float) -> None:
    earned = np.array([300.0, 200.0, 350.0, 350.0])
    none, *higher = _floors(Objective(400.0), earned, np.full(4, present / 4), 350.0)
    assert not none.any()
    for fall, floor in zip(FALLS, higher, strict=True):
        np.testing.assert_allclose(floor, earned - fall * 50.0)


@pytest.mark.parametrize("detects", [0.7, 1.0])
def test_sightings_by_hop_are_let_go_before_they_are_sorted(
    detects: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    alive = list[bool]()

    def watched(columns: SightingColumns, hops: int) -> SightingColumns:
        alive.append(any(type(one) is _OfHop for one in gc.get_objects()))
        return by_bin(columns, hops)

    monkeypatch.setattr("planner.bounds.sighting_table.by_bin", watched)
    movements = Movements(on_figure3(detects))
    table_of(movements, movements.fitting_bin_s)
    assert alive == [False]


def test_where_its_own_table_is_too_large_the_bound_is_that_of_a_perfect_sensor(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def of_a_perfect_one(
        movements: Movements, bin_s: float, floors: Sequence[Floats] | None = None
    ) -> Table:
        if not movements.problem.sensor.is_perfect:
            raise NotApplicableError("too many sightings")
        return table_of(movements, bin_s, floors)

    monkeypatch.setattr("planner.bounds.certificate.table_of", of_a_perfect_one)
    problem = on_figure3(0.7)
    plans = [plan_of_legs(problem, "", order) for order in orders(problem, [])]
    perfect = problem.sensor.without_misses
    least_s, best = min(
        (evaluate(one.tracks, problem.futures, perfect, problem.objective).figure, k)
        for k, one in enumerate(plans)
    )
    certificate = certified(problem, plans[best], Effort())
    assert np.isinf(certificate.rate_per_s)
    assert 0.8 * least_s <= certificate.bound <= least_s + 1e-6 < certificate.value
