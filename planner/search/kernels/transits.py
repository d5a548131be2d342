"""What straight flights from one place see, compiled: the first half of every what-if flight.

A transit can only see a particle while the ring around the UAV's place that grows with the UAV's
speed passes over it, and only in the directions in which the particle then lies. Transits in the
same direction share a ray, which is flown once, to its farthest end.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.kernels.closest_approach import Window
from planner.jit import compiled
from planner.search.kernels.bearings import bearing, turn_from
from planner.search.kernels.contacts import PiecesAhead, contacts_on, emptied, no_contacts
from planner.search.kernels.motion import Course, ParticleMotion, first_meeting
from planner.search.kernels.windows import (
    ENTER,
    LEAVE,
    LOW,
    MIDDLE_X,
    MIDDLE_Y,
    NEAR,
    WIDE,
    Departure,
    Sensing,
    all_windows,
)


class Transits(NamedTuple):
    """Straight flights from one place to E others, by rising bearing."""

    bearing: Floats  # (E,) as ``bearing`` returns it
    way: Floats  # (E, 2) unit vectors
    lasts_s: Floats  # (E,) seconds of flight


class Rays(NamedTuple):
    """Directions in which transits fly, by rising bearing: m of them, each once."""

    bearing: Floats  # (m,)
    way: Floats  # (m, 2) unit vectors
    lasts_s: Floats  # (m,) seconds of the longest transit along the ray


class Chain(NamedTuple):
    """Linked lists of contacts, M in all; those of one particle in order of time."""

    following: Ints  # (M,) index of the list's next one, -1: it is the last
    particle: Ints  # (M,)
    from_s: Floats  # (M,) seconds on the target's clock
    to_s: Floats  # (M,) seconds; of a perfect sensor's sightings infinity


class RaySightings(NamedTuple):
    """What is seen from one place along rays."""

    here: Ints  # (h,) the particles that a perfect sensor sees at once, whatever the ray
    head: Ints  # (m,) the first of each ray's further contacts in the chain, -1: none
    chain: Chain


@compiled
def bearings_of(offset: Floats) -> Floats:
    """Return the bearings of many vectors, (m, 2), as ``bearing`` does."""
    bearings = np.empty(len(offset))
    for i in range(len(offset)):
        bearings[i] = bearing(offset[i, 0], offset[i, 1])
    return bearings


@compiled
def rays_to(transits: Transits, wanted: Ints) -> tuple[Rays, Ints]:
    """Return the rays along which wanted transits fly, and the ray of each transit, (E,), -1: none.

    ``wanted`` holds indices of transits, -1 for none.
    """
    bearings, ways, lasts_s = transits
    many, count = len(bearings), 0
    ray_of = np.full(many, -1, dtype=np.int32)
    for e in wanted:
        if e >= 0:
            ray_of[e] = 0
    ray_bearing, ray_way, longest_s = np.empty(many), np.empty((many, 2)), np.zeros(many)
    for e in range(many):
        if ray_of[e] < 0:
            continue
        if count == 0 or ray_bearing[count - 1] != bearings[e]:
            ray_bearing[count], ray_way[count, 0], ray_way[count, 1] = (
                bearings[e],
                ways[e, 0],
                ways[e, 1],
            )
            count += 1
        ray_of[e] = count - 1
        longest_s[count - 1] = max(longest_s[count - 1], lasts_s[e])
    return Rays(ray_bearing[:count], ray_way[:count], longest_s[:count]), ray_of


@compiled
def first_from(values: Floats, low: float, start: int, end: int) -> int:
    """Return the first index in [start, end) whose rising value is at least ``low``, or ``end``."""
    while start < end:
        middle = (start + end) // 2
        if values[middle] < low:
            start = middle + 1
        else:
            end = middle
    return start


@compiled
def chain_of(room: int) -> Chain:
    """Return room for so many contacts."""
    return Chain(np.empty(room, np.int32), np.empty(room, np.int32), np.empty(room), np.empty(room))


@compiled
def with_more_room(chain: Chain) -> Chain:
    """Return the same chain with room for as many contacts again, and two more."""
    many = len(chain.particle)
    larger = chain_of(2 * (many + 1))
    for i in range(many):
        larger.following[i], larger.particle[i] = chain.following[i], chain.particle[i]
        larger.from_s[i], larger.to_s[i] = chain.from_s[i], chain.to_s[i]
    return larger


@compiled
def link(chain: Chain, used: int, head: Ints, ray: int, contact: tuple[int, Window]) -> Chain:
    """Return the chain with a contact, the ``used`` th, as the first one of a ray."""
    if used == len(chain.particle):
        chain = with_more_room(chain)
    chain.following[used], chain.particle[used] = head[ray], contact[0]
    chain.from_s[used], chain.to_s[used] = contact[1]
    head[ray] = used
    return chain


@compiled
def ray_sightings(
    departure: Departure, rays: Rays, miss: Floats, motion: ParticleMotion, sensing: Sensing
) -> RaySightings:
    """Return what the UAV sees where it sets out and along each ray, of all with ``miss`` > 0."""
    start_s, x0, y0 = departure
    bearings, ways, lasts_s = rays
    pieces, radius_m, speed_mps = motion.pieces, sensing.radius_m, sensing.speed_mps
    first_piece = motion.first_piece
    many, over_s, used = len(bearings), start_s, 0
    for away_s in lasts_s:
        over_s = max(over_s, start_s + away_s)
    here, windows = all_windows(departure, over_s, miss, motion, sensing)
    of, spans = windows
    head = np.full(many, -1, dtype=np.int32)
    chain, met, may_miss = chain_of(many), no_contacts(4), sensing.rate_per_s < np.inf
    for i in range(len(of)):
        x, y, near_m = spans[i, MIDDLE_X], spans[i, MIDDLE_Y], spans[i, NEAR]
        low, wide = spans[i, LOW], spans[i, WIDE]
        j = first_from(bearings, low, 0, many)
        for _ in range(many):
            j = j if j < many else 0
            if turn_from(low, bearings[j]) > wide:  # most particles lie on nobody's way
                break
            leave_s = min(spans[i, LEAVE], start_s + lasts_s[j])
            aside_m = abs(x * ways[j, 1] - y * ways[j, 0])
            if spans[i, ENTER] <= leave_s and aside_m <= near_m:
                course = Course(x0, y0, speed_mps * ways[j, 0], speed_mps * ways[j, 1], start_s)
                window = Window(spans[i, ENTER], leave_s)
                if may_miss:
                    ahead = PiecesAhead(of[i, 0], of[i, 1], first_piece[of[i, 0] + 1] - 1)
                    met = contacts_on(course, window, pieces, ahead, radius_m, emptied(met))
                    for c in range(met.many - 1, -1, -1):  # so that the first one comes first
                        contact = (of[i, 0], Window(met.from_s[c], met.to_s[c]))
                        chain = link(chain, used, head, j, contact)
                        used += 1
                    j += 1
                    continue
                seen_s = first_meeting(course, window, pieces, of[i, 1], radius_m)
                if seen_s < np.inf:
                    chain = link(chain, used, head, j, (of[i, 0], Window(seen_s, np.inf)))
                    used += 1
            j += 1
    return RaySightings(here, head, chain)
