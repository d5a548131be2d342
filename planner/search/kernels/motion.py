"""How the particles move, laid out for what-if flights; compiled.

Each knot's piece of straight motion is one row with its velocity, so that no flight has to divide;
and a clock tells near which piece each particle is at a time, so that no flight has to search.
"""

from typing import TypeAlias

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import FuturesColumns, first_within, piece_at
from planner.jit import compiled

# pieces (K, 6) as below; first_piece (N + 1,); end_s (N,), from when on a particle is nowhere
# (inf: it rests where it ends, -inf: it is never anywhere); clock (B, N), the piece in which each
# particle is at first_s + b step_s; first_s, step_s; the highest speed, m/s (inf: one jumps).
Motion: TypeAlias = tuple[Floats, Offsets, Floats, Ints, float, float, float]
# place x, y at a time, velocity x, y, and the time
Straight: TypeAlias = tuple[float, float, float, float, float]

X, Y, VX, VY, BEGIN, END = 0, 1, 2, 3, 4, 5  # place and velocity at second BEGIN, and last second


@compiled
def nothing() -> int:
    """Return 0 as a number like any other: a function is compiled once more for each literal."""
    return int(np.int64(0))


@compiled
def fastest(futures: FuturesColumns) -> float:
    """Return the highest speed of any particle, m/s; infinity if one jumps."""
    time_s, x_m, y_m, first_knot, _ = futures
    highest = 0.0
    for particle in range(len(first_knot) - 1):
        for k in range(first_knot[particle], first_knot[particle + 1] - 1):
            way_m = np.hypot(x_m[k + 1] - x_m[k], y_m[k + 1] - y_m[k])
            if way_m > 0.0:
                highest = max(highest, way_m / max(0.0, time_s[k + 1] - time_s[k]))
    return highest


@compiled
def motion_of(futures: FuturesColumns) -> Motion:
    """Return the motion of all particles; memory and time are linear in their knots."""
    time_s, x_m, y_m, first_knot, gone = futures
    many, knots = len(gone), len(time_s)
    pieces, end_s = np.empty((knots, 6)), np.full(many, -np.inf)
    for who in range(many):
        k_end = first_knot[who + 1]
        for k in range(first_knot[who], k_end):
            x, y, vx, vy, until_s = piece_at((time_s, x_m, y_m), k, k_end, time_s[k])
            pieces[k, X], pieces[k, Y], pieces[k, VX], pieces[k, VY] = x, y, vx, vy
            pieces[k, BEGIN], pieces[k, END] = time_s[k], until_s
            end_s[who] = until_s
        if first_knot[who] < k_end and gone[who]:
            end_s[who] = time_s[k_end - 1]
    first_s, last_s = np.inf, -np.inf
    for k in range(knots):
        first_s, last_s = min(first_s, time_s[k]), max(last_s, time_s[k])
    step_s = max(last_s - first_s, 0.0) * many / (knots + 1.0) + 1.0
    clock = np.zeros((knots // max(many, 1) + 1, many), dtype=np.int32)
    for who in range(many):
        k = first_knot[who]
        for b in range(len(clock)):
            while k + 1 < first_knot[who + 1] and pieces[k, END] <= first_s + b * step_s:
                k += 1
            clock[b, who] = k
    return pieces, first_knot, end_s, clock, first_s, step_s, fastest(futures)


@compiled
def bucket_of(motion: Motion, moment_s: float) -> int:
    """Return the last row of the clock at or before a moment, or the first one."""
    last = len(motion[3]) - 1
    return int(min(max((moment_s - motion[4]) / motion[5], 0.0), last))


@compiled
def piece_from(pieces: Floats, k: int, last: int, moment_s: float) -> int:
    """Return the piece in which a particle is at a moment, looking from one of its pieces on."""
    while k < last and pieces[k, END] <= moment_s:
        k += 1
    return k


@compiled
def place_in(pieces: Floats, k: int, moment_s: float) -> tuple[float, float]:
    """Return where a piece is at a moment, x and y."""
    since_s = moment_s - pieces[k, BEGIN]
    return pieces[k, X] + pieces[k, VX] * since_s, pieces[k, Y] + pieces[k, VY] * since_s


@compiled
def met(
    flight: Straight, window: tuple[float, float], pieces: Floats, k: int, radius_m: float
) -> float:
    """Return the first second at which a straight flight has a particle within the radius.

    Parameters
    ----------
    window
        Seconds from and to between which the sensor is on and the particle somewhere.
    k
        The particle's piece at the window's start.

    Returns
    -------
    float
        Infinity if never.
    """
    x, y, vx, vy, at_s = flight
    now_s, to_s = window
    while True:
        until_s = min(to_s, pieces[k, END])
        since_s, flown_s = now_s - pieces[k, BEGIN], now_s - at_s
        offset = (
            pieces[k, X] + pieces[k, VX] * since_s - x - vx * flown_s,
            pieces[k, Y] + pieces[k, VY] * since_s - y - vy * flown_s,
        )
        drift = (pieces[k, VX] - vx, pieces[k, VY] - vy)
        after_s = first_within(offset, drift, until_s - now_s, radius_m)
        if after_s < np.inf:
            return now_s + after_s
        if until_s >= to_s:
            return np.inf
        now_s = until_s
        k += 1
