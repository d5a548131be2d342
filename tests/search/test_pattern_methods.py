"""Tuned patterns: better than by the book, over the streets that are driven, home in time."""

import dataclasses

import numpy as np
import pytest

from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.errors import NotApplicableError
from planner.flight.plan import Plan
from planner.flight.uav import Uav
from planner.futures.edges_driven import EdgesDriven
from planner.futures.futures import Futures
from planner.search.methods import METHODS, method_named
from planner.search.plan import plan_of_waypoints
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult
from planner.search.stop import WorkDone
from planner.search.street_patterns import Streets, cut_to
from planner.search.tuning import TRIES, TRY, Layout, Tuner, Whereabouts
from planner.search.waypoint_rewards import WaypointRewards
from support.instances import by_two_letters, physics_futures
from support.search_instances import random_problem

PATTERNS = [method.name for method in METHODS if method.is_pattern]
AREAS = ("spiral", "expanding-square", "sector", "lawnmower")  # laid out, not along streets


def town(*, by_s: float | None = None, particles: int = 60) -> Problem:
    """Two streets that cross, 1 km each way; targets leave the middle, most of them eastwards."""
    arms = {"E": (1e3, 0.0), "N": (0.0, 1e3), "W": (-1e3, 0.0), "S": (0.0, -1e3)}
    network = by_two_letters({"M": (0.0, 0.0), **arms}, "ME EM MN NM MW WM MS SM")
    routes = [["ME"], ["ME"], ["ME", "EM", "MW"], ["MN"], ["MW"], ["MS"]]
    routes = [routes[k % 6] for k in range(particles)]
    futures = physics_futures(network, routes, 0.0, np.linspace(3, 9, particles))
    uav = Uav(-600.0, 900.0, 60.0, 25.0)
    return Problem(network, futures, uav, Sensor(60.0), Objective(600.0, by_s))


def searched(problem: Problem, name: str, *, seed: int = 3, tries: int = TRIES) -> SearchResult:
    budget = Budget(work=TRY * tries)
    return method_named(name).load()(problem, budget=budget, rng=np.random.default_rng(seed))


def figure(problem: Problem, plan: Plan) -> float:
    return evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective).figure


@pytest.mark.parametrize("name", AREAS)
def test_tuning_beats_what_the_book_says(name: str) -> None:
    problem = town()
    by_the_book = figure(problem, searched(problem, name, tries=1).plan)
    tuned = searched(problem, name)
    assert figure(problem, tuned.plan) < 0.9 * by_the_book
    assert tuned.work == TRY * TRIES
    assert tuned.trace[0].value == pytest.approx(by_the_book)


@pytest.mark.parametrize("name", PATTERNS)
@pytest.mark.parametrize("by_s", [None, 300.0])
def test_the_trace_ends_at_what_the_plan_is_worth(name: str, by_s: float | None) -> None:
    problem = town(by_s=by_s)
    made = searched(problem, name, tries=20)
    assert made.trace[-1].value == pytest.approx(figure(problem, made.plan))
    values = [point.value for point in made.trace]
    assert values == sorted(values, reverse=by_s is None)


@pytest.mark.parametrize("name", PATTERNS)
@pytest.mark.parametrize("home", [None, (-600.0, 900.0), (2e3, 0.0)])
def test_every_pattern_lands_in_time(name: str, home: tuple[float, float] | None) -> None:
    uav = Uav(-600.0, 900.0, 60.0, 25.0, max_flight_time_s=240.0, return_to_m=home)
    (track,) = searched(town().replace(uav=uav), name, tries=20).plan.tracks
    assert track.end_s <= 300.0 + 1e-6
    if home is not None:
        assert (track.x_m[-1], track.y_m[-1]) == pytest.approx(home)


@pytest.mark.parametrize("name", PATTERNS)
def test_whoever_takes_off_when_all_is_over_still_has_a_plan(name: str) -> None:
    problem = town()
    late = problem.replace(uav=dataclasses.replace(problem.uav, take_off_s=700.0))
    assert figure(late, searched(late, name, tries=5).plan) == 600.0


@pytest.mark.parametrize("name", PATTERNS)
def test_targets_that_never_set_out_or_were_seen_are_no_ones(name: str) -> None:
    problem = town()
    nobody = problem.replace(futures=Futures([], [], [], [0, 0], [1.0], [False]))
    if name != "best-crossing":  # it hovers anywhere
        with pytest.raises(NotApplicableError, match="ever sets out"):
            searched(nobody, name)
    seen = problem.first_state.absorb(np.zeros(len(problem.futures)))
    assert searched(problem.replace(start=seen), name, tries=3).plan.method == name


@pytest.mark.parametrize("name", PATTERNS)
def test_it_stops_when_asked_after_one_try(name: str) -> None:
    budget = Budget(stop=WorkDone(0))
    made = method_named(name).load()(town(), budget=budget, rng=np.random.default_rng(0))
    assert made.work == TRY
    assert made.stopped


@pytest.mark.parametrize("seed", range(24))
def test_rewards_are_those_of_the_plan(seed: int) -> None:
    """The twin is the evaluation of the whole plan, knot by knot."""
    rng = np.random.default_rng([8, seed])
    problem = random_problem(seed, by_s=None if seed % 2 else 900.0)
    problem = problem.replace(sensor=Sensor(problem.sensor.radius_m))
    home = (3e3, 1e3) if seed % 3 else None
    longest_s = np.inf if seed % 4 == 0 else 700.0
    uav = dataclasses.replace(problem.uav, return_to_m=home, max_flight_time_s=longest_s)
    problem = problem.replace(uav=uav)
    rewards = WaypointRewards(problem)
    for many in (1, 2, 9, 30):
        waypoints = rng.uniform(-2e3, 12e3, (many, 3))
        waypoints[:, 2] = np.maximum(0.0, rng.uniform(-60, 60, many))
        waypoints[-1, 2] = problem.horizon_s
        plan = plan_of_waypoints(problem, "", waypoints)
        seen = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective).seen_at
        reward = float(problem.futures.weight @ problem.objective.reward(seen))
        assert rewards.of(waypoints) == pytest.approx(reward, abs=1e-6)


def test_rewards_of_one_problem_are_not_those_of_another_on_the_same_futures() -> None:
    near = town()
    later = near.replace(uav=dataclasses.replace(near.uav, take_off_s=200.0))
    waypoints = np.array([[0.0, 0.0, 50.0], [500.0, 0.0, 600.0]])
    for problem in (near, later, near.replace(sensor=Sensor(200.0)), near):
        plan = plan_of_waypoints(problem, "", waypoints)
        expected = problem.objective.value(WaypointRewards(problem).of(waypoints))
        assert figure(problem, plan) == pytest.approx(expected)


def test_whoever_need_not_land_by_any_time_flies_on_though_there_is_a_home() -> None:
    uav = dataclasses.replace(town().uav, return_to_m=(0.0, 0.0))
    plan = plan_of_waypoints(town().replace(uav=uav), "", np.array([[-600.0, 400.0, 60.0]]))
    assert plan.tracks[0].time_s.tolist()[:3] == [60.0, 80.0, 140.0]


def test_hovering_is_over_where_most_set_out() -> None:
    net = town().network
    routes = [["ME"]] * 6 + [["MW"]] * 4
    starts_m = [500.0] * 6 + [700.0] * 4
    futures = physics_futures(net, routes, starts_m, 5.0, stop_m=starts_m)
    plan = searched(town().replace(futures=futures), "hover").plan
    assert (plan.tracks[0].x_m[-1], plan.tracks[0].y_m[-1]) == (500.0, 0.0)


def test_the_best_crossing_is_where_most_come_by() -> None:
    # Nobody ends in the middle, yet those from the west and from the south pass it.
    net = town().network
    routes = [["WM", "ME"]] * 3 + [["SM", "MN"]] * 3 + [["EM"]] * 2
    futures = physics_futures(net, routes, 0.0, 4.0)
    problem = town().replace(futures=futures)
    track = searched(problem, "best-crossing").plan.tracks[0]
    assert (track.x_m[-1], track.y_m[-1]) == (0.0, 0.0)
    assert track.end_s == 600.0


def test_traffic_counts_who_is_on_a_street_after_take_off_in_either_direction() -> None:
    net = town().network
    routes = [["ME"], ["ME", "EM", "MW"], ["MS"], ["WM"]]
    # At take-off, second 60, the one from the west has arrived and is gone.
    speeds = [10.0, 10.0, 10.0, 20.0]
    futures = physics_futures(net, routes, 0.0, speeds, gone=True, weight=[0.1, 0.2, 0.3, 0.4])
    streets = Streets(town().replace(futures=futures))
    traffic = dict(zip(net.road_ids, streets.traffic[::2].tolist(), strict=True))
    expected = {"ME": 0.3, "EM": 0.3, "MN": 0, "NM": 0, "MW": 0.2, "WM": 0.2, "MS": 0.3, "SM": 0.3}
    assert traffic == pytest.approx(expected)
    assert net.node_ids[streets.busiest_nodes[0]] == "M"
    assert streets.traffic_at == pytest.approx([0.8, 0.3, 0.0, 0.2, 0.3])


def test_main_streets_are_flown_out_and_back_the_busiest_first() -> None:
    problem = town()
    streets, (middle, east) = Streets(problem), (0, 1)
    ends = [int(problem.legs.to_node[leg]) for leg in streets.leaving(middle)]
    assert ends[0] == east
    assert len(ends) == 4  # one leg to each neighbour, though two roads lead there
    first = streets.leaving(middle)[0]
    assert streets.out_and_back(middle, first, 5e3).tolist() == [[0, 0], [1000, 0], [0, 0]]
    assert streets.out_and_back(middle, first, 300.0).tolist() == [[0, 0], [300, 0], [0, 0]]
    # From the east it goes on beyond the middle, to where most drive: not north or south.
    (back,) = streets.leaving(east)
    way = streets.out_and_back(east, back, 1500.0)
    assert way.tolist() == [[1000, 0], [0, 0], [-500, 0], [0, 0], [1000, 0]]
    plan = searched(problem, "main-streets").plan
    assert set(np.abs(plan.tracks[0].x_m[2:]) * np.abs(plan.tracks[0].y_m[2:])) == {0.0}


def test_main_streets_need_to_know_who_drives_where() -> None:
    futures = town().futures
    unknown = dataclasses.replace(futures, edges=EdgesDriven.unknown(len(futures)))
    with pytest.raises(NotApplicableError, match="nothing is known of the roads"):
        searched(town().replace(futures=unknown), "main-streets")


def test_a_way_is_cut_within_a_road() -> None:
    way = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 50.0]])
    assert cut_to(way, 120.0).tolist() == [[0, 0], [100, 0], [100, 20]]
    assert cut_to(way, 100.0).tolist() == [[0, 0], [100, 0]]
    assert cut_to(way, 150.0).tolist() == cut_to(way, 1e9).tolist() == way.tolist()


def test_where_a_pattern_may_lie() -> None:
    rng = np.random.default_rng(2)
    where = Whereabouts.of(town(), rng)
    assert where.last_seen == (0.0, 0.0)
    assert 600.0 < where.far_m <= 1000.0
    book = where.by_the_book
    assert (book.centre, book.spacing_m, book.course_deg) == ((0.0, 0.0), 120.0, 0.0)
    for _ in range(200):
        layout = where.flyable(where.drawn(rng))
        assert max(map(abs, layout.centre)) <= 1000.0
        assert layout.extent_m / 40.0 <= layout.spacing_m <= layout.extent_m
        assert layout.extent_m <= 1.5 * where.far_m


def test_steps_from_the_best_get_shorter() -> None:
    best = Layout((0.0, 0.0), 100.0, 1000.0, 90.0)
    away = [
        np.mean([np.hypot(*best.near(np.random.default_rng(k), step).centre) for k in range(50)])
        for step in (1.0, 0.5, 0.1)
    ]
    assert away[0] > away[1] > away[2] > 0.0
    tuner = Tuner(town(), Budget(work=TRY * 4), "spiral")
    steps = []
    while tuner.goes_on:
        steps.append(tuner.step)
        tuner.is_better(np.zeros((1, 2)))
    assert steps == [2.0, 1.5, 1.0, 0.5]
