"""What-if flights, compiled: what many legs would see from one place and time on.

A flight to a leg is first a transit, straight to the leg's start, then the road. Legs that start
at the same node share the transit; a road only sees its own passages. Each flight names a particle
once, at its first sighting.

``miss`` (N,) is the probability that a particle is still unseen. The sensor sees all that comes
within its radius, so a flight looks for the particles with ``miss`` > 0, and a sighting is worth
weight * miss * reward. A sensor that misses would see at a rate per second of contact; what
``see_along_road`` and ``see_on_the_way`` then have to write down is the contact, from when to when,
in place of its first second.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import Rows, Window, last_at_or_before
from planner.jit import compiled
from planner.search.kernels.motion import (
    END,
    Course,
    ParticleMotion,
    first_meeting,
    piece_from,
    zero,
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
from planner.search.kernels.windows import Departure, Sensing


class LegColumns(NamedTuple):
    """The polylines of all legs, as they are flown."""

    first_point: Offsets  # (L + 1,) where a leg's points start
    after_s: Floats  # (Q,) seconds from the leg's start to the point
    x_m: Floats  # (Q,) metres
    y_m: Floats  # (Q,) metres
    vx_mps: Floats  # (Q,) m/s, from the point on
    vy_mps: Floats  # (Q,) m/s


class Goal(NamedTuple):
    """What a search is for, as in ``Objective``."""

    horizon_s: float
    by_s: float  # the deadline, seconds; infinity: none


class SearchIndex(NamedTuple):
    """A problem, laid out so that what-if flights find what they pass."""

    motion: ParticleMotion
    passages: PassageColumns
    legs: LegColumns
    sensing: Sensing
    weight: Floats  # (N,) probability of each particle
    goal: Goal


class Candidates(NamedTuple):
    """C legs that may be flown next."""

    leg: Ints  # (C,) leg index
    transit: Ints  # (C,) which of the transits leads to its start, -1: it starts here
    turns_s: Floats  # (C,) seconds lost at corners before it begins


class FirstSightings(NamedTuple):
    """Room for sightings."""

    particle: Ints  # (M,)
    seen_at: Floats  # (M,) seconds on the target's clock


class Around(NamedTuple):
    """What transits from one place see."""

    rays: RaySightings
    ray_of: Ints  # (E,) the ray along which each transit flies


class Marks(NamedTuple):
    """By whom particles were last seen, so that nobody sees one twice."""

    by: Ints  # (N,) the transit or flight that last saw a particle
    transit: int  # the mark of the transit at hand
    flight: int  # the mark of the flight at hand


class RoadFlight(NamedTuple):
    """A flight along a road."""

    leg: int
    start_s: float  # when it begins


class PiecesAhead(NamedTuple):
    """A particle's pieces of motion from a time on."""

    piece: int  # the one at that time
    last: int


class Flights(NamedTuple):
    """What C flights see; each particle at most once in a flight."""

    start_s: Floats  # (C,) seconds, when the road begins
    first: Offsets  # (C + 1,) where a flight's sightings start
    particle: Ints  # (M,)
    seen_at: Floats  # (M,) seconds on the target's clock


class Earnings(NamedTuple):
    """What C flights earn."""

    start_s: Floats  # (C,) seconds, when the road begins
    reward: Floats  # (C,) expected reward of the sightings
    seen: Floats  # (C,) weight * miss of the particles seen


@compiled
def reward_of(seen_s: float, goal: Goal) -> float:
    """Return what a sighting is worth, as ``Objective.reward`` says."""
    if goal.by_s < np.inf:
        return 1.0 if seen_s <= goal.by_s else 0.0
    return max(0.0, goal.horizon_s - seen_s)


@compiled
def passages_within(passages: PassageColumns, entry: int, span: Window) -> Rows:
    """Return those of a list's passages that may touch a time span."""
    first, latest_s = passages.first, passages.latest_s
    # The running maximum of the ends tells where the first passage that is not over can be.
    begin = first_from(latest_s, span.from_s, first[entry], first[entry + 1])
    after_s = np.nextafter(span.to_s, np.inf)
    return Rows(begin, first_from(passages.from_s, after_s, begin, first[entry + 1]))


@compiled
def first_meeting_along(
    road: RoadFlight, window: Window, ahead: PiecesAhead, index: SearchIndex
) -> float:
    """Return when a flight along a road first has a particle within the radius, inf: never.

    ``ahead`` is the particle's motion from the window's start on.
    """
    pieces, radius_m = index.motion.pieces, index.sensing.radius_m
    first_point, after_s, x_m, y_m, vx_mps, vy_mps = index.legs
    leg, start_s = road
    from_s, to_s = window
    k, last_piece = ahead
    last = first_point[leg + 1] - 1
    i = last_at_or_before(after_s, first_point[leg], last, from_s - start_s)
    while True:
        begin_s = start_s + after_s[i]
        leaves_s = min(to_s, start_s + after_s[i + 1]) if i + 1 < last else to_s
        course = Course(x_m[i], y_m[i], vx_mps[i], vy_mps[i], begin_s)
        seen_s = first_meeting(course, Window(from_s, leaves_s), pieces, k, radius_m)
        i += 1
        if seen_s < np.inf or i >= last:
            return seen_s
        from_s = start_s + after_s[i]
        if from_s > to_s:
            return np.inf
        k = piece_from(pieces, k, last_piece, from_s)


@compiled
def see_along_road(
    road: RoadFlight,
    miss: Floats,
    marks: Marks,
    index: SearchIndex,
    found: FirstSightings,
    count: int,
) -> int:
    """Write down what a flight along a road sees; return the new count of sightings."""
    pieces, first_piece = index.motion.pieces, index.motion.first_piece
    first, from_s, to_s, _, particle, piece = index.passages
    first_point, after_s = index.legs.first_point, index.legs.after_s
    seen_by, transit, flight = marks
    seen_particle, seen_at = found
    leg, start_s = road
    end_s = start_s + after_s[first_point[leg + 1] - 1]
    for rests in range(2):
        entry = leg // 2 + rests * (len(first) // 2)  # leg // 2 is its road
        begin, end = passages_within(index.passages, entry, Window(start_s, end_s))
        for i in range(begin, end):
            who = particle[i]
            if to_s[i] < start_s or not miss[who] > 0.0:
                continue
            if seen_by[who] == transit or seen_by[who] == flight:
                continue
            window = Window(max(start_s, from_s[i]), min(end_s, to_s[i]))
            k, last = piece[i], first_piece[who + 1] - 1
            if pieces[k, END] <= window.from_s:
                k = piece_from(pieces, k, last, window.from_s)
            seen_s = first_meeting_along(road, window, PiecesAhead(k, last), index)
            if seen_s < np.inf:
                seen_particle[count], seen_at[count] = who, seen_s
                seen_by[who] = flight
                count += 1
    return count


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
    return Around(RaySightings(nobody, head, Chain(nobody, nobody, np.empty(0))), ray_of)


@compiled
def see_on_the_way(
    transit: int,
    arrive_s: float,
    around: Around,
    marks: Marks,
    found: FirstSightings,
    count: int,
) -> int:
    """Write down what a transit sees after its start; return the new count of sightings."""
    following, particle, seen_at = around.rays.chain
    seen_by, seen_particle, first_seen_at = marks.by, found.particle, found.seen_at
    at = around.rays.head[around.ray_of[transit]] if transit >= 0 else -1
    while at >= 0:
        if seen_at[at] <= arrive_s:
            who = particle[at]
            seen_particle[count], first_seen_at[count] = who, seen_at[at]
            seen_by[who] = marks.transit
            count += 1
        at = following[at]
    return count


@compiled
def room_for_sightings(many: int) -> FirstSightings:
    """Return empty columns for as many sightings."""
    return FirstSightings(np.empty(many, dtype=np.int32), np.empty(many))


@compiled
def with_more_room(found: FirstSightings) -> FirstSightings:
    """Return the same sightings with room for twice as many."""
    many = len(found.particle)
    larger = room_for_sightings(2 * many)
    for i in range(many):
        larger.particle[i], larger.seen_at[i] = found.particle[i], found.seen_at[i]
    return larger


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
    found = room_for_sightings(2 * len(miss))
    count = zero()
    for c in range(len(leg_of)):
        if count + len(miss) > len(found.particle):
            found = with_more_room(found)
        arrive_s = departure.time_s + (lasts_s[transit_of[c]] if transit_of[c] >= 0 else 0.0)
        start_s[c] = arrive_s + turns_s[c]
        for who in here:
            found.particle[count], found.seen_at[count] = who, departure.time_s
            seen_by[who] = c + 1
            count += 1
        marks = Marks(seen_by, c + 1, c + 1)
        count = see_on_the_way(transit_of[c], arrive_s, around, marks, found, count)
        road = RoadFlight(leg_of[c], start_s[c])
        count = see_along_road(road, miss, marks, index, found, count)
        first[c + 1] = count
    return Flights(start_s, first, found.particle[:count], found.seen_at[:count])


@compiled
def earned_by(
    found: FirstSightings, count: int, miss: Floats, index: SearchIndex
) -> tuple[float, float]:
    """Return what the first ``count`` sightings earn, and weight * miss of their particles."""
    particle, seen_at = found
    weight, goal = index.weight, index.goal
    reward, seen = 0.0, 0.0
    for j in range(count):
        who = particle[j]
        unseen = weight[who] * miss[who]
        reward += unseen * reward_of(seen_at[j], goal)
        seen += unseen
    return reward, seen


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
    seen_by = np.zeros(len(miss), dtype=np.int32)
    found = room_for_sightings(len(miss))
    at_once, still = 0.0, miss.copy()
    for who in around.rays.here:
        still[who] = 0.0
        at_once += index.weight[who] * miss[who]
    many = len(leg_of)
    starts_s, rewards, weights = np.empty(many), np.empty(many), np.empty(many)
    head, following = by_transit(transit_of, len(lasts_s))
    for transit in range(-1, len(lasts_s)):
        if head[transit + 1] < 0:
            continue
        arrive_s = departure.time_s + (lasts_s[transit] if transit >= 0 else 0.0)
        marks = Marks(seen_by, transit + 2, transit + 2)
        count = see_on_the_way(transit, arrive_s, around, marks, found, zero())
        reward, seen = earned_by(found, count, miss, index)
        reward += at_once * reward_of(departure.time_s, index.goal)
        c = head[transit + 1]
        while c >= 0:
            start_s = arrive_s + turns_s[c]
            road, marks = RoadFlight(leg_of[c], start_s), Marks(seen_by, transit + 2, -1 - c)
            count = see_along_road(road, still, marks, index, found, zero())
            more, others = earned_by(found, count, miss, index)
            starts_s[c], rewards[c] = start_s, reward + more
            weights[c] = seen + at_once + others
            c = following[c]
    return Earnings(starts_s, rewards, weights)
