"""When a flight first sees each particle: exact, in continuous time."""

import numpy as np

from planner.arrays import Floats
from planner.checked import number
from planner.detection.kernels.closest_approach import FuturesColumns, PathColumns, seen_by_flight
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

    Raises
    ------
    InputError
        If the radius is no number from 0 on.
    """
    radius_m = number("radius_m", radius_m, least=0.0)
    if len(track.time_s) == 0:
        return np.full(len(futures), np.inf)
    flight = PathColumns(track.time_s, track.x_m, track.y_m)
    return seen_by_flight(flight, track.sensor_on, columns(futures), radius_m)


def columns(futures: Futures) -> FuturesColumns:
    """Return where particles are, as the compiled code takes it."""
    return FuturesColumns(
        futures.time_s, futures.x_m, futures.y_m, futures.first_knot, futures.gone
    )
