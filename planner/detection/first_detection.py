"""When a flight first sees each particle: exact, in continuous time."""

import numpy as np

from planner.arrays import Flags, Floats, Offsets
from planner.flight.track import Track
from planner.futures.futures import Futures


def first_detection(futures: Futures, track: Track, radius_m: float) -> Floats:
    """Return the first time at which the UAV has each particle within the radius, (N,) seconds.

    Both move straight from knot to knot; the closest approach is found in continuous time, so
    that no tick can step over a small radius (Figure 6, lines 8-27, in the limit of short ticks).
    A distance equal to the radius counts as seen. Never is infinity.

    Parameters
    ----------
    radius_m
        Detection radius, the paper's epsilon.
    """
    from planner.detection.kernels.closest_approach import seen_by_flight

    if len(track.time_s) == 0:
        return np.full(len(futures), np.inf)
    flight = (track.time_s, track.x_m, track.y_m)
    return seen_by_flight(flight, track.sensor_on, columns(futures), float(radius_m))


def columns(futures: Futures) -> tuple[Floats, Floats, Floats, Offsets, Flags]:
    """Return futures as the compiled code takes them: time_s, x_m, y_m, first_knot, gone."""
    return futures.time_s, futures.x_m, futures.y_m, futures.first_knot, futures.gone
