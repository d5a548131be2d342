"""What-if flights, compiled: what many legs would see from one place and time on.

A flight to a leg is first a transit, straight to the leg's start, then the road. Legs that start
at the same node share the transit, which is flown once. A transit can only see a particle while
the ring around the UAV's place that grows with the UAV's speed passes over it, and only in the
directions in which the particle then lies; a road only sees its own passages. Whatever remains
goes through the same closed form as the detection along a finished plan.
"""

from typing import TypeAlias

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets
from planner.detection.kernels import (
    FlightColumns,
    FuturesColumns,
    piece_at,
    seen_in_flight,
)
from planner.jit import compiled
from planner.search.kernels_passages import PassageColumns, padded

Place: TypeAlias = tuple[float, float, float]  # time_s, x_m, y_m
LegColumns: TypeAlias = tuple[Offsets, Floats, Floats, Floats]  # first_point, after_s, x_m, y_m
# rising bearing (m,), waypoints (2 m,) each, direction as a unit vector (m, 2)
Transits: TypeAlias = tuple[Floats, FlightColumns, Floats]
Chain: TypeAlias = tuple[Ints, Ints, Floats]  # next (M,), particle (M,), seen_at (M,)
Found: TypeAlias = tuple[Ints, Floats]  # particle (M,), seen_at (M,)
Sensing: TypeAlias = tuple[float, float, float]  # radius, the UAV's and the fastest target's speed


@compiled
def bearing(x: float, y: float) -> float:
    """Return a number in [-2, 2] that grows with the direction of a vector, like its angle."""
    slope = y / (abs(x) + abs(y))
    if x >= 0.0:
        return slope
    return 2.0 - slope if y >= 0.0 else -2.0 - slope


@compiled
def turn_from(low: float, other: float) -> float:
    """Return how far one bearing lies on from another one, in [0, 4]."""
    return other - low if other >= low else other - low + 4.0


@compiled
def bearings_of(offset: Floats) -> Floats:
    """Return the bearings of many vectors, (m, 2), as ``bearing`` does."""
    bearings = np.empty(len(offset))
    for i in range(len(offset)):
        bearings[i] = bearing(offset[i, 0], offset[i, 1])
    return bearings


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
def ring_reaches(
    offset: tuple[float, float], drift: tuple[float, float], ring_m: float, speed_mps: float
) -> float:
    """Return the second from which on a growing circle around the origin has a body inside.

    The circle has radius ``ring_m`` at second 0 and grows with ``speed_mps``, which is more than
    the body's own speed.
    """
    qx, qy = offset
    vx, vy = drift
    c = qx * qx + qy * qy - ring_m * ring_m
    if c <= 0.0:
        return 0.0
    a = speed_mps * speed_mps - vx * vx - vy * vy
    b = ring_m * speed_mps - qx * vx - qy * vy
    return (np.sqrt(max(0.0, b * b + a * c)) - b) / a


@compiled
def ring_passes(sensing: Sensing) -> float:
    """Return how long the ring takes at most to pass over a particle, seconds.

    Infinity if particles are about as fast as the UAV: then they may outrun the ring.
    """
    radius_m, speed_mps, fastest_mps = sensing
    if fastest_mps >= 0.9 * speed_mps:
        return np.inf
    return 2.0 * padded(radius_m) / (speed_mps - fastest_mps)


@compiled
def ring_entry(
    place: Place, futures: FuturesColumns, particle: int, sensing: Sensing, passes_s: float
) -> tuple[float, float, float, float]:
    """Return when the ring around a transit's UAV has a particle inside it, and where that is.

    The ring has the UAV's distance from its origin as radius and is one detection radius wide on
    both sides: outside it no transit, whatever its direction, can see the particle.

    Returns
    -------
    enter_s
        When the ring first has the particle inside; infinity if it is gone before. The ring has
        passed ``passes_s`` later.
    x, y, reach_m
        A disc, relative to the origin, outside which no UAV sees the particle meanwhile.
    """
    time_s, x_m, y_m, first_knot, gone = futures
    start_s, x0, y0 = place
    speed_mps, reach_m = sensing[1], padded(sensing[0])
    k, k_end = first_knot[particle], first_knot[particle + 1]
    if k == k_end:
        return np.inf, 0.0, 0.0, 0.0
    high = k_end
    while high - k > 1:
        middle = (k + high) // 2
        dx, dy = x_m[middle] - x0, y_m[middle] - y0
        ring_m = reach_m + speed_mps * (time_s[middle] - start_s)
        if ring_m < 0.0 or dx * dx + dy * dy > ring_m * ring_m:
            k = middle
        else:
            high = middle
    now_s = max(start_s, time_s[k])
    while k + 1 < k_end and time_s[k + 1] <= now_s:
        k += 1
    x, y, vx, vy, until_s = piece_at((time_s, x_m, y_m), k, k_end, now_s)
    x, y, ring_m = x - x0, y - y0, reach_m + speed_mps * (now_s - start_s)
    after_s = ring_reaches((x, y), (vx, vy), ring_m, speed_mps)
    if gone[particle] and now_s + after_s > time_s[k_end - 1]:
        return np.inf, 0.0, 0.0, 0.0
    if now_s + after_s + passes_s <= until_s:
        half_s = after_s + 0.5 * passes_s
        return (
            now_s + after_s,
            x + vx * half_s,
            y + vy * half_s,
            (reach_m + 0.5 * passes_s * np.sqrt(vx * vx + vy * vy)),
        )
    return now_s + after_s, x + vx * after_s, y + vy * after_s, reach_m + passes_s * sensing[2]


@compiled
def rays_near(x: float, y: float, reach_m: float) -> tuple[float, float]:
    """Return the bearings, lowest and how many on, of all rays from the origin near a place.

    Bearings grow at most as fast as angles in radians, and arcsin(s) <= 1.05 s up to s = 1/2.
    """
    away_m = np.sqrt(x * x + y * y)
    if away_m <= 2.0 * reach_m:
        return -2.0, 4.0
    aside = 1.05 * reach_m / away_m + 1e-9
    low = bearing(x, y) - aside
    return (low if low >= -2.0 else low + 4.0), 2.0 * aside


@compiled
def meet_transits(
    transits: Transits,
    where: tuple[float, float, float, float, float, int],
    seeing: tuple[FuturesColumns, int, tuple[float, float], float],
    head: Ints,
    chain: Chain,
    count: int,
) -> int:
    """Add to the chains the transits that see a particle in a window; return the new count.

    Looks only at transits whose ray comes near a disc and that have not arrived before. There
    must be room for all of them. ``where`` holds the disc's centre and radius, the bearings from
    which and how far on such rays lie, and the first of them.
    """
    bearings, waypoints, ways = transits
    x, y, reach_m, low, wide, j = where
    futures, particle, window, radius_m = seeing
    for _ in range(len(bearings)):
        if turn_from(low, bearings[j]) > wide:
            break
        near = abs(x * ways[j, 1] - y * ways[j, 0]) <= reach_m
        if near and waypoints[0][2 * j + 1] >= window[0]:
            points = (2 * j, 2 * j + 2)
            seen = seen_in_flight(waypoints, points, futures, particle, window, radius_m)
            if seen < np.inf:
                chain[0][count], chain[1][count], chain[2][count] = head[j], particle, seen
                head[j] = count
                count += 1
        j = j + 1 if j + 1 < len(bearings) else 0
    return count


@compiled
def transit_sightings(
    place: Place, transits: Transits, unseen: Flags, futures: FuturesColumns, sensing: Sensing
) -> tuple[Ints, Chain]:
    """Return what each transit sees: the head of its chain (-1: nothing), and the chains."""
    bearings, waypoints, _ = transits
    many = len(bearings)
    head = np.full(many, -1, dtype=np.int32)
    chain: Chain = (np.empty(many, np.int32), np.empty(many, np.int32), np.empty(many))
    count = 0
    over_s = -np.inf
    for j in range(many):
        over_s = max(over_s, waypoints[0][2 * j + 1])
    passes_s = ring_passes(sensing)
    enter_s, x, y, reach_m = place[0], 0.0, 0.0, np.inf
    for particle in range(len(unseen)):
        if not unseen[particle]:
            continue
        if passes_s < np.inf:
            enter_s, x, y, reach_m = ring_entry(place, futures, particle, sensing, passes_s)
        if enter_s > over_s:
            continue
        low, wide = rays_near(x, y, reach_m)
        j = first_from(bearings, low, 0, many)
        j = j if j < many else 0
        if turn_from(low, bearings[j]) > wide:  # most particles lie on nobody's way
            continue
        if count + many > len(chain[0]):
            chain = linked(chain, count + many)
        where = (x, y, reach_m, low, wide, j)
        seeing = (futures, particle, (enter_s, enter_s + passes_s), sensing[0])
        count = meet_transits(transits, where, seeing, head, chain, count)
    return head, chain


@compiled
def linked(chain: Chain, count: int) -> Chain:
    """Return the chain with room for ``count`` entries and as many again."""
    room, many = 2 * count, len(chain[0])
    wide = (np.empty(room, np.int32), np.empty(room, np.int32), np.empty(room))
    wide[0][:many], wide[1][:many], wide[2][:many] = chain
    return wide


@compiled
def lengths_of(head: Ints, chain: Chain) -> Ints:
    """Return how many entries each chain has."""
    lengths = np.zeros(len(head), dtype=np.int32)
    for j in range(len(head)):
        at = head[j]
        while at >= 0:
            lengths[j] += 1
            at = chain[0][at]
    return lengths


@compiled
def passages_within(
    passages: PassageColumns, entry: int, start_s: float, end_s: float
) -> tuple[int, int]:
    """Return from (included) and to (excluded) of a list's passages that may touch a time span."""
    first, from_s, _, latest_s, _ = passages
    # The running maximum of the ends tells where the first passage that is not over can be.
    begin = first_from(latest_s, start_s, first[entry], first[entry + 1])
    return begin, first_from(from_s, np.nextafter(end_s, np.inf), begin, first[entry + 1])


@compiled
def see_along_road(
    flight: tuple[FlightColumns, int],
    span: tuple[int, int],
    world: tuple[FuturesColumns, PassageColumns, float],
    marks: tuple[Flags, Ints, int],
    found: Found,
    count: int,
) -> int:
    """Write down what a flight along a road sees in a span of its passages; return the new count.

    ``marks`` tells who is still unseen, by which flight each particle was last met, and this
    flight's number.
    """
    futures, (_, from_s, to_s, _, particle), radius_m = world
    unseen, met, number = marks
    waypoints, points = flight
    start_s, end_s = waypoints[0][0], waypoints[0][points - 1]
    for i in range(span[0], span[1]):
        who = particle[i]
        if to_s[i] < start_s or not unseen[who] or met[who] == number:
            continue
        window = (max(start_s, from_s[i]), min(end_s, to_s[i]))
        seen = seen_in_flight(waypoints, (0, points), futures, who, window, radius_m)
        if seen < np.inf:
            found[0][count], found[1][count] = who, seen
            met[who] = number
            count += 1
    return count


@compiled
def see_on_the_way(
    head: int, chain: Chain, marks: tuple[Ints, int], found: Found, count: int
) -> int:
    """Write down what the transit to a road has seen; return the new count."""
    met, number = marks
    while head >= 0:
        who = chain[1][head]
        found[0][count], found[1][count] = who, chain[2][head]
        met[who] = number
        count += 1
        head = chain[0][head]
    return count


@compiled
def most_sightings(
    wanted: Ints, start_s: Floats, end_s: Floats, passages: PassageColumns, spans: Offsets
) -> int:
    """Find for each wanted leg the passages to look at, (C, 2, 2); return how many in all."""
    roads = len(passages[0]) // 2
    most = 0
    for c in range(len(wanted)):
        for rests in range(2):
            entry = wanted[c] // 2 + rests * roads
            begin, end = passages_within(passages, entry, start_s[c], end_s[c])
            spans[c, rests, 0], spans[c, rests, 1] = begin, end
            most += end - begin
    return most


@compiled
def leg_sightings(
    flights: tuple[Ints, Floats, Ints, Offsets],
    unseen: Flags,
    legs: LegColumns,
    world: tuple[FuturesColumns, PassageColumns, float],
    chain: Chain,
    found: Found,
) -> int:
    """Write down what each flight sees, on its transit and along its road; return how much.

    ``flights`` holds for each its leg, when its road begins, the head of its transit's chain, and
    its passages; in its last column they are then replaced by where its sightings end.
    """
    wanted, start_s, heads, spans = flights
    first_point, after_s, x_m, y_m = legs
    met = np.zeros(len(unseen), dtype=np.int32)
    longest = 0
    for leg in wanted:
        longest = max(longest, first_point[leg + 1] - first_point[leg])
    flight = (np.empty(longest), np.empty(longest), np.empty(longest))
    count = 0
    for c in range(len(wanted)):
        count = see_on_the_way(heads[c], chain, (met, c + 1), found, count)
        begin = first_point[wanted[c]]
        points = first_point[wanted[c] + 1] - begin
        for i in range(points):
            flight[0][i] = start_s[c] + after_s[begin + i]
            flight[1][i], flight[2][i] = x_m[begin + i], y_m[begin + i]
        for rests in range(2):
            span = (spans[c, rests, 0], spans[c, rests, 1])
            count = see_along_road(
                (flight, points), span, world, (unseen, met, c + 1), found, count
            )
        spans[c, 1, 1] = count
    return count
