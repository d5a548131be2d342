"""Closest approach of two straight motions, and its sweep along whole flights; compiled.

Flights and futures are handed over as plain tuples of columns: a flight as
``(time_s, x_m, y_m)``, futures as ``(time_s, x_m, y_m, first_knot, gone)``.
"""

from typing import TypeAlias

import numpy as np

from planner.arrays import Flags, Floats, Offsets
from planner.jit import compiled

FlightColumns: TypeAlias = tuple[Floats, Floats, Floats]
FuturesColumns: TypeAlias = tuple[Floats, Floats, Floats, Offsets, Flags]
Piece: TypeAlias = tuple[float, float, float, float, float]


@compiled
def first_within(
    offset: tuple[float, float], drift: tuple[float, float], duration_s: float, radius_m: float
) -> float:
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
def first_in_reach(
    offset: tuple[float, float], drift: tuple[float, float], reach_m: float, speed_mps: float
) -> float:
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
def piece_at(columns: FlightColumns, i: int, end: int, moment_s: float) -> Piece:
    """Return place, velocity and end of the motion from point ``i`` on: x, y, vx, vy, until_s.

    The place is that at ``moment_s``, at or after the point's time. The last point, ``end - 1``,
    rests without end.
    """
    time_s, x_m, y_m = columns
    if i + 1 >= end:
        return x_m[i], y_m[i], 0.0, 0.0, np.inf
    lasts_s = time_s[i + 1] - time_s[i]
    if lasts_s <= 0.0:
        return x_m[i], y_m[i], 0.0, 0.0, time_s[i + 1]
    vx = (x_m[i + 1] - x_m[i]) / lasts_s
    vy = (y_m[i + 1] - y_m[i]) / lasts_s
    since_s = moment_s - time_s[i]
    return x_m[i] + vx * since_s, y_m[i] + vy * since_s, vx, vy, time_s[i + 1]


@compiled
def seen_in_flight(
    flight: FlightColumns,
    points: tuple[int, int],
    futures: FuturesColumns,
    particle: int,
    window: tuple[float, float],
    radius_m: float,
) -> float:
    """Return the first second at which a flight has a particle within the radius.

    Parameters
    ----------
    points
        The flight's waypoints: indices from (included) to (excluded).
    window
        Seconds from and to between which the sensor is on; it is off outside the flight.

    Returns
    -------
    float
        Seconds on the target's clock; infinity if never.
    """
    time_s, x_m, y_m, first_knot, gone = futures
    i, i_end = points
    k, k_end = first_knot[particle], first_knot[particle + 1]
    if k == k_end or i >= i_end:
        return np.inf
    now_s = max(window[0], flight[0][i], time_s[k])
    to_s = min(window[1], flight[0][i_end - 1])
    if gone[particle]:
        to_s = min(to_s, time_s[k_end - 1])
    if now_s > to_s:
        return np.inf
    i = last_at_or_before(flight[0], i, i_end, now_s)
    k = last_at_or_before(time_s, k, k_end, now_s)
    while True:
        ux, uy, uvx, uvy, u_until_s = piece_at(flight, i, i_end, now_s)
        px, py, pvx, pvy, p_until_s = piece_at((time_s, x_m, y_m), k, k_end, now_s)
        until_s = min(to_s, u_until_s, p_until_s)
        after_s = first_within(
            (px - ux, py - uy), (pvx - uvx, pvy - uvy), until_s - now_s, radius_m
        )
        if after_s < np.inf:
            return now_s + after_s
        if until_s >= to_s:
            return np.inf
        i += u_until_s <= until_s
        k += p_until_s <= until_s
        now_s = until_s


@compiled
def seen_by_flight(
    flight: FlightColumns, sensor_on: Floats, futures: FuturesColumns, radius_m: float
) -> Floats:
    """Return the first second at which a flight sees each particle, (N,), infinity if never."""
    particles = len(futures[3]) - 1
    seen_at = np.full(particles, np.inf)
    for particle in range(particles):
        for s in range(len(sensor_on)):
            window = (sensor_on[s, 0], sensor_on[s, 1])
            seen = seen_in_flight(flight, (0, len(flight[0])), futures, particle, window, radius_m)
            if seen < np.inf:
                seen_at[particle] = seen
                break
    return seen_at
