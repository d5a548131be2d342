"""Contacts of what-if flights, compiled: from when to when particles are within the radius.

A sensor that may miss needs all contacts of a flight, a perfect one only each particle's first
sighting. Both are written down in the same columns.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.kernels.closest_approach import Window, while_within
from planner.jit import compiled
from planner.search.kernels.motion import BEGIN, END, VX, VY, Course, X, Y, zero


class Contacts(NamedTuple):
    """Contacts in order of time as far as they are one particle's, with room for more."""

    particle: Ints  # (M,)
    from_s: Floats  # (M,) seconds on the target's clock
    to_s: Floats  # (M,) seconds; nothing where the sensor is perfect
    begin: int  # the first one of the flight at hand
    many: int  # how many there are


class PiecesAhead(NamedTuple):
    """A particle's pieces of motion from a time on."""

    particle: int
    piece: int  # the one at that time
    last: int


@compiled
def no_contacts(room: int) -> Contacts:
    """Return no contacts, with room for some."""
    return Contacts(np.empty(room, dtype=np.int32), np.empty(room), np.empty(room), zero(), zero())


@compiled
def emptied(found: Contacts) -> Contacts:
    """Return no contacts, with the room of others."""
    return Contacts(found.particle, found.from_s, found.to_s, zero(), zero())


@compiled
def found_so_far(found: Contacts, many: int) -> Contacts:
    """Return the same contacts, of which there are now so many."""
    return Contacts(found.particle, found.from_s, found.to_s, found.begin, many)


@compiled
def with_room(found: Contacts, room: int) -> Contacts:
    """Return the same contacts with room for so many more at least."""
    particle, from_s, to_s, begin, many = found
    if many + room <= len(particle):
        return found
    larger = no_contacts(2 * (many + room))
    larger.particle[:many], larger.from_s[:many] = particle[:many], from_s[:many]
    larger.to_s[:many] = to_s[:many]
    return Contacts(larger.particle, larger.from_s, larger.to_s, begin, many)


@compiled
def contacts_on(
    course: Course,
    window: Window,
    pieces: Floats,
    ahead: PiecesAhead,
    radius_m: float,
    found: Contacts,
) -> Contacts:
    """Return the same contacts, and those of a straight flight with a particle in a window.

    One that goes on where the last contact of the same flight ended prolongs that. ``ahead`` is the
    particle's motion from the window's start on.
    """
    x, y, vx, vy, at_s = course
    (now_s, over_s), (who, k, _) = window, ahead
    while True:
        until_s = min(over_s, pieces[k, END])
        since_s, flown_s = now_s - pieces[k, BEGIN], now_s - at_s
        offset = (
            pieces[k, X] + pieces[k, VX] * since_s - x - vx * flown_s,
            pieces[k, Y] + pieces[k, VY] * since_s - y - vy * flown_s,
        )
        drift = (pieces[k, VX] - vx, pieces[k, VY] - vy)
        within = while_within(offset, drift, until_s - now_s, radius_m)
        if within.from_s < np.inf:
            stays = within.to_s >= until_s - now_s
            from_s, to_s = now_s + within.from_s, until_s if stays else now_s + within.to_s
            at = found.many - 1
            if at >= found.begin and found.particle[at] == who and found.to_s[at] >= from_s:
                found.to_s[at] = max(found.to_s[at], to_s)
            elif to_s > from_s:
                found = with_room(found, 1)
                at = found.many
                found.particle[at], found.from_s[at], found.to_s[at] = who, from_s, to_s
                found = found_so_far(found, at + 1)
        if until_s >= over_s:
            return found
        now_s = until_s
        k += 1


@compiled
def passed_by(from_s: float, to_s: float, rate_per_s: float) -> float:
    """Return the probability that a contact misses a particle."""
    return 0.0 if rate_per_s == np.inf else float(np.exp(-rate_per_s * (to_s - from_s)))
