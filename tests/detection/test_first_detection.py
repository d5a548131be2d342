"""The exact first detection against known answers and against a twin that steps in ticks."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.detection.first_detection import first_detection
from planner.flight.track import Track
from planner.futures.futures import Futures
from support.reference import at_times, by_ticks

Points = Sequence[tuple[float, float, float]]  # time, x, y
ALWAYS = ((-np.inf, np.inf),)


def futures_of(*motions: Points, gone: bool = False) -> Futures:
    knots = np.array([knot for motion in motions for knot in motion], dtype=float).reshape(-1, 3)
    return Futures(
        *knots.T,
        first_knot=np.concatenate(([0], np.cumsum([len(motion) for motion in motions]))),
        weight=np.full(len(motions), 1 / max(1, len(motions))),
        gone=np.full(len(motions), gone),
    )


def track_of(points: Points, sensor_on: Sequence[tuple[float, float]] = ALWAYS) -> Track:
    return Track(*np.array(points, dtype=float).T, np.array(sensor_on, dtype=float).reshape(-1, 2))


def seen(motion: Points, flight: Points, radius_m: float, *, gone: bool = False) -> float:
    return float(first_detection(futures_of(motion, gone=gone), track_of(flight), radius_m)[0])


def test_head_on() -> None:
    assert seen([(0, 0, 0), (100, 2000, 0)], [(0, 9000, 0), (90, 0, 0)], 600) == pytest.approx(70)


def test_overtaking_beyond_a_knot() -> None:
    motion = [(0, 1000, 0), (10, 1200, 0), (60, 2200, 0)]
    assert seen(motion, [(0, 0, 0), (50, 5000, 0)], 100) == pytest.approx(900 / 80)


def test_passing_at_exactly_the_radius_counts() -> None:
    assert seen([(0, 300, 500)], [(0, 0, 0), (10, 1000, 0)], 500) == pytest.approx(3)
    assert seen([(0, 300, 500)], [(0, 0, 0), (10, 1000, 0)], 499.999) == np.inf


def test_side_by_side_at_equal_speed() -> None:
    motion = [(0, 0, 400), (100, 1000, 400)]
    flight = [(0, 0, 0), (100, 1000, 0)]
    assert seen(motion, flight, 400) == 0
    assert seen(motion, flight, 399.99) == np.inf


def test_nearly_equal_speed_from_far_away() -> None:
    speed = 100 / 3
    motion = [(0, 0, 1e6), (30000, 30000 * speed, 1e6 - 30000 * speed)]
    flight = [(0, 0, 0), (30000, 30000 * (speed + 1e-9), 0)]
    at = seen(motion, flight, 100)
    assert at == pytest.approx((1e6 - 100) / speed, abs=1e-3)


def test_a_resting_target_stays_visible_and_a_gone_one_does_not() -> None:
    motion = [(0, 0, 0), (10, 1000, 0)]
    flight = [(0, 1000, 5000), (50, 1000, 0)]
    assert seen(motion, flight, 500) == pytest.approx(45)
    assert seen(motion, flight, 500, gone=True) == np.inf


def test_a_gone_target_is_there_up_to_and_including_its_last_knot() -> None:
    flight = [(0, 1000, 1500), (20, 1000, -500)]  # within 500 m of (1000, 0) from 10 s on
    assert seen([(0, 1000, -2000), (10, 1000, 0)], flight, 500, gone=True) == 10
    assert seen([(10, 1000, 0)], flight, 500, gone=True) == 10
    assert seen([(9.999, 1000, 0)], flight, 500, gone=True) == np.inf


def test_nowhere_before_its_first_knot() -> None:
    flight = [(0, 0, 0), (100, 0, 0)]
    assert seen([(30, 0, 0), (40, 10, 0)], flight, 50) == 30
    assert seen([(101, 0, 0)], flight, 50) == np.inf


def test_without_knots_never() -> None:
    futures = futures_of([], [(0, 0, 0)], [])
    seen_at = first_detection(futures, track_of([(0, 0, 0), (1, 0, 0)]), 1)
    assert seen_at.tolist() == [np.inf, 0, np.inf]


def test_sensor_windows() -> None:
    futures = futures_of([(0, 500, 0)], [(0, 900, 0)])
    track = track_of([(0, 0, 0), (10, 1000, 0)], [(0, 3.5), (5.5, 8.5), (9.5, 30)])
    assert first_detection(futures, track, 100).tolist() == [5.5, 8]
    assert first_detection(futures, track_of([(0, 0, 0), (9, 900, 0)], []), 100).min() == np.inf


def test_not_after_the_last_waypoint() -> None:
    assert seen([(0, 5000, 0), (100, 0, 0)], [(0, 0, 0), (1, 0, 0)], 100) == np.inf


def test_a_flight_of_one_waypoint_looks_once() -> None:
    motion = [(0, 0, 0), (100, 100, 0)]
    assert seen(motion, [(50, 50, 3)], 5) == 50
    assert seen(motion, [(50, 50, 3)], 2) == np.inf


def test_waypoints_of_no_duration() -> None:
    flight = [(0, 0, 0), (0, 0, 0), (10, 1000, 0), (10, 1000, 0), (10, 1000, 0), (20, 1000, 1000)]
    assert seen([(0, 1000, 900)], flight, 100) == pytest.approx(18)


def test_far_from_the_origin_of_the_map() -> None:
    east, north = 690_000.0, 5_490_000.0
    motion = [(36000, east, north), (36900, east + 15000, north)]
    flight = [(36000, east + 60000, north), (36600, east, north)]
    at = seen(motion, flight, 500)
    assert at == pytest.approx(36000 + 59500 / (100 + 15000 / 900), abs=1e-8)


coordinates = st.one_of(st.integers(-6, 6).map(float), st.floats(-6, 6, width=32))
durations = st.one_of(st.integers(1, 4).map(float), st.floats(0.0625, 4, width=32))


@st.composite
def polylines(draw: st.DrawFn, *, pauses: bool) -> Points:
    """Motion with moves, rests and, if asked, points that take no time."""
    now, x, y = draw(st.integers(-3, 6)), draw(coordinates), draw(coordinates)
    points = [(float(now), x, y)]
    for _ in range(draw(st.integers(0, 6))):
        kind = draw(st.sampled_from(["move", "move", "rest", "none" if pauses else "move"]))
        last = points[-1]
        if kind == "move":
            last = (last[0] + draw(durations), draw(coordinates), draw(coordinates))
        elif kind == "rest":
            last = (last[0] + draw(durations), last[1], last[2])
        points.append(last)
    return points


@st.composite
def windows(draw: st.DrawFn) -> list[tuple[float, float]]:
    if draw(st.booleans()):
        return [(-10.0, 60.0)]
    edges = sorted(draw(st.lists(st.floats(-5, 25, width=32), max_size=6, unique=True)))
    return list(zip(edges[::2], edges[1::2], strict=False))


@settings(max_examples=400, deadline=None)
@given(
    motion=polylines(pauses=False),
    flight=polylines(pauses=True),
    sensor_on=windows(),
    radius_m=st.one_of(st.sampled_from([0.5, 1.0, 2.0]), st.floats(0.01, 4)),
    gone=st.booleans(),
)
def test_agrees_with_stepping_in_ticks(
    motion: Points,
    flight: Points,
    sensor_on: list[tuple[float, float]],
    radius_m: float,
    gone: bool,
) -> None:
    futures, track = futures_of(motion, gone=gone), track_of(flight, sensor_on)
    at = float(first_detection(futures, track, radius_m)[0])
    ticks = by_ticks(futures, 0, track, 0.02)
    inside = ticks.time_s[ticks.distance_m < radius_m - 1e-6]
    if at == np.inf:
        assert len(inside) == 0
        return
    assert any(start <= at <= end for start, end in sensor_on)
    there = at_times(futures, 0, track, np.array([at]))
    assert there.distance_m.tolist() == [pytest.approx(there.distance_m.min())]
    assert there.distance_m[0] <= radius_m + 1e-6
    assert not np.any(inside < at - 1e-9)


@settings(max_examples=150, deadline=None)
@given(
    offset=st.tuples(st.floats(-5, 5), st.floats(-5, 5)),
    velocity=st.tuples(st.floats(-3, 3), st.floats(-3, 3)),
    own=st.tuples(st.floats(-3, 3), st.floats(-3, 3)),
    miss=st.floats(-1e-7, 1e-7),
)
def test_near_misses_are_decided_by_the_closest_approach(
    offset: tuple[float, float],
    velocity: tuple[float, float],
    own: tuple[float, float],
    miss: float,
) -> None:
    motion = [(0, *offset), (4, offset[0] + 4 * velocity[0], offset[1] + 4 * velocity[1])]
    flight = [(0, 0, 0), (4, 4 * own[0], 4 * own[1])]
    drift = np.subtract(velocity, own)
    speed2 = float(drift @ drift)
    closest = np.clip(-(np.array(offset) @ drift) / speed2, 0, 4) if speed2 > 0 else 0.0
    nearest_m = float(np.hypot(*(np.array(offset) + closest * drift)))
    radius_m = nearest_m + np.sign(miss) * 1e-9 + miss
    if radius_m <= 0:
        return
    found = seen(motion, flight, radius_m)
    if abs(radius_m - nearest_m) > 1e-12 * (1 + nearest_m) + 1e-15:
        assert (found < np.inf) == (radius_m > nearest_m)
    # A tangent is ill-conditioned in time; a drift of rounding errors alone has no direction.
    drifts = speed2 > 1e-24
    assert found == np.inf or not drifts or found <= closest + 1e-6
