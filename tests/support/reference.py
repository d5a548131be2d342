"""Slow and obvious twins of fast code."""

from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats
from planner.flight.track import Track
from planner.futures.futures import Futures


@dataclass(frozen=True)
class Ticks:
    """What stepping through a flight in ticks shows of one particle."""

    time_s: Floats  # (T,) seconds at which the sensor is on and the particle is there
    distance_m: Floats  # (T,) between UAV and particle


def by_ticks(futures: Futures, particle: int, track: Track, tick_s: float) -> Ticks:
    """Step a UAV and a particle forward as lines 9-27 of Figure 6 do, in all sensor windows."""
    time_s = np.unique(
        np.concatenate(
            [np.append(np.arange(start, end, tick_s), end) for start, end in track.sensor_on]
            or [np.empty(0)]
        )
    )
    return at_times(futures, particle, track, time_s)


def at_times(futures: Futures, particle: int, track: Track, time_s: Floats) -> Ticks:
    """Distances at given times, without those at which one of the two is not there."""
    offset = futures.xy(particle, time_s) - track.xy(time_s)
    distance_m = np.hypot(offset[:, 0], offset[:, 1])
    there = np.isfinite(distance_m)
    return Ticks(time_s[there], distance_m[there])
