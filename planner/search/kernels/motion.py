"""How the particles move, laid out for what-if flights; compiled.

Each knot's piece of straight motion is one row with its velocity, so that no flight has to divide;
and a clock tells near which piece each particle is at a time, so that no flight has to search.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from planner.arrays import Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import (
    FuturesColumns,
    Vector,
    Window,
    first_within,
)
from planner.jit import compiled

Singles = npt.NDArray[np.float32]


class ParticleMotion(NamedTuple):
    """How all particles move."""

    pieces: Floats  # (K, 6) columns as below; the last piece of a particle never ends
    first_piece: Offsets  # (N + 1,)
    # (N,) seconds, from when on a particle is nowhere; inf: it rests where it ends, -inf: it is
    # never anywhere
    end_s: Floats
    clock: Ints  # (B, N) the piece in which each particle is at second first_s + b * step_s
    first_s: float
    step_s: float
    spots_m: Singles  # (B, N, 2) where each particle is then, or begins later; single precision
    fastest_mps: float  # highest speed of any particle; inf: one jumps
    # in t seconds particle i gets at most pace_mps * t + ahead_m[i] far
    pace_mps: float
    ahead_m: Floats  # (N,)


class Course(NamedTuple):
    """A straight flight: where the UAV is at a time, and its velocity."""

    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    at_s: float


X, Y, VX, VY, BEGIN, END = 0, 1, 2, 3, 4, 5  # place and velocity at second BEGIN, and last second


@compiled
def zero() -> int:
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
def ahead_of(pieces: Floats, first_piece: Offsets, pace_mps: float) -> Floats:
    """Return how far each particle gets beyond a pace in the times when it is faster, (N,) m."""
    ahead_m = np.zeros(len(first_piece) - 1)
    for who in range(len(ahead_m)):
        for k in range(first_piece[who], first_piece[who + 1] - 1):
            way_m = np.hypot(pieces[k + 1, X] - pieces[k, X], pieces[k + 1, Y] - pieces[k, Y])
            ahead_m[who] += max(0.0, way_m - pace_mps * (pieces[k, END] - pieces[k, BEGIN]))
    return ahead_m


@compiled
def motion_of(futures: FuturesColumns, straight: Floats, pace_mps: float) -> ParticleMotion:
    """Return the motion of all particles; memory and time are linear in their knots.

    Parameters
    ----------
    straight
        The futures' pieces of straight motion, (K, 6) columns as above.
    pace_mps
        Beside which the way of each particle is told, m/s.
    """
    time_s, first_knot = futures.time_s, futures.first_knot
    many, knots = len(futures.gone), len(time_s)
    pieces, end_s = straight.copy(), np.full(many, -np.inf)
    for who in range(many):
        last = first_knot[who + 1] - 1
        if last >= first_knot[who]:
            end_s[who], pieces[last, END] = straight[last, END], np.inf
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
    return ParticleMotion(
        pieces,
        first_knot,
        end_s,
        clock,
        first_s,
        step_s,
        spots_of(pieces, first_knot, clock, first_s, step_s),
        fastest(futures),
        pace_mps,
        ahead_of(pieces, first_knot, pace_mps),
    )


@compiled
def spots_of(
    pieces: Floats, first_piece: Offsets, clock: Ints, first_s: float, step_s: float
) -> Singles:
    """Return where the particles are at each of the clock's times, (B, N, 2) metres."""
    spots_m = np.zeros((len(clock), len(first_piece) - 1, 2), dtype=np.float32)
    for b in range(len(clock)):
        for who in range(len(first_piece) - 1):
            if first_piece[who] < first_piece[who + 1]:
                k = clock[b, who]
                x, y = place_in(pieces, k, max(pieces[k, BEGIN], first_s + b * step_s))
                spots_m[b, who, 0], spots_m[b, who, 1] = x, y
    return spots_m


@compiled
def farthest_from_spot(motion: ParticleMotion, row: int, span: Window) -> float:
    """Return how far from its spot a particle gets at its pace until both ends of a span, m.

    With room for what single precision loses.
    """
    moment_s = motion.first_s + row * motion.step_s
    return 1.0 + motion.pace_mps * max(abs(span.from_s - moment_s), abs(span.to_s - moment_s))


@compiled
def bucket_of(motion: ParticleMotion, moment_s: float) -> int:
    """Return the last row of the clock at or before a moment, or the first one."""
    last = len(motion.clock) - 1
    return int(min(max((moment_s - motion.first_s) / motion.step_s, 0.0), last))


@compiled
def piece_from(pieces: Floats, k: int, last: int, moment_s: float) -> int:
    """Return the piece in which a particle is at a moment, looking from one of its pieces on."""
    while k < last and pieces[k, END] <= moment_s:
        k += 1
    return k


@compiled
def place_in(pieces: Floats, k: int, moment_s: float) -> Vector:
    """Return where a piece is at a moment, x and y."""
    since_s = moment_s - pieces[k, BEGIN]
    return pieces[k, X] + pieces[k, VX] * since_s, pieces[k, Y] + pieces[k, VY] * since_s


@compiled
def first_meeting(course: Course, window: Window, pieces: Floats, k: int, radius_m: float) -> float:
    """Return the first second at which a straight flight has a particle within the radius.

    Parameters
    ----------
    window
        When the sensor is on and the particle somewhere.
    k
        The particle's piece at the window's start.

    Returns
    -------
    float
        Infinity if never.
    """
    x, y, vx, vy, at_s = course
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
            return float(now_s + after_s)
        if until_s >= to_s:
            return np.inf
        now_s = until_s
        k += 1
