"""What flights earn whose sensors may miss, for verify.py: contacts, and what they leave unseen."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from verify_files import Array
from verify_inputs import Given
from verify_sight import Motion, Route, Window, first_in_reach, near_pairs, segments


class Contacts(NamedTuple):
    """From when to when flights have particles in reach; (contacts,) each."""

    particle: Array
    from_s: Array
    to_s: Array


def contacts(
    route: Route, windows: list[Window], start_s: float, motion: Motion, radius_m: float
) -> Contacts:
    """Return the contacts of a flight begun at a time, while its sensor is on."""
    found = [
        part
        for window in windows
        if window[0] <= window[1]
        for part in _contacts(route, window, start_s, motion, radius_m)
    ]
    none = Contacts(np.empty(0, dtype=int), np.empty(0), np.empty(0))
    return Contacts(*map(np.concatenate, zip(none, *found, strict=True)))


def _contacts(
    route: Route, window: Window, start_s: float, motion: Motion, radius_m: float
) -> Iterator[Contacts]:
    for segment in segments(route, window):
        for pieces, _ in near_pairs(segment, motion, np.array([start_s]), radius_m):
            at = Motion(*(column[pieces] for column in motion))
            begin_s = np.maximum(start_s + segment.begin_s, at.from_s)
            lasts_s = np.minimum(start_s + segment.end_s, at.to_s) - begin_s
            flown = segment.place + segment.velocity * (begin_s - start_s - segment.begin_s)
            offset = at.place + at.velocity * (begin_s - at.from_s) - flown
            drift = at.velocity - segment.velocity
            enters_s = first_in_reach(offset, drift, radius_m, 0.0)
            leaves_s = np.minimum(lasts_s, _last_in_reach(offset, drift, radius_m))
            met = (enters_s >= 0.0) & (enters_s <= leaves_s)
            yield Contacts(at.particle[met], (begin_s + enters_s)[met], (begin_s + leaves_s)[met])


def _last_in_reach(offset: Array, drift: Array, reach_m: float) -> Array:
    """Return the last t with |offset + drift t| <= reach; infinity or not a number: none."""
    squared, along = abs(drift) ** 2, (np.conj(offset) * drift).real
    across = (np.conj(offset) * drift).imag
    root = np.sqrt(squared * reach_m**2 - across**2)
    return np.where(squared == 0.0, np.inf, (root - along) / squared)


def outcome(given: Given, met: Contacts, rate_per_s: float, particles: int) -> tuple[Array, Array]:
    """Return what one flight is expected to earn with each particle, and how probably it misses.

    Its contacts with a particle may touch, but not overlap.
    """
    order = np.lexsort((met.from_s, met.particle))
    who, from_s, to_s = (column[order] for column in met)
    lasts_s = to_s - from_s
    before_s = np.cumsum(lasts_s) - lasts_s
    first = np.searchsorted(who, who)
    unseen = np.exp(-rate_per_s * (before_s - before_s[first]))
    until_s = given.horizon_s if given.found_by_s is None else given.found_by_s
    counts_s = np.maximum(0.0, np.minimum(to_s, until_s) - from_s)
    seen = -np.expm1(-rate_per_s * counts_s)
    worth = seen
    if given.found_by_s is None:
        mean_s = seen / rate_per_s - counts_s * (1.0 - seen)  # after it begins, times seen
        worth = seen * np.maximum(0.0, until_s - from_s) - mean_s
    earned = np.bincount(who, unseen * worth, particles)
    return earned, np.exp(-rate_per_s * np.bincount(who, lasts_s, particles))
