"""The compass: its points in letters and in words, all the way round."""

import pytest

from planner.compass import POINTS, letters, words
from planner.network.place_words import heading


@pytest.mark.parametrize(
    ("bearing_deg", "of", "point"),
    [(0, 16, "N"), (348.75, 8, "N"), (-1, 4, "N"), (44, 4, "N"), (46, 4, "E"), (203, 16, "SSW")],
)
def test_the_nearest_point(bearing_deg: float, of: int, point: str) -> None:
    assert letters(bearing_deg, of) == point


def test_what_is_said_is_heard() -> None:
    assert words(136) == "south-east"
    assert words(260, 4) == "west"
    for number, point in enumerate(POINTS):
        assert heading(point) == 22.5 * number
    for eighth in range(8):
        assert heading(words(45 * eighth)) == 45 * eighth
