"""Orders that fly every road: the paper's example, what it warns of, and its theorem."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.detection.first_detection import first_detection
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.errors import NotApplicableError
from planner.flight.plan import Plan
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork
from planner.network.topology import sources
from planner.search.exhaustive import breadth_first, exhaustive
from planner.search.exhaustive_shortest import exhaustive_shortest, shortest_order
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from support.instances import (
    by_two_letters,
    figure1,
    figure3,
    grid,
    network_of_roads,
    physics_futures,
)

LETTERS = "ABCDEFGHIJ"
PLANNERS = [exhaustive, exhaustive_shortest]


def problem_on(
    network: RoadNetwork, futures: Futures | None = None, *, take_off_s: float = 0.0
) -> Problem:
    nobody = physics_futures(network, [], 0.0, 1.0)
    uav = Uav(x_m=-3000.0, y_m=1000.0, take_off_s=take_off_s, speed_mps=100.0)
    return Problem(network, futures or nobody, uav, Sensor(5.0), Objective(1e9))


def planned(planner: object, problem: Problem) -> Plan:
    assert callable(planner)
    plan: Plan = planner(problem, budget=Budget(roads=2), rng=np.random.default_rng(1)).plan
    return plan


def names(problem: Problem, order: list[int]) -> list[str]:
    """Legs by their two letters, turned round where flown against the road."""
    ids = problem.network.road_ids
    return [ids[leg // 2][:: -1 if leg % 2 else 1] for leg in order]


def legs(plan: Plan) -> list[int]:
    return [flown.leg for flown in plan.legs[0]]


def extra(
    problem: Problem, order: list[int], *, start: tuple[float, float] = (-3000.0, 1000.0)
) -> tuple[float, int]:
    """Seconds flown beside roads, and movements between roads, by plain walking."""
    place, seconds, movements = np.array(start), 0.0, 0
    for k, leg in enumerate(order):
        shape = problem.network.shape(leg // 2)[:: -1 if leg % 2 else 1]
        hop = float(np.linalg.norm(shape[0] - place))
        seconds += hop / 100.0
        movements += k > 0 and hop > 0
        place = shape[-1]
    return seconds, movements


def keeps_precedence(network: RoadNetwork, order: list[int]) -> bool:
    roads = [leg // 2 for leg in order]
    when = {road: k for k, road in enumerate(roads)}
    return sorted(roads) == list(range(len(network.road_ids))) and all(
        when[before] < when[road]
        for road, start in enumerate(network.road_from)
        for before in np.flatnonzero(network.road_to == start)
    )


def random_dag(rng: np.random.Generator, *, most_roads: int) -> RoadNetwork:
    """Nodes in a random order, roads only onward in it, no node without a road."""
    nodes = int(rng.integers(3, 8))
    pairs = [(a, b) for a in range(nodes) for b in range(a + 1, nodes)]
    count = int(rng.integers(2, min(len(pairs), most_roads) + 1))
    chosen = [pairs[i] for i in rng.permutation(len(pairs))[:count]]
    used = sorted({node for pair in chosen for node in pair})
    place = {LETTERS[n]: tuple(rng.uniform(0.0, 20e3, 2)) for n in rng.permutation(used)}
    roads = [(LETTERS[a] + LETTERS[b], LETTERS[a], LETTERS[b]) for a, b in chosen]
    return network_of_roads(place, roads)


lattice_dags = st.lists(
    st.tuples(st.integers(0, 4), st.integers(0, 4)).filter(lambda pair: pair[0] < pair[1]),
    min_size=1,
    max_size=5,
    unique=True,
).flatmap(
    lambda pairs: st.lists(
        st.tuples(st.integers(0, 3), st.integers(0, 2)), min_size=5, max_size=5, unique=True
    ).map(
        lambda spots: by_two_letters(
            {LETTERS[i]: (x * 3000.0, y * 4000.0) for i, (x, y) in enumerate(spots)},
            " ".join(LETTERS[a] + LETTERS[b] for a, b in pairs),
        )
    )
)


class TestAsPrinted:
    def test_order_on_figure1(self) -> None:
        problem = problem_on(figure1())
        plan = planned(exhaustive, problem)
        printed = ["AB", "BC", "BD", "BE", "CD", "CF", "ED", "EF", "DF", "FG"]
        assert names(problem, legs(plan)) == printed
        assert plan.method == "exhaustive"

    def test_several_sources_start_together(self) -> None:
        places = {name: (i * 1000.0, i % 2 * 500.0) for i, name in enumerate("ABCDE")}
        problem = problem_on(by_two_letters(places, "AC BC CD BE DE"))
        assert names(problem, legs(planned(exhaustive, problem))) == ["AC", "BC", "BE", "CD", "DE"]

    @pytest.mark.parametrize("planner", PLANNERS)
    def test_cycle_is_named(self, planner: object) -> None:
        places = {name: (i * 1000.0, i * i * 100.0) for i, name in enumerate("ABCDE")}
        problem = problem_on(by_two_letters(places, "AB BC CD DB DE"))
        with pytest.raises(NotApplicableError, match="cycle: BC CD DB;"):
            planned(planner, problem)

    @pytest.mark.parametrize("planner", PLANNERS)
    def test_roads_after_the_landing_are_left_out(self, planner: object) -> None:
        problem = problem_on(figure1())
        whole = planned(planner, problem)
        uav = Uav(-3000.0, 1000.0, 0.0, 100.0, max_flight_time_s=whole.legs[0][4].end_s + 1.0)
        short = planned(planner, problem.replace(uav=uav))
        assert short.legs[0] == whole.legs[0][:5]


class TestBreadthFirst:
    # The target turns off the road that the UAV looks at, and waits out the road it lacks.
    HEAD_START_S = 818.0

    def target(self, network: RoadNetwork) -> Futures:
        return physics_futures(network, [["AB", "BE", "ED", "DF", "FG"]], 0.0, 10.0)

    def test_leaves_out_the_road_to_an_examined_node(self) -> None:
        problem = problem_on(figure1())
        flown = names(problem, legs(planned(breadth_first, problem)))
        assert flown == ["AB", "BC", "BD", "BE", "CD", "CF", "DF", "EF", "FG"]

    def test_misses_a_target_that_the_papers_order_finds(self) -> None:
        network = figure1()
        target = self.target(network)
        # Take off so that the UAV, 3.2 km away, is at A after the head start.
        approach_s = np.hypot(3000.0, 1000.0) / 100.0
        problem = problem_on(network, target, take_off_s=self.HEAD_START_S - approach_s)
        missing, finding = planned(breadth_first, problem), planned(exhaustive, problem)
        assert first_detection(target, missing.tracks[0], 200.0) == [np.inf]
        assert np.isfinite(first_detection(target, finding.tracks[0], 200.0)).all()
        # The same by looking ten times a second, transit flights included.
        for plan, misses in ((missing, True), (finding, False)):
            track = plan.tracks[0]
            times = np.arange(track.time_s[0], track.end_s, 0.1)
            apart = np.linalg.norm(track.xy(times) - target.xy(0, times), axis=1)
            assert (apart.min() > 200.0) == misses

    def test_ends_on_a_net_with_cycles(self) -> None:
        problem = problem_on(by_two_letters({"A": (0, 0), "B": (1000, 0)}, "AB BA"))
        assert names(problem, legs(planned(breadth_first, problem))) == ["AB"]


class TestShortest:
    def test_one_extra_movement_on_figure1(self) -> None:
        problem = problem_on(figure1())
        plan = planned(exhaustive_shortest, problem)
        seconds, movements = extra(problem, legs(plan))
        assert movements == 1
        assert seconds == pytest.approx(np.hypot(3000, 1000) / 100 + 80.0)  # C - E is 8 km
        assert keeps_precedence(problem.network, legs(plan))

    def test_paper_needs_two(self) -> None:
        problem = problem_on(figure1())
        paper = ["AB", "BC", "DB", "BE", "ED", "EF", "FC", "CD", "DF", "FG"]
        ids = problem.network.road_ids
        order = [2 * ids.index(n) if n in ids else 2 * ids.index(n[::-1]) + 1 for n in paper]
        assert keeps_precedence(problem.network, order)
        assert extra(problem, order)[1] == 2

    def test_equal_times_have_the_fewest_movements(self) -> None:
        # B, A, C lie in line: from one end to the other in one movement or, by way of A, in two.
        places = {"A": (3, 8), "B": (0, 8), "C": (6, 8), "D": (0, 0), "E": (6, 0)}
        kilometres = {name: (x * 1000.0, y * 1000.0) for name, (x, y) in places.items()}
        problem = problem_on(by_two_letters(kilometres, "AB AD BE CD DE"))
        order, proven = shortest_order(problem)
        least_s, movements = best_by_enumeration(problem)
        assert len(movements) > 1
        assert proven
        assert extra(problem, order) == (pytest.approx(least_s), min(movements))

    @settings(max_examples=60, deadline=None)
    @given(lattice_dags)
    def test_agrees_with_enumeration(self, network: RoadNetwork) -> None:
        problem = problem_on(network)
        order, proven = shortest_order(problem)
        assert proven
        assert keeps_precedence(network, order)
        least_s, movements = best_by_enumeration(problem)
        assert extra(problem, order) == (pytest.approx(least_s, abs=1e-4), min(movements))

    def test_grid_is_proven(self) -> None:
        corner = Uav(x_m=0.0, y_m=0.0, take_off_s=0.0, speed_mps=100.0)
        problem = problem_on(grid(6, 6)).replace(uav=corner)
        order, proven = shortest_order(problem)
        assert proven
        assert keeps_precedence(problem.network, order)
        # Sixteen nodes of odd degree take eight hops of at least a road's length. One of them is
        # the approach, to the far end of the first road; precedence sends one across a block.
        assert extra(problem, order, start=(0.0, 0.0)) == (
            pytest.approx(7 * 150.0 + 150.0 * np.sqrt(2)),
            7,
        )

    def test_beam_keeps_precedence_and_is_not_better(self) -> None:
        problem = problem_on(grid(4, 4))
        best, proven = shortest_order(problem)
        assert proven
        for width in (1, 5, 20):
            order, proven = shortest_order(problem, width=width)
            assert not proven
            assert keeps_precedence(problem.network, order)
            assert extra(problem, order) >= extra(problem, best)

    def test_more_than_64_roads(self) -> None:
        problem = problem_on(grid(3, 15))
        assert len(problem.network.road_ids) > 64
        order, _ = shortest_order(problem, width=50)
        assert keeps_precedence(problem.network, order)
        printed = legs(planned(exhaustive, problem))
        assert extra(problem, order) < extra(problem, printed)


def best_by_enumeration(problem: Problem) -> tuple[float, set[int]]:
    """Least extra time over all orders, and the numbers of movements that orders then have."""
    network = problem.network
    before = [set(np.flatnonzero(network.road_to == start)) for start in network.road_from]
    ends = [(s, e) for s, e in zip(network.road_from, network.road_to, strict=True)]
    xy = network.node_xy_m
    results: set[tuple[float, int]] = set()

    def go_on(flown: frozenset[int], place: object, seconds: float, movements: int) -> None:
        if len(flown) == len(ends):
            results.add((round(seconds, 6), movements))
        for road, pair in enumerate(ends):
            if road in flown or not before[road] <= flown:
                continue
            for start, end in (pair, pair[::-1]):
                hop = float(np.hypot(*(xy[start] - place)))
                moved = movements + (len(flown) > 0 and hop > 0)
                go_on(flown | {road}, xy[end], seconds + hop / 100.0, moved)

    go_on(frozenset(), np.array([-3000.0, 1000.0]), 0.0, 0)
    least = min(seconds for seconds, _ in results)
    return least, {moved for seconds, moved in results if seconds <= least + 2e-6}


@pytest.mark.parametrize("planner", PLANNERS)
def test_precedence_on_random_networks(planner: object) -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        network = random_dag(rng, most_roads=14)
        plan = planned(planner, problem_on(network))
        assert keeps_precedence(network, legs(plan))
        assert all(early.end_s <= late.start_s for early, late in pairwise(plan.legs[0]))


def wandering(network: RoadNetwork, count: int, rng: np.random.Generator) -> Futures:
    """Targets from anywhere, each with one pause, that stop anywhere or go on to a sink."""
    routes: list[list[str]] = []
    for _ in range(count):
        road = int(rng.integers(len(network.road_ids)))
        route = [road]
        while len(onward := network.turns(route[-1])):
            route.append(int(rng.choice(onward)))
        routes.append([network.road_ids[road] for road in route])
    total = np.array([sum(length(network, name) for name in route) for route in routes])
    first = np.array([length(network, route[0]) for route in routes])
    stop = np.where(rng.random(count) < 0.5, np.inf, rng.uniform(0.0, total))
    start = rng.uniform(0.0, 1.0, count) * np.minimum(first, stop)
    start[rng.random(count) < 0.2] = 0.0  # some begin at a node
    speed = rng.uniform(1.0, 30.0, count)
    return with_pauses(physics_futures(network, routes, start, speed, stop_m=stop), rng)


def length(network: RoadNetwork, name: str) -> float:
    return float(network.road_length_m[network.road_ids.index(name)])


def with_pauses(futures: Futures, rng: np.random.Generator) -> Futures:
    """Each target rests for a while at one of its knots."""
    pause = [int(rng.integers(a, b)) for a, b in pairwise(futures.first_knot)]
    twice = np.sort(np.concatenate([np.arange(len(futures.time_s)), pause]))
    time_s, first_knot = futures.time_s[twice], futures.first_knot + np.arange(len(futures) + 1)
    for k, knot in enumerate(pause):
        time_s[knot + k + 1 : first_knot[k + 1]] += rng.exponential(600.0)
    return Futures(
        time_s,
        futures.x_m[twice],
        futures.y_m[twice],
        first_knot,
        futures.weight,
        futures.gone,
    )


@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize("detects_in_transit", [True, False])
def test_theorem_of_section_3(planner: object, detects_in_transit: bool) -> None:
    """A target that follows the roads, rests or stops is found by every order with precedence."""
    rng = np.random.default_rng(7)
    several_sources = 0
    for _ in range(200):
        network = random_dag(rng, most_roads=12)
        several_sources += len(sources(network)) > 1
        targets = wandering(network, 15, rng)
        problem = problem_on(network, targets, take_off_s=float(rng.uniform(0.0, 1500.0)))
        problem = problem.replace(sensor=Sensor(5.0, detects_in_transit))
        seen_s = first_detection(targets, planned(planner, problem).tracks[0], 5.0)
        assert np.isfinite(seen_s).all()
    assert several_sources > 50


def test_theorem_needs_precedence() -> None:
    """Such targets do escape orders without it, so the test above could fail."""
    rng = np.random.default_rng(7)
    escaped = 0
    for _ in range(50):
        network = random_dag(rng, most_roads=12)
        targets = wandering(network, 15, rng)
        problem = problem_on(network, targets, take_off_s=float(rng.uniform(0.0, 1500.0)))
        order = [2 * road for road in rng.permutation(len(network.road_ids)).tolist()]
        track = plan_of_legs(problem, "any order", order).tracks[0]
        escaped += int(np.isinf(first_detection(targets, track, 5.0)).sum())
    assert escaped > 5


def test_shortest_on_figure3_agrees_with_enumeration() -> None:
    problem = problem_on(figure3())
    order = legs(planned(exhaustive_shortest, problem))
    assert keeps_precedence(problem.network, order)
    least_s, movements = best_by_enumeration(problem)
    assert extra(problem, order) == (pytest.approx(least_s), min(movements))


def test_roads_driven_both_ways_have_no_order_but_a_search_in_breadth() -> None:
    places = {"A": (0.0, 0.0), "B": (9e3, 0.0), "C": (9e3, 9e3), "D": (0.0, 9e3)}
    network = by_two_letters(places, "AB CB CD")
    problem = problem_on(replace(network, both_ways=np.array([False, True, True])))
    for planner in PLANNERS:
        with pytest.raises(NotApplicableError, match="has a cycle: CB CB"):
            planned(planner, problem)
    assert names(problem, legs(planned(breadth_first, problem))) == ["AB", "BC", "CD"]
