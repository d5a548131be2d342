"""Patterns as the manual draws them: spacings, turns and legs, worked out by hand."""

import numpy as np
import pytest

from planner.arrays import Floats
from planner.search.patterns import (
    MOST_POINTS,
    expanding_square,
    parallel_track,
    repeated,
    sector_search,
    spiral,
)

CENTRE = (1000.0, -500.0)


def lengths_m(points: Floats) -> list[float]:
    return np.hypot(*np.diff(points, axis=0).T).tolist()


def courses_deg(points: Floats) -> list[float]:
    east, north = np.diff(points, axis=0).T
    return (np.degrees(np.arctan2(east, north)) % 360.0).tolist()


def test_an_expanding_square_grows_by_one_spacing_every_other_leg() -> None:
    points = expanding_square(CENTRE, 100.0, 150.0, 0.0)
    assert points[0].tolist() == list(CENTRE)
    assert lengths_m(points) == pytest.approx([100, 100, 200, 200, 300, 300, 300])
    assert courses_deg(points) == pytest.approx([0, 90, 180, 270, 0, 90, 180])
    # It goes round the centre, and is twice the extent wide.
    west_south, east_north = points.min(axis=0) - CENTRE, points.max(axis=0) - CENTRE
    assert (east_north - west_south).tolist() == pytest.approx([300, 300])
    assert np.all(west_south < 0.0)
    assert np.all(east_north > 0.0)


def test_tracks_of_an_expanding_square_lie_one_spacing_apart() -> None:
    points = expanding_square((0.0, 0.0), 120.0, 600.0, 0.0)
    for axis in (0, 1):
        lines = np.unique(np.round(points[:, axis], 6))
        assert np.diff(lines) == pytest.approx(np.full(len(lines) - 1, 120.0))


def test_a_square_starts_on_its_course() -> None:
    points = expanding_square(CENTRE, 100.0, 150.0, 37.0)
    assert courses_deg(points)[:3] == pytest.approx([37, 127, 217])


def test_a_sector_search_is_three_triangles_that_meet_in_the_centre() -> None:
    points = sector_search(CENTRE, 800.0, 20.0)
    assert len(points) == 10
    assert lengths_m(points) == pytest.approx([800.0] * 9)
    assert [tuple(points[k]) for k in (0, 3, 6, 9)] == [CENTRE] * 4
    # All turns are of 120 degrees to the right; through the centre it flies straight on.
    turns_deg = np.diff(courses_deg(points)) % 360.0
    assert turns_deg == pytest.approx([120, 120, 0, 120, 120, 0, 120, 120])
    assert courses_deg(points)[0] == pytest.approx(20.0)
    assert (courses_deg(points)[-1] + 0.0) == pytest.approx(20.0)  # on to the second search


def test_a_spiral_is_one_spacing_further_out_after_each_turn() -> None:
    points = spiral(CENTRE, 100.0, 400.0, 90.0)
    away_m = np.hypot(*(points - CENTRE).T)
    steps = 24  # of 15 degrees, in a turn
    assert len(points) == 4 * steps + 1
    assert away_m[::steps] == pytest.approx([0, 100, 200, 300, 400])
    assert points[2 * steps].tolist() == pytest.approx([1200, -500])  # east, as it left
    # To the right: a quarter of a turn on from east is south.
    assert points[2 * steps + 6].tolist() == pytest.approx([1000, -725])


def test_parallel_tracks_cover_a_rectangle() -> None:
    points = parallel_track((0.0, 0.0), 1000.0, 400.0, 100.0, 0.0)
    assert points.tolist() == [
        [-150, -500], [-150, 500],
        [-50, 500], [-50, -500],
        [50, -500], [50, 500],
        [150, 500], [150, -500],
    ]  # fmt: skip
    turned = parallel_track(CENTRE, 1000.0, 400.0, 100.0, 90.0) - CENTRE
    assert turned == pytest.approx(points[:, ::-1] * (1.0, -1.0))


def test_one_track_is_flown_through_the_middle_where_more_do_not_fit() -> None:
    points = parallel_track(CENTRE, 1000.0, 80.0, 100.0, 0.0)
    assert points.tolist() == [[1000, -1000], [1000, 0]]


def test_passes_are_flown_until_the_flight_is_long_enough() -> None:
    def one_pass(number: int) -> Floats:
        return np.array([[0.0, 0.0], [0.0, 1000.0 + number]])

    points = repeated(one_pass, 3500.0)
    assert points.tolist() == [[0, 0], [0, 1000], [0, 0], [0, 1001], [0, 0]]
    assert repeated(one_pass, 0.0).tolist() == [[0, 0], [0, 1000]]
    assert repeated(one_pass, 1000.0).tolist() == [[0, 0], [0, 1000]]


def test_a_pattern_of_nothing_ends() -> None:
    assert len(repeated(lambda _: np.zeros((1, 2)), 1e9)) == MOST_POINTS
    assert len(repeated(lambda _: np.zeros((7, 2)), 1e9)) == MOST_POINTS
