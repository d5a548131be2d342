"""A flight with fewer waypoints, at no time farther from where it was than a tolerance."""

from collections.abc import Callable, Collection
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from planner.arrays import Floats, Ints
from planner.flight.track import Track

Clear: TypeAlias = Callable[[Floats, Floats], bool]  # whether one may fly straight between places

PART_OF_RADIUS = 1 / 6  # of the sensor's: bends that stay within are not told to people


def told_knots(track: Track, radius_m: float) -> Ints:
    """Return the knots of a flight that people are told: those where it stays, and real bends.

    Parameters
    ----------
    radius_m
        How far the sensor sees.
    """
    places = np.stack([track.x_m, track.y_m], axis=1)
    stays = np.flatnonzero(np.all(np.diff(places, axis=0) == 0.0, axis=1))
    holds = np.union1d(stays, stays + 1).tolist()
    return kept_knots(track.time_s, places, PART_OF_RADIUS * radius_m, holds=holds)


def kept_knots(
    time_s: Floats,
    xy_m: Floats,
    tolerance_m: float,
    *,
    holds: Collection[int] = (),
    clear: Clear | None = None,
) -> Ints:
    """Return which knots of a flight to keep, rising indices with the first and the last.

    Between knots that stay, that one is kept too which lies farthest off straight, even motion,
    until none lies farther off than the tolerance (Ramer, Douglas and Peucker, in space and time:
    Meratnia and de By 2004, "Spatiotemporal compression techniques for moving point objects").

    Parameters
    ----------
    time_s, xy_m
        (K,) seconds that never fall, and (K, 2) metres; between them it moves straight and evenly.
    holds
        Knots that stay whatever the tolerance.
    clear
        If given, what is left out is flown around where the straight way is not clear.
    """
    kept = sorted({0, len(time_s) - 1, *holds})
    open_ = list(pairwise(kept))
    while open_:
        a, b = open_.pop()
        if b - a < 2:
            continue
        off_m = _off_m(time_s[a : b + 1], xy_m[a : b + 1])
        if off_m.max() <= tolerance_m and (clear is None or clear(xy_m[a], xy_m[b])):
            continue
        worst = a + 1 + int(np.argmax(off_m))
        kept.append(worst)
        open_ += [(a, worst), (worst, b)]
    return np.array(sorted(kept), dtype=np.int64)


def _off_m(time_s: Floats, xy_m: Floats) -> Floats:
    """Return how far the inner knots are from where even motion is at their times, metres."""
    lasts_s = float(time_s[-1] - time_s[0])
    share = (time_s[1:-1] - time_s[0]) / lasts_s if lasts_s > 0.0 else np.zeros(len(time_s) - 2)
    even_m = xy_m[0] + share[:, None] * (xy_m[-1] - xy_m[0])
    return np.asarray(np.hypot(*(xy_m[1:-1] - even_m).T))
