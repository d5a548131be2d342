"""What-if flights, compiled: what many legs would see from one place and time on.

A flight to a leg is first a transit, straight to the leg's start, then the road. Legs that start
at the same node share the transit; a road only sees its own passages. Each flight names a particle
once, at its first sighting.
"""

from typing import TypeAlias

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import last_at_or_before
from planner.jit import compiled
from planner.search.kernels.motion import END, Motion, met, nothing, piece_from
from planner.search.kernels.passages import PassageColumns
from planner.search.kernels.transits import (
    Chain,
    Ends,
    Place,
    Sensing,
    first_from,
    ray_sightings,
    rays_to,
)

# first_point (L + 1,); of each point: after_s, x_m, y_m, and the velocity from there on, vx, vy
LegColumns: TypeAlias = tuple[Offsets, Floats, Floats, Floats, Floats, Floats]
World: TypeAlias = tuple[Motion, PassageColumns, LegColumns, Sensing]
# leg (C,), the end of the transit to it (C,), -1: it starts here
Flights: TypeAlias = tuple[Ints, Ints]
# what is seen at once (h,), each ray's chain (m,), the chains, and the ray of each end (E,)
Surroundings: TypeAlias = tuple[Ints, Ints, Chain, Ints]
Found: TypeAlias = tuple[Ints, Floats]  # particle (M,), seen_at (M,)
Goal: TypeAlias = tuple[float, float]  # horizon, deadline (inf: none), seconds


@compiled
def reward_of(seen_s: float, goal: Goal) -> float:
    """Return what a sighting is worth, as ``Objective.reward`` says."""
    if goal[1] < np.inf:
        return 1.0 if seen_s <= goal[1] else 0.0
    return max(0.0, goal[0] - seen_s)


@compiled
def passages_within(
    passages: PassageColumns, entry: int, start_s: float, end_s: float
) -> tuple[int, int]:
    """Return from (included) and to (excluded) of a list's passages that may touch a time span."""
    first, from_s, _, latest_s, _, _ = passages
    # The running maximum of the ends tells where the first passage that is not over can be.
    begin = first_from(latest_s, start_s, first[entry], first[entry + 1])
    return begin, first_from(from_s, np.nextafter(end_s, np.inf), begin, first[entry + 1])


@compiled
def met_along(
    leg: int,
    start_s: float,
    window: tuple[float, float],
    target: tuple[int, int],
    world: World,
) -> float:
    """Return when a flight along a road first has a particle within the radius, inf: never.

    ``target`` is the particle's piece at the window's start, and its last one.
    """
    motion, _, (first_point, after_s, x_m, y_m, vx, vy), (radius_m, _, _) = world
    from_s, to_s = window
    k, last_piece = target
    last = first_point[leg + 1] - 1
    i = last_at_or_before(after_s, first_point[leg], last, from_s - start_s)
    while True:
        begin_s = start_s + after_s[i]
        leaves_s = min(to_s, start_s + after_s[i + 1]) if i + 1 < last else to_s
        flight = (x_m[i], y_m[i], vx[i], vy[i], begin_s)
        seen = met(flight, (from_s, leaves_s), motion[0], k, radius_m)
        i += 1
        if seen < np.inf or i >= last:
            return seen
        from_s = start_s + after_s[i]
        if from_s > to_s:
            return np.inf
        k = piece_from(motion[0], k, last_piece, from_s)


@compiled
def see_along_road(
    road: tuple[int, float],
    unseen: Flags,
    marks: tuple[Ints, int, int],
    world: World,
    found: Found,
    count: int,
) -> int:
    """Write down what a flight along a road sees; return the new count.

    ``road`` is the leg and when it begins. ``marks`` tells by whom each particle was last met,
    and the names of this transit and flight.
    """
    motion, passages, (first_point, after_s, _, _, _, _), _ = world
    leg, start_s = road
    first, from_s, to_s, _, particle, piece = passages
    met_by, transit, flight = marks
    end_s = start_s + after_s[first_point[leg + 1] - 1]
    for rests in range(2):
        entry = leg // 2 + rests * (len(first) // 2)
        begin, end = passages_within(passages, entry, start_s, end_s)
        for i in range(begin, end):
            who = particle[i]
            if to_s[i] < start_s or not unseen[who]:
                continue
            if met_by[who] == transit or met_by[who] == flight:
                continue
            window = (max(start_s, from_s[i]), min(end_s, to_s[i]))
            k, last = piece[i], motion[1][who + 1] - 1
            if motion[0][k, END] <= window[0]:
                k = piece_from(motion[0], k, last, window[0])
            seen = met_along(leg, start_s, window, (k, last), world)
            if seen < np.inf:
                found[0][count], found[1][count] = who, seen
                met_by[who] = flight
                count += 1
    return count


@compiled
def look_around(
    place: Place, ends: Ends, wanted: Ints, unseen: Flags, world: World
) -> Surroundings:
    """Return what the transits to the wanted ends see; nothing if the sensor is off on them."""
    motion, _, _, sensing = world
    rays, ray_of_end = rays_to(ends, wanted)
    if len(rays[0]) > 0 and sensing[2]:
        here, heads, chain = ray_sightings(place, rays, unseen, motion, sensing)
        return here, heads, chain, ray_of_end
    nobody = np.empty(0, dtype=np.int32)
    none = np.full(len(rays[0]), -1, dtype=np.int32)
    return nobody, none, (nobody, nobody, np.empty(0)), ray_of_end


@compiled
def see_on_the_way(
    end: int,
    arrive_s: float,
    around: Surroundings,
    marks: tuple[Ints, int],
    found: Found,
    count: int,
) -> int:
    """Write down what the transit to an end sees after its start; return the new count."""
    _, heads, chain, ray_of_end = around
    met_by, transit = marks
    at = heads[ray_of_end[end]] if end >= 0 else -1
    while at >= 0:
        if chain[2][at] <= arrive_s:
            who = chain[1][at]
            found[0][count], found[1][count] = who, chain[2][at]
            met_by[who] = transit
            count += 1
        at = chain[0][at]
    return count


@compiled
def roomier(found: Found) -> Found:
    """Return the same sightings with room for twice as many."""
    wide = (np.empty(2 * len(found[0]), dtype=np.int32), np.empty(2 * len(found[0])))
    for i in range(len(found[0])):
        wide[0][i], wide[1][i] = found[0][i], found[1][i]
    return wide


@compiled
def fly_all(
    place: Place, flights: Flights, ends: Ends, unseen: Flags, world: World
) -> tuple[Floats, Offsets, Ints, Floats]:
    """Return what each flight sees.

    Returns
    -------
    start_s, first, particle, seen_at
        When each leg's road begins, (C,); where its sightings start, (C + 1,); the sightings.
    """
    wanted, end_of = flights
    around = look_around(place, ends, end_of, unseen, world)
    here = around[0]
    met_by = np.zeros(len(unseen), dtype=np.int32)
    start_s, first = np.empty(len(wanted)), np.zeros(len(wanted) + 1, dtype=np.int64)
    found: Found = (np.empty(2 * len(unseen), dtype=np.int32), np.empty(2 * len(unseen)))
    count = nothing()
    for c in range(len(wanted)):
        if count + len(unseen) > len(found[0]):
            found = roomier(found)
        away_s = ends[2][end_of[c]] if end_of[c] >= 0 else 0.0
        start_s[c] = place[0] + away_s
        for who in here:
            found[0][count], found[1][count] = who, place[0]
            met_by[who] = c + 1
            count += 1
        count = see_on_the_way(end_of[c], start_s[c], around, (met_by, c + 1), found, count)
        road, marks = (wanted[c], start_s[c]), (met_by, c + 1, c + 1)
        count = see_along_road(road, unseen, marks, world, found, count)
        first[c + 1] = count
    return start_s, first, found[0][:count], found[1][:count]


@compiled
def worth_of(found: Found, count: int, weight: Floats, goal: Goal) -> tuple[float, float]:
    """Return what the first sightings are worth in all, and the weight of their particles."""
    reward, seen = 0.0, 0.0
    for j in range(count):
        who = found[0][j]
        reward += weight[who] * reward_of(found[1][j], goal)
        seen += weight[who]
    return reward, seen


@compiled
def legs_by_end(end_of: Ints, many: int) -> tuple[Ints, Ints]:
    """Return the chains of legs behind each end: heads, (many + 1,), end -1 first; next, (C,)."""
    head = np.full(many + 1, -1, dtype=np.int32)
    following = np.empty(len(end_of), dtype=np.int32)
    for c in range(len(end_of) - 1, -1, -1):
        following[c] = head[end_of[c] + 1]
        head[end_of[c] + 1] = c
    return head, following


@compiled
def score_all(
    place: Place,
    flights: Flights,
    ends: Ends,
    unseen: Flags,
    world: World,
    aim: tuple[Floats, Goal],
) -> tuple[Floats, Floats, Floats]:
    """Return what each flight earns; ``aim`` holds the particles' weights and the goal.

    Returns
    -------
    start_s, reward, seen
        When each leg's road begins, the expected reward, and the weight of the particles seen,
        (C,) each.
    """
    wanted, end_of = flights
    weight, goal = aim
    around = look_around(place, ends, end_of, unseen, world)
    met_by = np.zeros(len(unseen), dtype=np.int32)
    found = (np.empty(len(unseen), dtype=np.int32), np.empty(len(unseen)))
    at_once, still = 0.0, unseen.copy()
    for who in around[0]:
        still[who] = False
        at_once += weight[who]
    sums = np.empty((3, len(wanted)))
    head, following = legs_by_end(end_of, len(ends[2]))
    for end in range(-1, len(ends[2])):
        if head[end + 1] < 0:
            continue
        start_s = place[0] + (ends[2][end] if end >= 0 else 0.0)
        count = see_on_the_way(end, start_s, around, (met_by, end + 2), found, nothing())
        reward, seen = worth_of(found, count, weight, goal)
        reward += at_once * reward_of(place[0], goal)
        c = head[end + 1]
        while c >= 0:
            marks = (met_by, end + 2, -1 - c)
            count = see_along_road((wanted[c], start_s), still, marks, world, found, nothing())
            more, others = worth_of(found, count, weight, goal)
            sums[0, c], sums[1, c], sums[2, c] = start_s, reward + more, seen + at_once + others
            c = following[c]
    return sums[0], sums[1], sums[2]
