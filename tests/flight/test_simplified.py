"""A flight with fewer waypoints is at no time off by more than the tolerance."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.arrays import Floats
from planner.flight.simplified import kept_knots


def random_flight(seed: int) -> tuple[Floats, Floats]:
    """Knots at rising times, some at one time, some at one place."""
    rng = np.random.default_rng(seed)
    many = int(rng.integers(2, 60))
    lasts_s = rng.choice([0.0, 1.0, 20.0], size=many) * rng.uniform(0, 1, many)
    steps_m = rng.normal(0, 20, (many, 2)) * rng.choice([0.0, 1.0], size=(many, 1), p=[0.2, 0.8])
    steps_m[lasts_s == 0.0] = 0.0
    return np.cumsum(lasts_s), np.cumsum(steps_m, axis=0)


def farthest_off_m(time_s: Floats, xy_m: Floats, kept: Floats) -> float:
    """At all times, by looking at many of them and at all knots."""
    at_s = np.unique(np.concatenate([time_s, np.linspace(time_s[0], time_s[-1], 500)]))
    off = [
        np.interp(at_s, time_s, column) - np.interp(at_s, time_s[kept], column[kept])
        for column in xy_m.T
    ]
    return float(np.hypot(*off).max())


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.0, 60.0))
def test_it_is_never_off_by_more_than_the_tolerance(seed: int, tolerance_m: float) -> None:
    time_s, xy_m = random_flight(seed)
    kept = kept_knots(time_s, xy_m, tolerance_m)
    assert np.all(np.diff(kept) > 0)
    assert (kept[0], kept[-1]) == (0, len(time_s) - 1)
    assert farthest_off_m(time_s, xy_m, kept) <= tolerance_m + 1e-9


def test_it_leaves_out_what_it_may() -> None:
    time_s = np.array([0.0, 10.0, 20.0, 30.0])
    xy_m = np.array([[0.0, 0.0], [100.0, 4.0], [200.0, 0.0], [300.0, 50.0]])
    assert kept_knots(time_s, xy_m, 5.0).tolist() == [0, 2, 3]
    late = np.array([0.0, 11.0, 20.0, 30.0])  # ten metres behind, on the same way
    assert kept_knots(late, xy_m, 5.0).tolist() == [0, 1, 2, 3]


def test_holds_stay() -> None:
    time_s, xy_m = np.arange(5.0), np.arange(10.0).reshape(5, 2)
    assert kept_knots(time_s, xy_m, 9.0).tolist() == [0, 4]
    assert kept_knots(time_s, xy_m, 9.0, holds=[1, 2]).tolist() == [0, 1, 2, 4]


@pytest.mark.parametrize("seed", range(20))
def test_it_does_not_fly_straight_where_the_way_is_not_clear(seed: int) -> None:
    time_s, xy_m = random_flight(seed)

    def clear(a: Floats, b: Floats) -> bool:
        return bool(np.hypot(*(b - a)) < 50.0)

    kept = kept_knots(time_s, xy_m, 1e6, clear=clear)
    assert all(b - a == 1 or clear(xy_m[a], xy_m[b]) for a, b in pairwise(kept.tolist()))
