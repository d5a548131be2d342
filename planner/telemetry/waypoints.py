"""A table of waypoints with their times, as an aircraft flies from one to the next."""

import numpy as np

from planner.arrays import Floats
from planner.flight.as_flown import track_points
from planner.flight.law import FlightLaw, timed

SAME_M = 1e-3  # waypoints as near are one place


def between(
    arrives_s: Floats, hold_s: Floats, xy_m: Floats, law: FlightLaw
) -> tuple[Floats, Floats]:
    """Return times, (T,) seconds, and places, (T, 2) metres, of a flight over waypoints.

    It is at each when the table says. How it speeds up and brakes in between, nobody has recorded:
    that is as the law has it.

    Parameters
    ----------
    arrives_s, hold_s, xy_m
        (W,) seconds, never falling, for how long it stays there, and (W, 2) metres.
    """
    leaves_s = arrives_s + np.maximum(np.nan_to_num(hold_s), 0.0)
    leaves_s[:-1] = np.minimum(leaves_s[:-1], arrives_s[1:])
    first = np.append(True, np.hypot(*np.diff(xy_m, axis=0).T) > SAME_M)
    last = np.append(first[1:], True)
    arrives_s, leaves_s, xy_m = arrives_s[first], leaves_s[last], xy_m[first]
    told_s = np.stack([arrives_s, leaves_s], axis=1).ravel()
    flight = timed(xy_m, leaves_s - arrives_s, law)
    if not np.isfinite(flight.leaves_s).all():  # against a wind that it cannot fly against
        return told_s, np.repeat(xy_m, 2, axis=0)
    times_s, places = track_points(xy_m, flight, law)
    by_law_s = np.stack([flight.arrives_s, flight.leaves_s], axis=1).ravel()
    return np.interp(times_s, by_law_s, told_s), places
