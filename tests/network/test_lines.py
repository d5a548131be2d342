"""Lines as columns: distances along and beside them, against slow and obvious ones."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.arrays import Floats, first_of_parts
from planner.network.lines import Lines

places = st.tuples(st.integers(-50, 50), st.integers(-50, 50)).map(
    lambda xy: [float(c) for c in xy]
)
lines = st.lists(st.lists(places, min_size=2, max_size=6), min_size=1, max_size=4)


def lines_of(parts: list[list[list[float]]]) -> Lines:
    return Lines(first_of_parts(parts), np.concatenate([np.array(part) for part in parts]))


def off_slowly(line: Floats, place: Floats) -> float:
    found = []
    for a, b in pairwise(line):
        shares = np.linspace(0.0, 1.0, 2001)[:, None]
        found.append(np.hypot(*(a + (b - a) * shares - place).T).min())
    return float(min(found))


@given(lines, places)
def test_places_lie_off_a_line_as_far_as_from_its_nearest_point(
    parts: list[list[list[float]]], place: list[float]
) -> None:
    found, here = lines_of(parts), np.array([place])
    for k in range(len(found)):
        off_m = found.off(np.array([k]), here, here)
        assert off_m[0] == pytest.approx(off_slowly(found[k], here[0]), abs=0.08)


@given(lines, places, places)
def test_no_place_of_a_part_lies_farther_off_than_the_part(
    parts: list[list[list[float]]], start: list[float], end: list[float]
) -> None:
    found, a, b = lines_of(parts), np.array([start]), np.array([end])
    for k in range(len(found)):
        bound_m = found.off(np.array([k]), a, b)[0]
        between = a + (b - a) * np.linspace(0.0, 1.0, 50)[:, None]
        off_m = found.off(np.full(50, k), between, between)
        assert off_m.max() <= bound_m + 1e-9
        if len(found[k]) == 2:
            assert off_m.max() == pytest.approx(bound_m)


@given(lines)
def test_parts_make_up_the_lines(parts: list[list[list[float]]]) -> None:
    found = lines_of(parts)
    cut = found.parts(longest_m=7.0)
    long_m = np.hypot(*(cut.end_m - cut.start_m).T)
    assert long_m.max() <= 7.0 + 1e-9
    summed_m = np.bincount(cut.line, long_m, len(found))
    np.testing.assert_allclose(summed_m, found.length_m, atol=1e-9)
    assert np.all(np.diff(cut.line) >= 0)
    whole = found.parts()
    np.testing.assert_array_equal(whole.start_m[:1], found.xy_m[:1])


def test_many_lines_are_measured_in_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    found = lines_of([rng.uniform(0, 100, (5, 2)).tolist() for _ in range(30)])
    line, a, b = rng.integers(30, size=100), *rng.uniform(0, 100, (2, 100, 2))
    at_once = found.off(line, a, b)
    monkeypatch.setattr("planner.network.lines.AT_ONCE", 7)
    np.testing.assert_array_equal(found.off(line, a, b), at_once)
    nobody = np.zeros((0, 2))
    assert len(found.off(line[:0], nobody, nobody)) == 0
