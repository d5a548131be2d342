"""The line that a planned track draws: its corners, and how long it hovers where."""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Ints
from planner.flight.airspace import Airspace
from planner.flight.law import FlightLaw
from planner.flight.plan import ROUNDING_S, FlownLeg
from planner.flight.track import Track


class DrawnLine(NamedTuple):
    """The waypoints of a planned track."""

    time_s: Floats  # (W,) seconds, when it was planned to arrive
    xy_m: Floats  # (W, 2) metres
    hold_s: Floats  # (W,) seconds of hovering there


def drawn_line(
    track: Track, legs: tuple[FlownLeg, ...], law: FlightLaw, airspace: Airspace | None = None
) -> DrawnLine:
    """Return a track's waypoints, less bends that the aircraft passes closely without them.

    A curve drawn by many points that turn little each would else be flown at any speed.
    """
    xy_m = np.stack([track.x_m, track.y_m], axis=1)
    stays = np.append(False, np.all(np.diff(xy_m, axis=0) == 0.0, axis=1))
    waits_s = np.where(stays, np.append(0.0, np.diff(track.time_s)), 0.0)
    line = _apart(DrawnLine(track.time_s, xy_m, np.where(waits_s < ROUNDING_S, 0.0, waits_s)))
    if math.isinf(law.corner_m):
        return line
    ends_s = [time_s for leg in legs for time_s in (leg.start_s, leg.end_s)]
    stay = (line.hold_s > 0.0) | np.isin(line.time_s, ends_s)
    kept = needed(line.xy_m, stay, law.corner_m, airspace)
    return _apart(DrawnLine(*(column[kept] for column in line)))


def stops_of(track: Track, law: FlightLaw, *, lands: bool) -> Floats:
    """Return where a real aircraft goes once it is up, (W, 3): x, y, seconds of hovering there.

    Parameters
    ----------
    track
        As the aircraft flies it, from lift-off.
    lands
        Whether it ends with the way home, which is left out.
    """
    _, xy_m, hold_s = drawn_line(track, (), law)
    stops = np.column_stack([xy_m, hold_s])
    stops[0, 2] = max(0.0, stops[0, 2] - law.climb_s)
    stops = stops[:-1] if lands and len(stops) > 1 else stops
    return stops[0 if stops[0, 2] > ROUNDING_S else 1 :]


def _apart(line: DrawnLine) -> DrawnLine:
    """Return a line in which no two neighbours are one place; they hover as long together."""
    moves = np.append(True, np.any(np.diff(line.xy_m, axis=0) != 0.0, axis=1))
    hold_s = np.zeros(int(moves.sum()))
    np.add.at(hold_s, np.cumsum(moves) - 1, line.hold_s)
    return DrawnLine(line.time_s[moves], line.xy_m[moves], hold_s)


def needed(xy_m: Floats, stay: Flags, off_m: float, airspace: Airspace | None = None) -> Ints:
    """Return which places of a line to keep, so that it stays within a distance of all of them.

    Rising indices, with the first and the last, and those that shall stay. What is left out is
    passed in order (Ramer 1972, Douglas and Peucker 1973), and straight flight is in the airspace.
    """
    kept = sorted({0, len(xy_m) - 1, *np.flatnonzero(stay).tolist()})
    open_ = list(pairwise(kept))
    while open_:
        a, b = open_.pop()
        if b - a < 2:
            continue
        away_m = _beside_m(xy_m[a + 1 : b], xy_m[a], xy_m[b])
        worst = a + 1 + int(np.argmax(away_m))
        if away_m[worst - a - 1] > off_m or not _is_clear(airspace, xy_m[a], xy_m[b]):
            kept.append(worst)
            open_ += [(a, worst), (worst, b)]
    return np.array(sorted(kept), dtype=np.int64)


def _is_clear(airspace: Airspace | None, start: Floats, end: Floats) -> bool:
    if airspace is None:
        return True
    (a, b), (c, d) = start.tolist(), end.tolist()
    return airspace.sees((a, b), (c, d))


def _beside_m(places: Floats, start: Floats, end: Floats) -> Floats:
    """Return how far places are from a straight flight, (k,) metres."""
    way = end - start
    length2 = float(way @ way)
    share = np.clip((places - start) @ way / length2, 0.0, 1.0) if length2 > 0.0 else 0.0
    return np.asarray(np.hypot(*(places - start - np.multiply.outer(share, way)).T))
