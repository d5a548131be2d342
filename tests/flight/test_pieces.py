"""A flight cut into roads and ways, and where particles are on the map."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.flight.pieces import along, pieces
from planner.futures.futures import Futures
from planner.report.maps import View
from planner.search.plan import plan_of_legs, plan_of_wait
from support.grid_instance import grid_futures, grid_problem
from support.instances import figure3, physics_futures

PROBLEM = grid_problem(grid_futures(1, np.random.default_rng(1)), distance_m=60000.0)


@given(st.lists(st.integers(0, 119), max_size=8))
def test_pieces_join_to_the_whole_flight(order: list[int]) -> None:
    plan = plan_of_legs(PROBLEM, "any", order)
    track, parts = plan.tracks[0], pieces(plan)
    assert [part.road for part in parts if part.order] == [leg // 2 for leg in order]
    assert [part.order for part in parts if part.order] == list(range(1, len(order) + 1))
    flown_m = np.hypot(np.diff(track.x_m), np.diff(track.y_m)).sum()
    parts_m = sum(np.linalg.norm(np.diff(part.xy_m, axis=0), axis=1).sum() for part in parts)
    assert parts_m == pytest.approx(flown_m)
    for before, after in itertools.pairwise(parts):
        assert np.allclose(before.xy_m[-1], after.xy_m[0])
        assert before.end_s <= after.start_s + 1e-9


def test_waiting_is_no_piece() -> None:
    (way,) = pieces(plan_of_wait(PROBLEM, "wait", 75000.0, -75000.0))
    assert way.order == 0
    assert way.road is None
    assert np.allclose(way.xy_m[-1], (75000.0, -75000.0))


def test_along_a_bent_line_with_a_doubled_point() -> None:
    bent = np.array([[0.0, 0], [0, 0], [100, 0], [100, 0], [100, 300]])
    for share, point, direction in (
        (0.0, (0, 0), (1, 0)),
        (0.125, (50, 0), (1, 0)),
        (0.5, (100, 100), (0, 1)),
        (1.0, (100, 300), (0, 1)),
    ):
        found = along(bent, share)
        assert np.allclose(found[0], point)
        assert np.allclose(found[1], direction)


@given(st.floats(-100.0, 4000.0), st.booleans())
def test_positions_agree_with_each_particle_s_own(time_s: float, gone: bool) -> None:
    routes = [["AB", "BC", "CE"], ["AB", "BD", "DG"], ["CF"]]
    futures = physics_futures(
        figure3(), routes, [0.0, 200.0, 0.0], [5.0, 20.0, 30.0], gone=gone, depart_s=[0, 50, 9]
    )
    nowhere = Futures(*[np.empty(0)] * 3, [0, 0], [0.1], [False])
    together = Futures(
        futures.time_s,
        futures.x_m,
        futures.y_m,
        [*futures.first_knot, futures.first_knot[-1]],
        [*futures.weight, *nowhere.weight],
        [*futures.gone, False],
    )
    found = together.positions(time_s)
    for particle in range(len(together)):
        expected = together.xy(particle, time_s)
        assert np.allclose(found[particle], expected, equal_nan=True)


def test_positions_at_the_very_knots() -> None:
    futures = physics_futures(figure3(), [["AB", "BC"]], 0.0, 10.0, gone=True)
    for time_s in futures.time_s:
        assert np.allclose(futures.positions(time_s)[0], futures.xy(0, time_s))
    assert np.isnan(futures.positions(futures.time_s[-1] + 1e-3)).all()


def test_view_is_a_square_with_the_net_in_its_middle() -> None:
    view = View.of(figure3(), margin=0.1)
    assert view.size_m == pytest.approx(16000 * 1.2)
    assert np.allclose([view.west_m, view.south_m], [7500 - 9600, -9600])
    assert view.unit == "km"
    inside = view.contains(np.array([[0.0, 0.0], [-2101.0, 0.0], [0.0, 9601.0]]))
    assert inside.tolist() == [True, False, False]
