"""What a town's map shows: the part that matters, and the first places of likely finds."""

from pathlib import Path

import numpy as np
import pytest

from planner.arrays import Floats
from planner.detection.evaluate import evaluate
from planner.flight.pieces import Piece
from planner.futures.state_at import State
from planner.mission.opening import OpenScenario
from planner.mission.planning import problem_of
from planner.network.road_network import RoadNetwork
from planner.report.maps import View
from planner.report.picture import plan_picture
from planner.report.town_map import (
    FINDS,
    _emptiest_corner,
    finds_of,
    view_of_search,
    view_of_state,
)
from planner.search.plan import plan_of_waypoints
from support.drawn_texts import texts
from support.search_instances import random_problem

WEIGHT = np.full(100, 0.01)


def straight(x_m: float, from_s: float) -> Piece:
    """A stretch of 10 s towards the east."""
    return Piece(0, 0, None, np.array([[x_m, 0.0], [x_m + 100.0, 0.0]]), from_s, from_s + 10.0)


def test_finds_are_numbered_where_they_are_made() -> None:
    flight = [straight(1000.0 * k, 10.0 * k) for k in range(9)]
    seen_at = np.full(100, np.inf)
    seen_at[:20], seen_at[20:50], seen_at[50:60] = 13.0, 25.0, 29.5
    finds = finds_of(flight, seen_at, WEIGHT, apart_m=50.0)
    assert [find.xy_m.tolist() for find in finds] == [[1050.0, 0.0], [2050.0, 0.0]]
    assert [find.from_s for find in finds] == [13.0, 25.0]
    assert [find.probability for find in finds] == pytest.approx([0.2, 0.4])
    near = finds_of(flight, seen_at, WEIGHT, apart_m=1500.0)
    assert [find.probability for find in near] == pytest.approx([0.6])


def test_only_the_first_finds_are_numbered_and_none_that_is_unlikely() -> None:
    flight = [straight(1000.0 * k, 10.0 * k) for k in range(20)]
    seen_at = 10.0 * np.arange(20).repeat(5) + 5.0
    assert len(finds_of(flight, seen_at, WEIGHT, apart_m=1.0)) == FINDS
    assert finds_of(flight, seen_at, WEIGHT / 10, apart_m=1.0) == []


def test_the_list_stands_where_nothing_is_drawn() -> None:
    view = View.around(np.array([[0.0, 0.0], [1000.0, 1000.0]]))
    assert _emptiest_corner(view, [np.zeros(2)], [straight(0.0, 0.0)]) == (True, True)
    assert _emptiest_corner(view, [np.full(2, 900.0)], []) == (False, False)


def test_the_view_leaves_out_what_nobody_flies_to() -> None:
    problem = random_problem(3)
    plan = plan_of_waypoints(problem, "x", np.array([[500.0, 400.0, 0.0]]))
    futures = problem.futures
    still = futures.take(np.arange(1))
    view = view_of_search(problem.replace(futures=still), plan, problem.horizon_s)
    whole = View.of(problem.network)
    assert view.size_m < whole.size_m
    assert view.contains(np.array([problem.uav.x_m, problem.uav.y_m]))


def test_where_they_may_be_is_shown_closely_in_a_town(berlin: OpenScenario) -> None:
    net = berlin.network
    whole = View.of(net)

    def seen(places: Floats, network: RoadNetwork = net) -> View:
        many, nothing = len(places), np.zeros(len(places))
        somewhere = np.arange(many), np.ones(many), places, np.zeros(many), nothing, nothing
        return view_of_state(network, State(60.0, *somewhere))

    assert seen(net.shape_xy_m).size_m > 0.9 * whole.size_m
    near = seen(np.repeat(net.node_xy_m[:1], 3, axis=0))
    assert near.size_m == pytest.approx(0.2 * whole.size_m)
    assert near.contains(net.node_xy_m[0])
    assert seen(np.empty((0, 2))) == whole
    grid = random_problem(3).network
    assert seen(grid.node_xy_m[:1], grid) == View.of(grid)


def test_a_town_says_what_left_and_what_is_the_most(tmp_path: Path, berlin: OpenScenario) -> None:
    problem = problem_of(berlin, random_problem(3).futures)
    plan = plan_of_waypoints(problem, "x", np.array([[1000.0, 1000.0, 0.0]]))
    found = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective)
    plan_picture(tmp_path / "p.svg", problem, plan, evaluations={"planned": found})
    said = " ".join(texts(tmp_path / "p.svg"))
    assert "futures that leave the map unseen: " in said
    assert "gone: has left the map, not found" in said
