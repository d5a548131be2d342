"""What-if flights, compiled: what many legs would see from one place and time on.

A flight to a leg is first a transit, straight to the leg's start, then the road. Legs that start
at the same node share the transit; a road only sees its own passages.

``miss`` (N,) is the probability that a particle is still unseen; a flight looks for those with
``miss`` > 0. A perfect sensor sees all that comes within its radius: a flight names a particle
once, at its first sighting, which is worth weight * miss * reward. A sensor that may miss sees at
a rate per second of contact: a flight names a particle at each contact, from when to when, and
exposures add up, over the transit and the road as over one road and the next.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import Rows, Window
from planner.detection.kernels.worth import reward_of, worth_of, worth_of_contact
from planner.jit import compiled
from planner.search.kernels.along_roads import (
    RoadFlight,
    SearchIndex,
    contacts_along,
    first_meeting_along,
)
from planner.search.kernels.contacts import (
    Contacts,
    PiecesAhead,
    emptied,
    found_so_far,
    no_contacts,
    passed_by,
    with_room,
)
from planner.search.kernels.motion import (
    END,
    piece_from,
)
from planner.search.kernels.passages import PassageColumns
from planner.search.kernels.transits import (
    Chain,
    RaySightings,
    Transits,
    first_from,
    ray_sightings,
    rays_to,
)
from planner.search.kernels.windows import Departure


class Candidates(NamedTuple):
    """C legs that may be flown next."""

    leg: Ints  # (C,) leg index
    transit: Ints  # (C,) which of the transits leads to its start, -1: it starts here
    turns_s: Floats  # (C,) seconds lost at corners before it begins


class Around(NamedTuple):
    """What transits from one place see."""

    rays: RaySightings
    ray_of: Ints  # (E,) the ray along which each transit flies


class Marks(NamedTuple):
    """By whom particles were last seen, so that nobody sees one twice."""

    by: Ints  # (N,) the transit or flight that last saw a particle
    transit: int  # the mark of the transit at hand
    flight: int  # the mark of the flight at hand


class Flights(NamedTuple):
    """What C flights see, as ``Contacts`` has it."""

    start_s: Floats  # (C,) seconds, when the road begins
    first: Offsets  # (C + 1,) where a flight's contacts start
    particle: Ints  # (M,)
    from_s: Floats  # (M,) seconds on the target's clock
    to_s: Floats  # (M,) seconds; nothing where the sensor is perfect


class Earnings(NamedTuple):
    """What C flights earn."""

    start_s: Floats  # (C,) seconds, when the road begins
    reward: Floats  # (C,) expected reward of the sightings
    seen: Floats  # (C,) weight * miss of the particles seen, as far as they are


@compiled
def passages_within(passages: PassageColumns, entry: int, span: Window) -> Rows:
    """Return those of a list's passages that may touch a time span."""
    first, latest_s = passages.first, passages.latest_s
    # The running maximum of the ends tells where the first passage that is not over can be.
    begin = first_from(latest_s, span.from_s, first[entry], first[entry + 1])
    after_s = np.nextafter(span.to_s, np.inf)
    return Rows(begin, first_from(passages.from_s, after_s, begin, first[entry + 1]))


@compiled
def see_along_road(
    road: RoadFlight, miss: Floats, marks: Marks, index: SearchIndex, found: Contacts
) -> Contacts:
    """Return the same contacts, and those of a flight along a road.

    There has to be room for one of each particle.
    """
    may_miss = index.sensing.rate_per_s < np.inf
    pieces, first_piece = index.motion.pieces, index.motion.first_piece
    first, from_s, to_s, _, particle, piece = index.passages
    first_point, after_s = index.legs.first_point, index.legs.after_s
    seen_by, transit, flight = marks
    seen_particle, seen_at, _, _, count = found
    leg, start_s = road
    end_s = start_s + after_s[first_point[leg + 1] - 1]
    for rests in range(2):
        entry = leg // 2 + rests * (len(first) // 2)  # leg // 2 is its road
        begin, end = passages_within(index.passages, entry, Window(start_s, end_s))
        for i in range(begin, end):
            who = particle[i]
            if to_s[i] < start_s or not miss[who] > 0.0:
                continue
            if not may_miss and (seen_by[who] == transit or seen_by[who] == flight):
                continue
            window = Window(max(start_s, from_s[i]), min(end_s, to_s[i]))
            k, last = piece[i], first_piece[who + 1] - 1
            if pieces[k, END] <= window.from_s:
                k = piece_from(pieces, k, last, window.from_s)
            ahead = PiecesAhead(who, k, last)
            if may_miss:
                found = contacts_along(road, window, ahead, index, found)
                continue
            seen_s = first_meeting_along(road, window, ahead, index)
            if seen_s < np.inf:
                seen_particle[count], seen_at[count] = who, seen_s
                seen_by[who] = flight
                count += 1
    return found if may_miss else found_so_far(found, count)


@compiled
def look_around(
    departure: Departure, transits: Transits, wanted: Ints, miss: Floats, index: SearchIndex
) -> Around:
    """Return what the wanted transits see; nothing if the sensor is off on them."""
    rays, ray_of = rays_to(transits, wanted)
    if len(rays.bearing) > 0 and index.sensing.in_transit:
        return Around(ray_sightings(departure, rays, miss, index.motion, index.sensing), ray_of)
    nobody = np.empty(0, dtype=np.int32)
    head = np.full(len(rays.bearing), -1, dtype=np.int32)
    chain = Chain(nobody, nobody, np.empty(0), np.empty(0))
    return Around(RaySightings(nobody, head, chain), ray_of)


@compiled
def see_on_the_way(
    transit: int,
    arrive_s: float,
    around: Around,
    marks: Marks,
    found: Contacts,
) -> Contacts:
    """Return the same contacts, and those of a transit after its start."""
    following, particle, begins_s, ends_s = around.rays.chain
    at = around.rays.head[around.ray_of[transit]] if transit >= 0 else -1
    while at >= 0:
        if begins_s[at] <= arrive_s:
            found = with_room(found, 1)
            (seen_particle, from_s, to_s, _, count), who = found, particle[at]
            seen_particle[count], from_s[count] = who, begins_s[at]
            to_s[count] = min(ends_s[at], arrive_s)
            marks.by[who] = marks.transit
            found = found_so_far(found, count + 1)
        at = following[at]
    return found


@compiled
def fly_all(
    departure: Departure,
    candidates: Candidates,
    transits: Transits,
    miss: Floats,
    index: SearchIndex,
) -> Flights:
    """Return what a flight to and along each candidate sees of the particles with ``miss`` > 0."""
    (leg_of, transit_of, turns_s), lasts_s = candidates, transits.lasts_s
    around = look_around(departure, transits, transit_of, miss, index)
    here, seen_by = around.rays.here, np.zeros(len(miss), dtype=np.int32)
    start_s, first = np.empty(len(leg_of)), np.zeros(len(leg_of) + 1, dtype=np.int64)
    found = no_contacts(2 * len(miss))
    for c in range(len(leg_of)):
        found = with_room(found, len(miss))
        arrive_s = departure.time_s + (lasts_s[transit_of[c]] if transit_of[c] >= 0 else 0.0)
        start_s[c] = arrive_s + turns_s[c]
        particle, from_s, to_s, _, count = found
        for who in here:
            particle[count], from_s[count] = who, departure.time_s
            seen_by[who] = c + 1
            count += 1
        found = Contacts(particle, from_s, to_s, first[c], count)
        marks = Marks(seen_by, c + 1, c + 1)
        found = see_on_the_way(transit_of[c], arrive_s, around, marks, found)
        found = with_room(found, len(miss))
        found = see_along_road(RoadFlight(leg_of[c], start_s[c]), miss, marks, index, found)
        first[c + 1] = found.many
    particle, from_s, to_s, _, count = found
    return Flights(start_s, first, particle[:count], from_s[:count], to_s[:count])


@compiled
def judged(flights: Flights, index: SearchIndex) -> tuple[Floats, Floats]:
    """Return what each contact is worth and how probably it is the one that sees, (M,) each.

    Both as far as the particle is unseen when the flight begins.
    """
    _, first, particle, from_s, to_s = flights
    worth, seen = np.empty(len(particle)), np.empty(len(particle))
    rate_per_s, goal, left = index.sensing.rate_per_s, index.goal, np.empty(len(index.weight))
    for c in range(len(first) - 1):
        for j in range(first[c], first[c + 1]):
            left[particle[j]] = 1.0
        for j in range(first[c], first[c + 1]):
            who, passes = particle[j], passed_by(from_s[j], to_s[j], rate_per_s)
            each = worth_of_contact(who, from_s[j], to_s[j], rate_per_s, goal)
            worth[j], seen[j] = left[who] * each, left[who] * (1.0 - passes)
            left[who] *= passes
    return worth, seen


@compiled
def earned_by(found: Contacts, left: Floats, index: SearchIndex) -> tuple[float, float]:
    """Return what contacts earn, and weight * miss of whom they see, as far as they do.

    ``left`` (N,) is the particles' miss before, and, if the sensor may miss, after them.
    """
    particle, from_s, to_s, _, many = found
    weight, goal, rate_per_s = index.weight, index.goal, index.sensing.rate_per_s
    reward, seen = 0.0, 0.0
    for j in range(many):
        who = particle[j]
        unseen = weight[who] * left[who]
        if rate_per_s == np.inf:
            reward += unseen * worth_of(who, from_s[j], goal)
            seen += unseen
        else:
            passes = passed_by(from_s[j], to_s[j], rate_per_s)
            reward += unseen * worth_of_contact(who, from_s[j], to_s[j], rate_per_s, goal)
            seen += unseen * (1.0 - passes)
            left[who] *= passes
    return reward, seen


@compiled
def take_back(found: Contacts, before: Floats, left: Floats) -> None:
    """Set what is left, (N,), of the particles in contact back to what was before, (N,)."""
    for j in range(found.many):
        left[found.particle[j]] = before[found.particle[j]]


@compiled
def by_transit(transit_of: Ints, many: int) -> tuple[Ints, Ints]:
    """Return the chains of candidates behind each of ``many`` transits.

    Returns
    -------
    head, following
        The first of each transit's candidates, (many + 1,), transit -1 first; and of each
        candidate the next one behind the same transit, (C,), -1: none.
    """
    head = np.full(many + 1, -1, dtype=np.int32)
    following = np.empty(len(transit_of), dtype=np.int32)
    for c in range(len(transit_of) - 1, -1, -1):
        following[c] = head[transit_of[c] + 1]
        head[transit_of[c] + 1] = c
    return head, following


@compiled
def score_all(
    departure: Departure,
    candidates: Candidates,
    transits: Transits,
    miss: Floats,
    index: SearchIndex,
) -> Earnings:
    """Return what a flight to and along each candidate earns."""
    (leg_of, transit_of, turns_s), lasts_s = candidates, transits.lasts_s
    around = look_around(departure, transits, transit_of, miss, index)
    seen_by, beside = np.zeros(len(miss), dtype=np.int32), 0.0
    on_way, along = no_contacts(len(miss)), no_contacts(len(miss))
    at_once, still, left = 0.0, miss.copy(), miss.copy()
    here_s, goal = departure.time_s, index.goal
    for who in around.rays.here:
        still[who] = 0.0
        at_once += index.weight[who] * miss[who]
        less = worth_of(who, here_s, goal) - reward_of(here_s, goal)  # for others who fly
        beside += index.weight[who] * miss[who] * less
    many = len(leg_of)
    starts_s, rewards, weights = np.empty(many), np.empty(many), np.empty(many)
    head, following = by_transit(transit_of, len(lasts_s))
    for transit in range(-1, len(lasts_s)):
        if head[transit + 1] < 0:
            continue
        arrive_s = departure.time_s + (lasts_s[transit] if transit >= 0 else 0.0)
        marks = Marks(seen_by, transit + 2, transit + 2)
        on_way = see_on_the_way(transit, arrive_s, around, marks, emptied(on_way))
        reward, seen = earned_by(on_way, still, index)
        reward += at_once * reward_of(here_s, goal) + beside
        c = head[transit + 1]
        while c >= 0:
            start_s = arrive_s + turns_s[c]
            road, marks = RoadFlight(leg_of[c], start_s), Marks(seen_by, transit + 2, -1 - c)
            along = see_along_road(road, still, marks, index, emptied(along))
            take_back(along, still, left)
            more, others = earned_by(along, left, index)
            starts_s[c], rewards[c] = start_s, reward + more
            weights[c] = seen + at_once + others
            c = following[c]
        take_back(on_way, miss, still)
    return Earnings(starts_s, rewards, weights)
