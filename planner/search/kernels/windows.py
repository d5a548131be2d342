"""When and where particles can be seen by straight flights from one place, compiled.

Whatever their direction, the flights are inside a ring around the place, which grows with the UAV's
speed: a particle can only be seen while the ring passes over it, and only in the directions in
which it then lies.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.kernels.closest_approach import Vector, Window
from planner.jit import compiled
from planner.search.kernels.bearings import (
    both_turns,
    nearest_and_farthest,
    rays_along,
    rays_near,
)
from planner.search.kernels.motion import (
    BEGIN,
    END,
    VX,
    VY,
    ParticleMotion,
    X,
    Y,
    bucket_of,
    farthest_from_spot,
    piece_from,
    place_in,
)
from planner.search.kernels.passages import padded


class Departure(NamedTuple):
    """When and where the UAV sets out."""

    time_s: float
    x_m: float
    y_m: float


class Sensing(NamedTuple):
    """How the UAV sees and flies."""

    radius_m: float
    speed_mps: float  # of the UAV
    in_transit: bool  # the sensor is on between roads too
    rate_per_s: float  # of detection within the radius; infinity: it sees everybody


class Reach(NamedTuple):
    """Generous limits of where anybody can be seen."""

    radius_m: float  # the detection radius, rather too large
    speed_mps: float  # of the UAV, or the highest one of any particle


class PieceAt(NamedTuple):
    """A particle's piece of motion at a time."""

    piece: int
    last: int  # the particle's last piece
    now_s: float


class Facing(NamedTuple):
    """Where a particle can be seen during a window, relative to where the UAV sets out."""

    x_m: float  # middle of a disc outside which no UAV sees the particle meanwhile
    y_m: float
    near_m: float  # its radius
    low: float  # the lowest bearing of all rays near the disc
    wide: float  # and how far on from there they reach


class Windows(NamedTuple):
    """When and where m particles can be seen on any ray."""

    of: Ints  # (m, 2) the particle, and its piece when its window begins
    spans: Floats  # (m, 7) columns as below


ENTER, LEAVE = 0, 1  # from when to when, seconds
MIDDLE_X, MIDDLE_Y, NEAR, LOW, WIDE = 2, 3, 4, 5, 6  # as in ``Facing``


@compiled
def ring_reaches(offset: Vector, drift: Vector, ring_m: float, speed_mps: float) -> float:
    """Return the second from which on a growing circle around the origin has a body inside.

    The circle has radius ``ring_m`` at second 0 and grows with ``speed_mps``, which is more than
    the body's own speed.
    """
    qx, qy = offset
    vx, vy = drift
    c = qx * qx + qy * qy - ring_m * ring_m
    if c <= 0.0:
        return 0.0
    a = speed_mps * speed_mps - vx * vx - vy * vy
    b = ring_m * speed_mps - qx * vx - qy * vy
    return float((np.sqrt(max(0.0, b * b + a * c)) - b) / a)


@compiled
def ring_passes(sensing: Sensing, fastest_mps: float) -> float:
    """Return how long the ring takes at most to pass over a particle, seconds.

    Infinity if particles are about as fast as the UAV: then they may outrun the ring.
    """
    if fastest_mps >= 0.9 * sensing.speed_mps:
        return np.inf
    return 2.0 * padded(sensing.radius_m) / (sensing.speed_mps - fastest_mps)


@compiled
def ring_entry(
    departure: Departure, reach: Reach, pieces: Floats, before: PieceAt
) -> tuple[float, int]:
    """Return when the ring around a transit's UAV has a particle inside it, and its piece then.

    The ring has the UAV's distance from its origin as radius and is one detection radius wide on
    both sides: outside it no transit, whatever its direction, can see the particle.

    Parameters
    ----------
    reach
        With the UAV's speed.
    before
        At a time before which the ring does not have the particle inside.
    """
    start_s, x0, y0 = departure
    reach_m, speed_mps = reach
    k, last, now_s = before
    while k < last:
        x, y = pieces[k + 1, X] - x0, pieces[k + 1, Y] - y0
        ring_m = reach_m + speed_mps * (pieces[k, END] - start_s)
        if x * x + y * y <= ring_m * ring_m:
            break
        now_s = pieces[k, END]
        k += 1
    x, y = place_in(pieces, k, now_s)
    ring_m = reach_m + speed_mps * (now_s - start_s)
    drift = (pieces[k, VX], pieces[k, VY])
    return now_s + ring_reaches((x - x0, y - y0), drift, ring_m, speed_mps), k


@compiled
def facing(departure: Departure, pieces: Floats, k: int, window: Window, reach: Reach) -> Facing:
    """Return which directions a particle can be seen in during a window.

    Parameters
    ----------
    k
        The particle's piece at the window's start.
    reach
        With the highest speed of any particle.
    """
    enter_s, leave_s = window
    half_s = 0.5 * (leave_s - enter_s)
    if leave_s <= pieces[k, END]:
        x, y = place_in(pieces, k, enter_s + half_s)
        speed_mps = np.sqrt(pieces[k, VX] * pieces[k, VX] + pieces[k, VY] * pieces[k, VY])
        near_m = reach.radius_m + half_s * speed_mps
    else:
        x, y = place_in(pieces, k, enter_s)
        near_m = reach.radius_m + 2.0 * half_s * reach.speed_mps
    dx, dy = x - departure.x_m, y - departure.y_m
    low, wide = rays_near(dx, dy, near_m)
    return Facing(dx, dy, near_m, low, wide)


@compiled
def while_in_ring(
    departure: Departure, reach: Reach, pieces: Floats, k: int, span: Window
) -> Window:
    """Return when the ring may have a particle inside during a part of its piece; may be empty."""
    start_s, x0, y0 = departure
    from_s, to_s = span
    for _ in range(3):  # the shorter the way, the better is known how near it is
        if from_s > to_s:
            break
        (x, y), (fx, fy) = place_in(pieces, k, from_s), place_in(pieces, k, to_s)
        near_m, far_m = nearest_and_farthest((x - x0, y - y0), (fx - x0, fy - y0))
        from_s = max(from_s, start_s + (near_m - reach.radius_m) / reach.speed_mps)
        to_s = min(to_s, start_s + (far_m + reach.radius_m) / reach.speed_mps)
    return Window(from_s, to_s)


@compiled
def stay_in_ring(
    departure: Departure,
    reach: Reach,
    motion: ParticleMotion,
    who: int,
    before: PieceAt,
    over_s: float,
) -> tuple[Window, int, Facing]:
    """Return from when to when the ring may have a particle inside, and where it is meanwhile.

    As ``ring_entry``, for particles that may be as fast as the ring or jump. The window is empty
    if the ring never has it inside; else the piece is that at its start.

    Parameters
    ----------
    reach
        With the UAV's speed.
    over_s
        Until when to look, seconds; finite.
    """
    start_s, x0, y0 = departure
    reach_m, speed_mps = reach
    pieces, ahead_m = motion.pieces, motion.ahead_m[who]
    k, last, now_s = before
    enter_s, leave_s, entered, low, wide = np.inf, -np.inf, k, 0.0, -1.0
    west, east, south, north = np.inf, -np.inf, np.inf, -np.inf
    while now_s <= over_s:
        x, y = place_in(pieces, k, now_s)
        away_m = np.sqrt((x - x0) * (x - x0) + (y - y0) * (y - y0))
        beyond_m = away_m - speed_mps * (now_s - start_s)
        if beyond_m < -reach_m - ahead_m:
            break  # it never catches up with the ring again
        if beyond_m > reach_m + ahead_m + 1.0:
            now_s += (beyond_m - reach_m - ahead_m) / (speed_mps + motion.pace_mps)
            k = piece_from(pieces, max(k, motion.clock[bucket_of(motion, now_s), who]), last, now_s)
            continue
        span = Window(now_s, min(pieces[k, END], over_s))
        from_s, to_s = while_in_ring(departure, reach, pieces, k, span)
        if from_s <= to_s:
            if enter_s == np.inf:
                enter_s, entered = from_s, k
            leave_s = to_s
            (x, y), (fx, fy) = place_in(pieces, k, from_s), place_in(pieces, k, to_s)
            west, east = min(west, x, fx), max(east, x, fx)
            south, north = min(south, y, fy), max(north, y, fy)
            near, far = (x - x0, y - y0), (fx - x0, fy - y0)
            nearest_m, _ = nearest_and_farthest(near, far)
            low, wide = both_turns(low, wide, *rays_along(near, far, nearest_m, reach_m))
        if k == last:
            break
        k += 1
        now_s = pieces[k, BEGIN]
    width, height = east - west, north - south
    around_m = reach_m + 0.5 * np.sqrt(width * width + height * height)
    dx, dy = 0.5 * (west + east) - x0, 0.5 * (south + north) - y0
    return Window(enter_s, leave_s), entered, Facing(dx, dy, around_m, low, wide)


@compiled
def all_windows(
    departure: Departure, over_s: float, miss: Floats, motion: ParticleMotion, sensing: Sensing
) -> tuple[Ints, Windows]:
    """Return who is seen at once, and when and where others can be seen on any ray until a time.

    A sensor that may miss sees nobody at once; whoever is there has a window from the start on.

    Only particles that may be unseen still, with ``miss`` (N,) above 0, are looked for.

    Returns
    -------
    here, windows
        The particles within the radius, and the windows of the others.
    """
    pieces, first_piece, end_s, clock = motion[:4]
    fastest_mps = motion.fastest_mps
    start_s, x0, y0 = departure
    radius_m, speed_mps, _, rate_per_s = sensing
    reach_m = padded(radius_m)
    here, at_once = np.empty(len(miss), dtype=np.int32), 0
    of, count = np.empty((len(miss), 2), dtype=np.int64), 0
    spans = np.empty((len(miss), 7))
    row, passes_s = bucket_of(motion, start_s), ring_passes(sensing, fastest_mps)
    now_in, spots_m, span = clock[row], motion.spots_m[row], Window(start_s, over_s)
    far_m = reach_m + speed_mps * (over_s - start_s) + farthest_from_spot(motion, row, span)
    for p in range(len(miss)):
        if not miss[p] > 0.0 or end_s[p] < start_s:
            continue
        dx, dy, most_m = spots_m[p, 0] - x0, spots_m[p, 1] - y0, far_m + motion.ahead_m[p]
        if dx * dx + dy * dy > most_m * most_m:  # most particles are nowhere near
            continue
        last = first_piece[p + 1] - 1
        k = piece_from(pieces, now_in[p], last, start_s)
        enter_s, to_s = max(start_s, pieces[k, BEGIN]), min(over_s, end_s[p])
        x, y = place_in(pieces, k, enter_s)
        away_m = np.sqrt((x - x0) * (x - x0) + (y - y0) * (y - y0))
        if away_m <= radius_m and enter_s == start_s and rate_per_s == np.inf:
            here[at_once] = p
            at_once += 1
            continue
        if passes_s < np.inf:
            outside_m = away_m - reach_m - speed_mps * (enter_s - start_s)
            enter_s += max(0.0, outside_m) / (speed_mps + fastest_mps)  # earlier is impossible
            if enter_s > to_s:
                continue
            if pieces[k, END] <= enter_s:
                k = max(k, clock[bucket_of(motion, enter_s), p])
                k = piece_from(pieces, k, last, enter_s)
            reach, before = Reach(reach_m, speed_mps), PieceAt(k, last, enter_s)
            enter_s, k = ring_entry(departure, reach, pieces, before)
            window = Window(enter_s, enter_s + passes_s)
            ahead = facing(departure, pieces, k, window, Reach(reach_m, fastest_mps))
            leave_s = min(to_s, enter_s + passes_s)
        else:
            reach, before = Reach(reach_m, speed_mps), PieceAt(k, last, enter_s)
            window, k, ahead = stay_in_ring(departure, reach, motion, p, before, to_s)
            enter_s, leave_s = window
        if enter_s <= to_s:
            of[count, 0], of[count, 1] = p, k
            spans[count, ENTER], spans[count, LEAVE] = enter_s, leave_s
            spans[count, MIDDLE_X], spans[count, MIDDLE_Y] = ahead.x_m, ahead.y_m
            spans[count, NEAR] = ahead.near_m
            spans[count, LOW], spans[count, WIDE] = ahead.low, ahead.wide
            count += 1
    return here[:at_once], Windows(of[:count], spans[:count])
