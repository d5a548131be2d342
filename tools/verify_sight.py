"""Flights and targets as verify.py sees them: straight parts, and when they come within reach.

Places and velocities are complex numbers, x + iy, in metres and metres per second; times are
seconds.
"""

from collections.abc import Iterator
from typing import NamedTuple, TypeAlias

import numpy as np
from verify_files import Array
from verify_inputs import Given

Window: TypeAlias = tuple[float, float]  # from and to
AT_ONCE = 2_000_000  # pairs of a flight and a piece of motion


def reward_of(given: Given, seen_at: Array) -> Array:
    """Return what it is worth to see a particle at some times."""
    if given.found_by_s is not None:
        return (seen_at <= given.found_by_s).astype(float)
    return np.maximum(0.0, given.horizon_s - seen_at)


class Route(NamedTuple):
    """A flight: straight from point to point, at rest before and after; (points,) each."""

    time_s: Array
    place: Array


class Segment(NamedTuple):
    """A straight part of a flight; times count from the flight's start."""

    begin_s: float
    end_s: float
    place: complex  # at begin
    velocity: complex


class Motion(NamedTuple):
    """Straight motions of particles at constant velocity; (pieces,) each."""

    particle: Array
    from_s: Array
    to_s: Array  # infinity: at rest without end
    place: Array  # at from
    velocity: Array


def segments(route: Route, window: Window) -> Iterator[Segment]:
    """Yield the straight parts of a flight within a window of time."""
    inside = (route.time_s > window[0]) & (route.time_s < window[1])
    time_s = np.concatenate(([window[0]], route.time_s[inside], [window[1]]))
    place = np.interp(time_s, route.time_s, route.place)
    velocity = np.diff(place) / np.maximum(np.diff(time_s), 1e-9)
    yield from map(Segment, time_s[:-1], time_s[1:], place[:-1], velocity)


def near_pairs(
    segment: Segment, motion: Motion, starts_s: Array, reach_m: float, late_s: float = 0.0
) -> Iterator[Array]:
    """Yield pieces that may come in reach of a segment, and the start of the flight, (2, pairs).

    A piece lies in a disc around its middle. A rest is cut off where the last flight ends.

    Parameters
    ----------
    late_s
        By which flights may begin later than at their start.
    """
    to_s = np.minimum(motion.to_s, starts_s[-1] + late_s + segment.end_s)
    half_s = (to_s - motion.from_s) / 2
    disc_m = reach_m + abs(motion.velocity) * half_s + 1e-3
    middle = motion.place + motion.velocity * half_s - segment.place
    along_s = (middle * np.conj(segment.velocity)).real / max(abs(segment.velocity) ** 2, 1e-9)
    nearest = segment.velocity * np.clip(along_s, 0.0, segment.end_s - segment.begin_s)
    near = np.flatnonzero(abs(middle - nearest) <= disc_m)
    passing = _passing_starts(segment, Motion(*(column[near] for column in motion)), reach_m)
    from_s = np.fmax(motion.from_s[near] - segment.end_s, passing[0])
    until_s = np.fmin(to_s[near] - segment.begin_s, passing[1])
    first = np.searchsorted(starts_s, from_s - late_s - 1e-6)
    end = np.searchsorted(starts_s, until_s + 1e-6)
    counts = np.maximum(0, end - first)
    parts = np.flatnonzero(np.diff(np.cumsum(counts) // AT_ONCE, prepend=0))
    for part in np.split(np.arange(len(near)), parts):
        many, before = counts[part], np.cumsum(counts[part]) - counts[part]
        starts = np.arange(many.sum()) + np.repeat(first[part] - before, many)
        yield np.stack([np.repeat(near[part], many), starts])


def _passing_starts(segment: Segment, at: Motion, reach_m: float) -> tuple[Array, Array]:
    """Return between which starts of a flight a target on its line passes within reach.

    On lines without end they pass each other at a distance that changes evenly with the start.
    """
    drift = at.velocity - segment.velocity
    crossing = (np.conj(segment.velocity) * drift).imag
    at_zero = at.place - at.velocity * at.from_s - segment.place
    at_zero += segment.velocity * segment.begin_s
    middle_s = -(np.conj(at_zero) * drift).imag / crossing
    half_s = reach_m * abs(drift) / abs(crossing)
    parallel = abs(crossing) <= 1e-9 * abs(drift) * abs(segment.velocity)
    half_s, middle_s = np.where(parallel, np.inf, half_s), np.where(parallel, 0.0, middle_s)
    return middle_s - half_s, middle_s + half_s


def first_in_reach(offset: Array, drift: Array, reach_m: Array, growth_mps: float) -> Array:
    """Return the first t >= 0 with |offset + drift t| <= reach + growth t.

    Negative or not a number: never.
    """
    outside = abs(offset) ** 2 - reach_m**2
    half_b = (np.conj(offset) * drift).real - growth_mps * reach_m
    product = (abs(drift) ** 2 - growth_mps**2) * outside
    return np.where(outside <= 0.0, 0.0, outside / (np.sqrt(half_b**2 - product) - half_b))


def route_of(way: Array, speed_mps: float) -> Route:
    """Return the flight along points at full speed, begun at zero."""
    return Route(np.append(0.0, np.cumsum(abs(np.diff(way))) / speed_mps), way)
