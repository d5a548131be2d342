"""Both objectives and the way home, in every method's own arithmetic, against slow twins."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.search.exact import best_order, enumerate_orders
from planner.search.greedy import GreedyOptions, greedy
from planner.search.plan import plan_of_legs, plan_of_wait
from planner.search.problem import Budget, Problem, candidate_legs
from planner.search.wait import wait
from support.grid_instance import grid_futures, grid_problem
from support.instances import network_of_roads
from support.search_instances import flown, random_problem

RNG = np.random.default_rng(0)


def found_by(problem: Problem, order: tuple[int, ...]) -> float:
    tracks = plan_of_legs(problem, "", order).tracks
    result = evaluate(tracks, problem.futures, problem.sensor, problem.objective)
    assert problem.objective.by_s is not None
    return result.found_by_probability(problem.objective.by_s)


def expected_s(problem: Problem, order: tuple[int, ...]) -> float:
    tracks = plan_of_legs(problem, "", order).tracks
    result = evaluate(tracks, problem.futures, problem.sensor, problem.objective)
    return result.expected_detection_time_s


def small(seed: int, *, by_s: float | None = None, home: bool = False) -> Problem:
    """Four roads of a random problem, a flight that is too short for all of them."""
    problem = random_problem(4 * seed + 1, particles=25)
    rng = np.random.default_rng(seed)
    place = (float(rng.uniform(0, 15000)), float(rng.uniform(-8000, 8000)))
    uav = replace(
        problem.uav,
        max_flight_time_s=float(rng.uniform(300, 700)),
        return_to_m=place if home else None,
    )
    return problem.replace(uav=uav, objective=Objective(problem.horizon_s, by_s))


def test_reward_and_its_figure() -> None:
    seen_at = np.array([10.0, 600.0, 600.1, 2000.0, np.inf])
    time, chance = Objective(1000.0), Objective(1000.0, 600.0)
    assert time.reward(seen_at) == pytest.approx([990, 400, 399.9, 0, 0])
    assert chance.reward(seen_at).tolist() == [1, 1, 0, 0, 0]
    assert (time.ends_s, chance.ends_s) == (1000, 600)
    assert (time.most, chance.most) == (time.reward(np.array([0.0]))[0], 1)
    assert (time.value(990.0), chance.value(0.4)) == (10, 0.4)


def plain_greedy(problem: Problem, depth: int, options: GreedyOptions) -> list[int]:
    """The leg after which most are found by the deadline; or most per second; or then soonest."""
    state, by_s = problem.first_state, problem.objective.by_s
    weight = problem.futures.weight
    assert by_s is not None
    while len(state.order) < depth and state.time_s < by_s:
        scores, times = [], []
        legs = candidate_legs(problem, state, directions=options.direction, removed=state.roads)
        for leg in legs.tolist():
            seen_at = flown(problem, state, leg)
            assert seen_at is not None
            times.append(np.where(np.isinf(state.seen_at), seen_at, state.seen_at))
            newly = weight[(times[-1] <= by_s) & ~(state.seen_at <= by_s)].sum()
            lasts_s = state.after(problem.legs, leg, times[-1]).time_s - state.time_s
            scores.append(newly / lasts_s if options.miss == "rate" else newly)
        if not len(legs):
            break
        alike = 1e-9 if options.miss != "rate" else 1e-13
        best = int(np.argmax(np.array(scores) >= max(scores) - alike))
        state = state.after(problem.legs, int(legs[best]), times[best])
    return list(state.order)


@pytest.mark.parametrize("miss", ["horizon", "rate"])
@pytest.mark.parametrize("seed", range(12))
def test_greedy_by_a_deadline(seed: int, miss: str) -> None:
    problem = random_problem(seed, particles=25, by_s=300.0)
    options = GreedyOptions(direction="both", miss=miss)
    plan = greedy(problem, budget=Budget(4), rng=RNG, options=options).plan
    assert [leg.leg for leg in plan.legs[0]] == plain_greedy(problem, 4, options)


@pytest.mark.parametrize(("by_s", "order"), [(None, [0, 2]), (500.0, [2]), (480.0, [0, 2])])
def test_a_deadline_makes_greedy_choose_otherwise(by_s: float | None, order: list[int]) -> None:
    """0.4 can be seen after 90 s, 0.6 after 490 s, but both only after more than 500 s."""
    places = {"O": (0.0, 0.0), "near": (10000.0, 0.0), "far": (-50000.0, 0.0)}
    network = network_of_roads(places, [("On", "O", "near"), ("Of", "O", "far")])
    futures = Futures([0, 0], [10000, -50000], [0, 0], [0, 1, 2], [0.4, 0.6], [0, 0])
    uav = Uav(0.0, 0.0, 0.0, 100.0)
    problem = Problem(network, futures, uav, Sensor(1000.0), Objective(1000.0, by_s))
    plan = greedy(problem, budget=Budget(2), rng=RNG).plan
    assert [leg.leg for leg in plan.legs[0]] == order


def plain_orders(roads: int, flown_roads: int) -> list[tuple[int, ...]]:
    return [
        tuple(2 * road + way for road, way in zip(order, ways, strict=True))
        for order in itertools.permutations(range(roads), flown_roads)
        for ways in itertools.product((0, 1), repeat=flown_roads)
    ]


@pytest.mark.parametrize("in_transit", [True, False])
@pytest.mark.parametrize("home", [True, False])
@pytest.mark.parametrize("by_s", [None, 250.0, 600.0])
def test_exact_is_the_best_of_all_orders(by_s: float | None, home: bool, in_transit: bool) -> None:
    values = []
    for seed in range(2):
        problem = small(seed, by_s=by_s, home=home)  # the seven roads of Figure 3
        problem = problem.replace(sensor=Sensor(problem.sensor.radius_m, in_transit))
        figure = expected_s if by_s is None else found_by
        order, value = best_order(problem, 2)
        all_values = [
            figure(problem, legs)
            for many in (0, 1, 2)
            for legs in plain_orders(len(problem.network.road_ids), many)
        ]
        best = min(all_values) if by_s is None else max(all_values)
        assert value == pytest.approx(best, abs=2e-6 if by_s is None else 1e-9)
        assert figure(problem, order) == pytest.approx(value, abs=1e-9)
        values.append(np.ptp(all_values))
    assert max(values) > 0.05


@pytest.mark.parametrize("by_s", [None, 400.0])
def test_enumeration_with_the_way_home(by_s: float | None) -> None:
    problem = small(3, by_s=by_s, home=True)
    assert len(problem.network.road_ids) == 7
    result = enumerate_orders(problem)
    figure = expected_s if by_s is None else found_by
    for index in np.random.default_rng(1).integers(len(result), size=30).tolist():
        expected = figure(problem, result.order(index))
        assert result.value[index] == pytest.approx(expected, abs=1e-9)
    _, value = best_order(problem, 7)
    best = result.value.min() if by_s is None else result.value.max()
    assert value == pytest.approx(best, abs=2e-6)


@pytest.mark.parametrize("seed", range(8))
def test_legs_leave_time_for_the_way_home(seed: int) -> None:
    problem = small(seed, home=True)
    uav = problem.uav
    assert uav.return_to_m is not None
    state = problem.first_state
    allowed = set(candidate_legs(problem, state).tolist())
    for leg in range(len(problem.legs)):
        after = state.after(problem.legs, leg, state.seen_at)
        way_m = np.hypot(after.x_m - uav.return_to_m[0], after.y_m - uav.return_to_m[1])
        fits = after.time_s + way_m / uav.speed_mps <= uav.landing_s
        plan = plan_of_legs(problem, "", [leg])
        assert fits == (leg in allowed) == (len(plan.legs[0]) == 1)
        if fits:
            track = plan.tracks[0]
            assert track.end_s == pytest.approx(after.time_s + way_m / uav.speed_mps)
            assert track.xy(track.end_s) == pytest.approx(uav.return_to_m)


def test_the_way_home_counts_if_the_sensor_is_on_in_transit() -> None:
    problem = small(3, home=True)
    order = best_order(problem, 1)[0]
    for on in (True, False):
        track = plan_of_legs(problem.replace(sensor=Sensor(300.0, on)), "", order).tracks[0]
        assert (track.sensor_on[-1, 1] == track.end_s) == on


def waiting(start: tuple[float, float], home: tuple[float, float] | None, flight_s: float) -> Uav:
    return Uav(*start, 10.0, 100.0, max_flight_time_s=flight_s, return_to_m=home)


def test_waiting_ends_in_time_to_come_home() -> None:
    problem = grid_problem(grid_futures(1, RNG))
    uav = waiting((0.0, 0.0), (0.0, 6000.0), 300.0)
    (track,) = plan_of_wait(problem.replace(uav=uav), "wait", 8000.0, 0.0).tracks
    # 80 s out, 100 s home: it can wait for 120 s.
    assert track.time_s == pytest.approx([10, 90, 210, 310])
    assert track.xy(310.0) == pytest.approx((0.0, 6000.0))
    rested = problem.replace(uav=replace(uav, max_flight_time_s=np.inf))
    (track,) = plan_of_wait(rested, "wait", 8000.0, 0.0).tracks
    assert track.time_s == pytest.approx([10, 90, 10000, 10100])


@pytest.mark.parametrize("seed", range(20))
def test_a_wait_too_far_off_turns_in_time(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start, home, place = rng.uniform(-5000, 5000, (3, 2))
    direct_s = float(np.hypot(*(start - home))) / 100.0
    flight_s = direct_s + float(rng.uniform(1.0, 50.0))
    goal = start + 1e5 * (place - start) / np.hypot(*(place - start))
    uav = waiting(tuple(start), tuple(home), flight_s)
    problem = grid_problem(grid_futures(1, RNG)).replace(uav=uav)
    (track,) = plan_of_wait(problem, "wait", *goal).tracks
    assert track.end_s == pytest.approx(uav.landing_s)
    assert track.xy(track.end_s) == pytest.approx(home)
    turn = np.array([track.x_m[1], track.y_m[1]])
    ahead = (turn - start) @ (goal - start)
    assert ahead > 0
    assert np.linalg.norm(turn - start) == pytest.approx(ahead / np.linalg.norm(goal - start))
    way_s = np.hypot(np.diff(track.x_m), np.diff(track.y_m)) / 100.0
    assert np.diff(track.time_s) == pytest.approx(way_s)


def test_a_uav_that_cannot_come_home_stays() -> None:
    uav = waiting((0.0, 0.0), (9000.0, 0.0), 80.0)
    problem = grid_problem(grid_futures(1, RNG)).replace(uav=uav)
    (track,) = plan_of_wait(problem, "wait", -500.0, 0.0).tracks
    assert set(track.time_s) == {10.0}
    assert plan_of_legs(problem, "", [0, 2]).tracks[0].time_s.tolist() == [10.0]


def test_waiting_for_a_deadline_is_where_most_are_then() -> None:
    futures = grid_futures(300, np.random.default_rng(3))
    problem = grid_problem(futures, distance_m=20e3)
    problem = problem.replace(objective=Objective(problem.horizon_s, 1200.0))
    track = wait(problem, budget=Budget(), rng=RNG).plan.tracks[0]
    place = track.xy(1200.0)
    at = np.array([futures.xy(k, 1200.0) for k in range(len(futures))])
    near = [np.sum(np.hypot(*(at - other).T) <= 500.0) for other in at]
    here = np.sum(np.hypot(*(at - place).T) <= 500.0)
    assert here == max(near)
    hurried = problem.replace(
        objective=Objective(problem.horizon_s, 100.0)
    )  # nobody can be reached by then: all count
    assert wait(hurried, budget=Budget(), rng=RNG).plan.tracks[0].end_s >= 100.0
