"""Motion along lines as points in space and time, and the knots that are kept of them; compiled."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.jit import compiled

CURVE_M = 1.5  # from a straight stretch, at most, where speed changes
MOST_PIECES = 32  # of such a change
SAME_M = 1e-6
SAME_S = 1e-6  # points closer in time than that are one
X, Y, AT, TIME = 0, 1, 2, 2


class Lines(NamedTuple):
    """Polylines, one after the other."""

    first_point: Offsets  # (lines + 1,) where a line's points start
    points: Floats  # (P, 3) x, y and how far along the line, as SUMO drives it; metres


class Place(NamedTuple):
    """Where a car is on a line."""

    point: int  # the line's first point ahead, its last one at the end
    at_m: float  # along the line


class Moment(NamedTuple):
    """When a car is somewhere, and how fast."""

    time_s: float
    speed_mps: float


class Trace(NamedTuple):
    """Where a car comes by; room for one car, used again for the next."""

    points: Floats  # (capacity, 3) x, y and time
    used: Offsets  # (1,) how many there are


class Knots(NamedTuple):
    """Columns that knots are laid into."""

    time_s: Floats  # (capacity,)
    x_m: Floats
    y_m: Floats


class Changes(NamedTuple):
    """Columns that changes of edge are laid into."""

    time_s: Floats  # (capacity,)
    edge: Ints


@compiled
def knots_for(capacity: int) -> Knots:
    """Return empty columns."""
    return Knots(np.empty(capacity), np.empty(capacity), np.empty(capacity))


@compiled
def roomier(knots: Knots, used: int, more: int) -> Knots:
    """Return the same knots with room for some more."""
    if used + more <= len(knots.time_s):
        return knots
    new = knots_for(2 * used + more)
    new.time_s[:used] = knots.time_s[:used]
    new.x_m[:used] = knots.x_m[:used]
    new.y_m[:used] = knots.y_m[:used]
    return new


@compiled
def changes_for(capacity: int) -> Changes:
    """Return empty columns."""
    return Changes(np.empty(capacity), np.empty(capacity, np.int32))


@compiled
def more_changes(changes: Changes, used: int, more: int) -> Changes:
    """Return the same changes with room for some more."""
    if used + more <= len(changes.time_s):
        return changes
    new = changes_for(2 * used + more)
    new.time_s[:used] = changes.time_s[:used]
    new.edge[:used] = changes.edge[:used]
    return new


@compiled
def longer(trace: Trace, more: int) -> Trace:
    """Return the same trace with room for some more points."""
    used = trace.used[0]
    if used + more <= len(trace.points):
        return trace
    points = np.empty((2 * used + more, 3))
    points[:used] = trace.points[:used]
    return Trace(points, trace.used)


@compiled
def note(trace: Trace, x_m: float, y_m: float, time_s: float) -> None:
    """Take note of a point."""
    row = trace.points[trace.used[0]]
    row[X], row[Y], row[TIME] = x_m, y_m, time_s
    trace.used[0] += 1


@compiled
def point_at(lines: Lines, point: int, at_m: float) -> tuple[float, float]:
    """Return where a line is at a distance between a point and the one before it."""
    a, b = lines.points[point - 1], lines.points[point]
    step_m = b[AT] - a[AT]
    share = (at_m - a[AT]) / step_m if step_m > 0.0 else 1.0
    return a[X] + (b[X] - a[X]) * share, a[Y] + (b[Y] - a[Y]) * share


@compiled
def after_s(speed_mps: float, accel: float, metres: float) -> float:
    """Return the seconds in which some metres are driven, at an even acceleration."""
    if metres <= 0.0:
        return 0.0
    if accel == 0.0:
        return metres / speed_mps
    root_mps = np.sqrt(max(speed_mps * speed_mps + 2.0 * accel * metres, 0.0))
    return float(2.0 * metres / (root_mps + speed_mps))


@compiled
def drive(
    trace: Trace, lines: Lines, place: Place, to_m: float, moment: Moment, accel: float
) -> tuple[Place, float]:
    """Drive on along a line at an even acceleration, m/s2; return where that ends, and when."""
    point, from_m = place
    time_s, speed_mps = moment
    lasts_s = after_s(speed_mps, accel, to_m - from_m)
    pieces = 1
    if accel != 0.0:
        bends_m = abs(accel) * lasts_s * lasts_s / 8.0
        pieces = max(1, min(int(np.ceil(np.sqrt(bends_m / CURVE_M))), MOST_PIECES))
    for piece in range(1, pieces + 1):
        since_s = lasts_s * piece / pieces
        at_m = to_m
        if piece < pieces:
            at_m = from_m + since_s * (speed_mps + 0.5 * accel * since_s)
        while lines.points[point, AT] < at_m - SAME_M:
            passed = lines.points[point]
            passed_s = time_s + after_s(speed_mps, accel, passed[AT] - from_m)
            note(trace, passed[X], passed[Y], passed_s)
            point += 1
        x_m, y_m = point_at(lines, point, at_m)
        note(trace, x_m, y_m, time_s + since_s)
    return Place(point, to_m), time_s + lasts_s


@compiled
def lay_knots(
    trace: Trace, knots: Knots, used: int, until_s: float, tolerance_m: float
) -> tuple[Knots, int]:
    """Lay knots for a car: of the points of its trace, those that no straight stretch replaces.

    A stretch goes on while it passes all points between within the tolerance, in x and in y each.

    Parameters
    ----------
    used
        The number of knots that are there.
    until_s
        When the last one is laid at the latest.

    Returns
    -------
    knots, used
        The columns, which may have grown, and how many knots they hold.
    """
    count = trace.used[0]
    knots = roomier(knots, used, count)
    x0, y0, t0 = trace.points[0, X], trace.points[0, Y], trace.points[0, TIME]
    knots.x_m[used], knots.y_m[used], knots.time_s[used] = x0, y0, t0
    used += 1
    x1, y1, t1, waits = x0, y0, t0, False  # the point that may yet be skipped
    low_x, high_x, low_y, high_y = -np.inf, np.inf, -np.inf, np.inf
    for i in range(1, count):
        x, y, t = trace.points[i, X], trace.points[i, Y], trace.points[i, TIME]
        if t <= t1 + SAME_S:
            continue
        if t > until_s:
            share = (until_s - t1) / (t - t1)
            x, y, t = x1 + (x - x1) * share, y1 + (y - y1) * share, until_s
            if t <= t1 + SAME_S:
                break
        per_s = 1.0 / (t - t0)
        vx, vy = (x - x0) * per_s, (y - y0) * per_s
        if not (low_x <= vx <= high_x and low_y <= vy <= high_y):
            knots.x_m[used], knots.y_m[used], knots.time_s[used] = x1, y1, t1
            used += 1
            x0, y0, t0 = x1, y1, t1
            low_x, high_x, low_y, high_y = -np.inf, np.inf, -np.inf, np.inf
            per_s = 1.0 / (t - t0)
            vx, vy = (x - x0) * per_s, (y - y0) * per_s
        slack = tolerance_m * per_s
        low_x, high_x = max(low_x, vx - slack), min(high_x, vx + slack)
        low_y, high_y = max(low_y, vy - slack), min(high_y, vy + slack)
        x1, y1, t1, waits = x, y, t, True
        if t >= until_s:
            break
    if waits:
        knots.x_m[used], knots.y_m[used], knots.time_s[used] = x1, y1, t1
        used += 1
    return knots, used
