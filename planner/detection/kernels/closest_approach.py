"""Closest approach of two straight motions, and its sweep along whole flights; compiled."""

from typing import NamedTuple, TypeAlias

import numpy as np

from planner.arrays import Flags, Floats, Offsets
from planner.jit import compiled

Vector: TypeAlias = tuple[float, float]  # x and y: a place in metres, or a velocity in m/s


class PathColumns(NamedTuple):
    """Points of a flight, or knots of particles: straight and evenly from each to the next."""

    time_s: Floats  # (W,) seconds on the target's clock, never falling along one path
    x_m: Floats  # (W,) metres
    y_m: Floats  # (W,) metres


class FuturesColumns(NamedTuple):
    """The columns of ``Futures`` that say where particles are."""

    time_s: Floats  # (K,) seconds on the target's clock
    x_m: Floats  # (K,) metres
    y_m: Floats  # (K,) metres
    first_knot: Offsets  # (N + 1,) where a particle's knots start
    gone: Flags  # (N,) True: vanishes after the last knot, False: rests there


class Rows(NamedTuple):
    """Rows of a column that belong together."""

    begin: int  # the first one
    end: int  # one after the last


class Window(NamedTuple):
    """A span of time, both ends included."""

    from_s: float  # seconds on the target's clock
    to_s: float


class StraightMotion(NamedTuple):
    """Straight motion from a moment on."""

    x_m: float  # where it is at that moment
    y_m: float
    vx_mps: float
    vy_mps: float
    until_s: float  # when it ends, seconds; infinity: never


class Chaser(NamedTuple):
    """A UAV that may fly wherever it likes, and what it sees."""

    x_m: float  # where it takes off
    y_m: float
    take_off_s: float  # seconds on the target's clock
    speed_mps: float
    radius_m: float  # of detection


@compiled
def first_within(offset: Vector, drift: Vector, duration_s: float, radius_m: float) -> float:
    """Return the first second in [0, duration] at which two bodies are within the radius.

    Parameters
    ----------
    offset
        Place of the one seen from the other at second 0, metres.
    drift
        Its velocity seen from the other, m/s.

    Returns
    -------
    float
        Infinity if they do not come that close.
    """
    dx, dy = offset
    vx, vy = drift
    outside = dx * dx + dy * dy - radius_m * radius_m
    if outside <= 0.0:
        return 0.0
    approach = -(dx * vx + dy * vy)
    if approach <= 0.0:
        return np.inf
    # The discriminant by the distance at which they pass: from b^2 - a c nothing would be left
    # where the bodies are far apart.
    across = dx * vy - dy * vx
    discriminant = (vx * vx + vy * vy) * radius_m * radius_m - across * across
    if discriminant < 0.0:
        return np.inf
    after_s = outside / (approach + np.sqrt(discriminant))
    return after_s if after_s <= duration_s else np.inf


@compiled
def while_within(offset: Vector, drift: Vector, duration_s: float, radius_m: float) -> Window:
    """Return from when to when, in [0, duration], two bodies are within the radius.

    As `first_within`, whose second it begins with; (inf, -inf) if they do not come that close.
    """
    from_s = first_within(offset, drift, duration_s, radius_m)
    if not from_s < np.inf:
        return Window(np.inf, -np.inf)
    (dx, dy), (vx, vy) = offset, drift
    a = vx * vx + vy * vy
    if a <= 0.0:
        return Window(from_s, duration_s)
    approach, across = -(dx * vx + dy * vy), dx * vy - dy * vx
    root = np.sqrt(max(0.0, a * radius_m * radius_m - across * across))
    if approach >= 0.0:
        to_s = (approach + root) / a
    else:  # in this form nothing is lost where it is about to leave
        outside = dx * dx + dy * dy - radius_m * radius_m
        to_s = min(0.0, outside) / (approach - root)
    return Window(from_s, max(from_s, min(to_s, duration_s)))


@compiled
def first_in_reach(offset: Vector, drift: Vector, reach_m: float, speed_mps: float) -> float:
    """Return the first second s >= 0 with |offset + drift s| <= reach + speed s, or infinity."""
    (x, y), (vx, vy) = offset, drift
    beyond = x * x + y * y - reach_m * reach_m
    if beyond <= 0.0:
        return 0.0
    a = vx * vx + vy * vy - speed_mps * speed_mps
    b = reach_m * speed_mps - x * vx - y * vy
    discriminant = b * b - a * beyond
    if discriminant < 0.0:
        return np.inf
    # In this form it holds for targets slower than the UAV, as fast, and faster.
    divisor = b + np.sqrt(discriminant)
    return beyond / divisor if divisor > 0.0 else np.inf


@compiled
def last_at_or_before(time_s: Floats, first: int, end: int, moment_s: float) -> int:
    """Return the last index in [first, end) with time at or before a moment; else ``first``."""
    low, high = first, end
    while high - low > 1:
        middle = (low + high) // 2
        if time_s[middle] <= moment_s:
            low = middle
        else:
            high = middle
    return low


@compiled
def motion_at(path: PathColumns, i: int, end: int, moment_s: float) -> StraightMotion:
    """Return the motion from point ``i`` of a path on, as it is at a moment not before the point.

    The last point, ``end - 1``, rests without end.
    """
    time_s, x_m, y_m = path
    if i + 1 >= end:
        return StraightMotion(x_m[i], y_m[i], 0.0, 0.0, np.inf)
    lasts_s = time_s[i + 1] - time_s[i]
    if lasts_s <= 0.0:
        return StraightMotion(x_m[i], y_m[i], 0.0, 0.0, time_s[i + 1])
    vx = (x_m[i + 1] - x_m[i]) / lasts_s
    vy = (y_m[i + 1] - y_m[i]) / lasts_s
    since_s = moment_s - time_s[i]
    return StraightMotion(x_m[i] + vx * since_s, y_m[i] + vy * since_s, vx, vy, time_s[i + 1])


@compiled
def knots_of(futures: FuturesColumns) -> PathColumns:
    """Return the knots of all particles as points of paths."""
    return PathColumns(futures.time_s, futures.x_m, futures.y_m)


@compiled
def apart(seen: StraightMotion, other: StraightMotion) -> tuple[Vector, Vector]:
    """Return place and velocity of a body as seen from another one, metres and m/s."""
    offset = (seen.x_m - other.x_m, seen.y_m - other.y_m)
    drift = (seen.vx_mps - other.vx_mps, seen.vy_mps - other.vy_mps)
    return offset, drift


@compiled
def seen_in_flight(
    flight: PathColumns,
    points: Rows,
    futures: FuturesColumns,
    particle: int,
    window: Window,
    radius_m: float,
) -> float:
    """Return the first second at which a flight has a particle within the radius.

    Parameters
    ----------
    points
        The flight's waypoints.
    window
        When the sensor is on; it is off outside the flight.

    Returns
    -------
    float
        Seconds on the target's clock; infinity if never.
    """
    time_s, x_m, y_m, first_knot, gone = futures
    knots, flight_s = PathColumns(time_s, x_m, y_m), flight.time_s
    i, i_end = points
    k, k_end = first_knot[particle], first_knot[particle + 1]
    if k == k_end or i >= i_end:
        return np.inf
    now_s = max(window.from_s, flight_s[i], time_s[k])
    to_s = min(window.to_s, flight_s[i_end - 1])
    if gone[particle]:
        to_s = min(to_s, time_s[k_end - 1])
    if now_s > to_s:
        return np.inf
    i = last_at_or_before(flight_s, i, i_end, now_s)
    k = last_at_or_before(time_s, k, k_end, now_s)
    while True:
        uav = motion_at(flight, i, i_end, now_s)
        seen = motion_at(knots, k, k_end, now_s)
        until_s = min(to_s, uav.until_s, seen.until_s)
        offset, drift = apart(seen, uav)
        after_s = first_within(offset, drift, until_s - now_s, radius_m)
        if after_s < np.inf:
            return float(now_s + after_s)
        if until_s >= to_s:
            return np.inf
        i += uav.until_s <= until_s
        k += seen.until_s <= until_s
        now_s = until_s


@compiled
def seen_by_flight(
    flight: PathColumns, sensor_on: Floats, futures: FuturesColumns, radius_m: float
) -> Floats:
    """Return the first second at which a flight sees each particle, (N,), infinity if never.

    ``sensor_on`` holds from when to when the sensor is on, (S, 2) seconds.
    """
    particles, points = len(futures.gone), Rows(0, len(flight.time_s))
    seen_at = np.full(particles, np.inf)
    for particle in range(particles):
        for s in range(len(sensor_on)):
            window = Window(sensor_on[s, 0], sensor_on[s, 1])
            seen_s = seen_in_flight(flight, points, futures, particle, window, radius_m)
            if seen_s < np.inf:
                seen_at[particle] = seen_s
                break
    return seen_at


@compiled
def caught_at(chaser: Chaser, futures: FuturesColumns) -> Floats:
    """Return when a UAV that chases one particle alone first sees it, (N,), infinity if never."""
    knots, seen_at = knots_of(futures), np.full(len(futures.gone), np.inf)
    for particle in range(len(seen_at)):
        k_end = futures.first_knot[particle + 1]
        for k in range(futures.first_knot[particle], k_end):
            begin_s = max(knots.time_s[k], chaser.take_off_s)
            motion = motion_at(knots, k, k_end, begin_s)
            # One that is gone after its last knot is there for that moment alone.
            is_moment = k + 1 == k_end and futures.gone[particle]
            to_s = knots.time_s[k] if is_moment else motion.until_s
            if begin_s > to_s:
                continue
            offset = (motion.x_m - chaser.x_m, motion.y_m - chaser.y_m)
            reach_m = chaser.radius_m + chaser.speed_mps * (begin_s - chaser.take_off_s)
            drift = (motion.vx_mps, motion.vy_mps)
            after_s = first_in_reach(offset, drift, reach_m, chaser.speed_mps)
            if begin_s + after_s <= to_s:
                seen_at[particle] = begin_s + after_s
                break
    return seen_at
