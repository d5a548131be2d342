"""The parts of a call's screen that can be told without planning."""

import numpy as np
import pytest

from planner.report.call_screen import _first_turn, beside, since


@pytest.mark.parametrize(
    ("points", "turn"),
    [
        ([(0, 0)], 0),  # stays
        ([(0, 0), (0, 0), (0, 0)], 2),  # climbs, and stays
        ([(0, 0), (0, 0), (300, 0), (600, 5), (600, 300)], 3),  # a bend of five metres is none
        ([(0, 0), (300, 0), (300, 300)], 1),
        ([(0, 0), (300, 0), (100, 0)], 1),  # back again
        ([(0, 0), (10, 10), (500, 30), (500, 400)], 2),  # a corner at the start
    ],
)
def test_the_first_leg_ends_where_the_course_changes(
    points: list[tuple[float, float]], turn: int
) -> None:
    assert _first_turn(np.array(points, dtype=float)) == turn


def test_how_long_ago_the_call_came() -> None:
    assert [since(s) for s in (0.4, 7.9, 60.0, 3725.0)] == ["  0:00", "  0:07", "  1:00", " 62:05"]


def test_long_lines_go_on_beside_the_margin() -> None:
    lines = beside(since(61.0), "word " * 30).split("\n")
    assert lines[0].startswith("  1:01  word")
    assert lines[1].startswith("        word")
    assert max(map(len, lines)) <= 79
