"""What an aircraft flies that cannot hover: circles where others wait, and around tight corners.

At a corner it either flies past, within `corner_m` of it, or over it and around: a little towards
the new direction, most of a circle the other way, and a little back, which ends where it began
with the new heading. That is the shortest way to turn on the spot (Dubins 1957, "On curves of
minimal length with a constraint on average curvature"). Circles are drawn as polygons.
"""

import math
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.flight.law import FlightLaw
from planner.flight.simplified import kept_knots

STEP = math.pi / 6  # by which a polygon turns at each of its corners, at most
LONGEST_TURN = 7.0 * math.pi / 3.0  # the angle flown to turn back on the spot
NO_TURN = 1e-9


class Turned(NamedTuple):
    """A line with circles, and where the waypoints of the given line are in it."""

    xy_m: Floats  # (V, 2) metres
    hold_s: Floats  # (V,) seconds that it hovers; nothing but 0 if it cannot
    arrives: Ints  # (W,) index of where it first is at each given waypoint
    leaves: Ints  # (W,) and of where it is last


def turned(xy_m: Floats, hold_s: Floats, law: FlightLaw) -> Turned:
    """Return a line as an aircraft can fly it: unchanged if that can hover.

    Parameters
    ----------
    xy_m, hold_s
        As `planner.flight.law.timed` takes them; waits become the nearest number of circles.
    """
    if law.can_hover:
        index = np.arange(len(xy_m))
        return Turned(xy_m, hold_s, index, index)
    steps = np.diff(xy_m, axis=0)
    heading = np.arctan2(steps[:, 1], steps[:, 0]).tolist() or [0.0]
    length_m = np.hypot(steps[:, 0], steps[:, 1]).tolist()
    circle_s = 2.0 * math.pi * law.turn_radius_m / law.speed_mps
    step = _step(law)
    chord_m = 2.0 * law.turn_radius_m * math.sin(step / 2.0)
    line: list[tuple[float, float]] = []
    arrives, leaves = [], []
    for k, place in enumerate(xy_m):
        before, after = heading[max(k - 1, 0)], heading[min(k, len(heading) - 1)]
        around = round(float(hold_s[k]) / circle_s) * [2.0 * math.pi]
        if 0 < k < len(length_m):
            # The last side of a circle leads a little the other way, and is a short piece.
            behind = step / 2.0 if around else 0.0
            room_m = min(length_m[k - 1 : k + 1] + [chord_m] * bool(around)) / 2.0
            if not _passes(after - before + behind, room_m, law):
                around += _on_the_spot(after - before)
        arrives.append(len(line))
        line += [(float(place[0]), float(place[1])), *_arcs(place, before, around, law)]
        leaves.append(len(line) - 1)
    return Turned(np.array(line), np.zeros(len(line)), np.array(arrives), np.array(leaves))


def room_m(law: FlightLaw) -> float:
    """Return how far beside a line it may be, metres, where it circles or flies past corners."""
    return 0.0 if law.can_hover else (1.0 + math.sqrt(3.0)) * law.turn_radius_m + law.corner_m


def merged(xy_m: Floats, hold_s: Floats, law: FlightLaw) -> Ints:
    """Return which waypoints an aircraft keeps that passes them within `corner_m`, (K,) indices.

    All of them if it can hover; else short pieces become longer ones, which it can fly.
    """
    if law.can_hover or len(xy_m) < 3:
        return np.arange(len(xy_m))
    along_m = np.append(0.0, np.cumsum(np.hypot(*np.diff(xy_m, axis=0).T)))
    kept = kept_knots(along_m, xy_m, law.corner_m, holds=np.flatnonzero(hold_s > 0.0).tolist())
    moves = np.append(True, np.any(np.diff(xy_m[kept], axis=0) != 0.0, axis=1))
    return np.asarray(kept[moves])


def tight_corners(xy_m: Floats, law: FlightLaw) -> int:
    """Return at how many corners of a line it would have to be slower than it can."""
    steps = np.diff(xy_m, axis=0)
    unit = steps / np.hypot(steps[:, 0], steps[:, 1])[:, None]
    cosines = np.sum(unit[1:] * unit[:-1], axis=1).tolist()
    return sum(law.corner_speed_mps(one) < law.least_ground_mps for one in cosines)


def _passes(turn: float, room_m: float, law: FlightLaw) -> bool:
    """Return whether it can fly past a corner, on an arc that begins no farther away than that."""
    half = abs(math.remainder(turn, 2.0 * math.pi)) / 2.0
    if half < NO_TURN:
        return True
    if law.corner_speed_mps(math.cos(turn)) < law.least_ground_mps:
        return False
    return law.least_radius_m * math.tan(half) <= room_m


def _on_the_spot(turn: float) -> list[float]:
    """Return the arcs, radians to the left, that end where they began with another heading."""
    turn = math.remainder(turn, 2.0 * math.pi)
    side, angle = math.copysign(1.0, turn), abs(turn)
    between = 2.0 * math.asin(math.sin(angle / 2.0) / 2.0)
    aside = (angle - between) / 2.0
    return [side * aside, side * (between - 2.0 * math.pi), side * aside]


def _step(law: FlightLaw) -> float:
    """Return by how much a circle's polygon turns at a corner, so that it keeps its speed there."""
    radius_m = law.turn_radius_m
    return min(STEP, 2.0 * math.acos(radius_m / (radius_m + law.corner_m)))


def _arcs(
    place: Floats, heading: float, around: list[float], law: FlightLaw
) -> list[tuple[float, float]]:
    """Return the corners of arcs flown from a place back to it, metres, without the first.

    Parameters
    ----------
    heading
        In which it sets out, radians from east to north.
    around
        By how much it turns to the left on each arc, radians.
    """
    found: list[tuple[float, float]] = []
    x_m, y_m = place.tolist()
    for angle in around:
        many = max(1, math.ceil(abs(angle) / _step(law) - NO_TURN))
        half = angle / many / 2.0
        chord_m = 2.0 * law.turn_radius_m * abs(math.sin(half))
        for _ in range(many):
            heading += half
            x_m, y_m = x_m + chord_m * math.cos(heading), y_m + chord_m * math.sin(heading)
            heading += half
            found.append((x_m, y_m))
    if found:
        found[-1] = (float(place[0]), float(place[1]))  # but for rounding
    return found
