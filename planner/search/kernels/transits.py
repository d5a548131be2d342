"""What straight flights from one place see, compiled: the first half of every what-if flight.

A transit can only see a particle while the ring around the UAV's place that grows with the UAV's
speed passes over it, and only in the directions in which the particle then lies. Transits in the
same direction share a ray, which is flown once, to its farthest end.
"""

from typing import TypeAlias

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets
from planner.jit import compiled
from planner.search.kernels.motion import (
    BEGIN,
    END,
    VX,
    VY,
    Motion,
    X,
    Y,
    bucket_of,
    met,
    piece_from,
    place_in,
)
from planner.search.kernels.passages import padded

Place: TypeAlias = tuple[float, float, float]  # time_s, x_m, y_m
# Ends of transits by rising bearing: bearing (E,), unit vector there (E, 2), seconds there (E,).
Ends: TypeAlias = tuple[Floats, Floats, Floats]
Rays: TypeAlias = tuple[Floats, Floats, Floats]  # the same, seconds to the farthest end, (m,) each
Chain: TypeAlias = tuple[Ints, Ints, Floats]  # next (M,), particle (M,), seen_at (M,)
Sensing: TypeAlias = tuple[float, float, bool]  # radius, the UAV's speed, on in transit as well


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
def rays_to(ends: Ends, wanted: Ints) -> tuple[Rays, Ints]:
    """Return the rays that lead to all wanted ends, and the ray of each end, (E,), -1: unwanted.

    ``wanted`` holds indices of ends, -1 for none.
    """
    bearings, ways, away_s = ends
    many, count = len(bearings), 0
    ray_of_end = np.full(many, -1, dtype=np.int32)
    for e in wanted:
        if e >= 0:
            ray_of_end[e] = 0
    rays: Rays = (np.empty(many), np.empty((many, 2)), np.zeros(many))
    for e in range(many):
        if ray_of_end[e] < 0:
            continue
        if count == 0 or rays[0][count - 1] != bearings[e]:
            rays[0][count], rays[1][count, 0], rays[1][count, 1] = (
                bearings[e],
                ways[e, 0],
                ways[e, 1],
            )
            count += 1
        ray_of_end[e] = count - 1
        rays[2][count - 1] = max(rays[2][count - 1], away_s[e])
    return (rays[0][:count], rays[1][:count], rays[2][:count]), ray_of_end


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
def ring_passes(sensing: Sensing, fastest_mps: float) -> float:
    """Return how long the ring takes at most to pass over a particle, seconds.

    Infinity if particles are about as fast as the UAV: then they may outrun the ring.
    """
    if fastest_mps >= 0.9 * sensing[1]:
        return np.inf
    return 2.0 * padded(sensing[0]) / (sensing[1] - fastest_mps)


@compiled
def ring_entry(
    place: Place, reach: tuple[float, float], pieces: Floats, at: tuple[int, int, float]
) -> tuple[float, int]:
    """Return when the ring around a transit's UAV has a particle inside it, and its piece then.

    The ring has the UAV's distance from its origin as radius and is one detection radius wide on
    both sides: outside it no transit, whatever its direction, can see the particle.

    Parameters
    ----------
    reach
        The detection radius, rather too large, and the UAV's speed.
    at
        The particle's piece at a second before which the ring has it not inside, its last piece,
        and that second.
    """
    start_s, x0, y0 = place
    reach_m, speed_mps = reach
    k, last, now_s = at
    while k < last:
        x, y = pieces[k + 1, X] - x0, pieces[k + 1, Y] - y0
        ring_m = reach_m + speed_mps * (pieces[k, END] - start_s)
        if x * x + y * y <= ring_m * ring_m:
            break
        now_s = pieces[k, END]
        k += 1
    x, y = place_in(pieces, k, now_s)
    ring_m = reach_m + speed_mps * (now_s - start_s)
    drift = (pieces[k, VX], pieces[k, VY])
    return now_s + ring_reaches((x - x0, y - y0), drift, ring_m, speed_mps), k


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
def linked(chain: Chain, count: int) -> Chain:
    """Return the chain with room for ``count`` entries and as many again."""
    room = 2 * count
    wide = (np.empty(room, np.int32), np.empty(room, np.int32), np.empty(room))
    for i in range(len(chain[0])):
        wide[0][i], wide[1][i], wide[2][i] = chain[0][i], chain[1][i], chain[2][i]
    return wide


@compiled
def facing(
    place: Place,
    pieces: Floats,
    k: int,
    window: tuple[float, float],
    reach: tuple[float, float],
) -> tuple[float, float, float, float, float]:
    """Return which directions a particle can be seen in during a window.

    Parameters
    ----------
    k
        The particle's piece at the window's start.
    reach
        The detection radius, rather too large, and the highest speed of any particle.

    Returns
    -------
    x, y, near_m
        A disc, relative to the place, outside which no UAV sees the particle meanwhile.
    low, wide
        The bearings, lowest and how many on, of all rays near it.
    """
    enter_s, leave_s = window
    half_s = 0.5 * (leave_s - enter_s)
    if leave_s <= pieces[k, END]:
        x, y = place_in(pieces, k, enter_s + half_s)
        speed_mps = np.sqrt(pieces[k, VX] * pieces[k, VX] + pieces[k, VY] * pieces[k, VY])
        near_m = reach[0] + half_s * speed_mps
    else:
        x, y = place_in(pieces, k, enter_s)
        near_m = reach[0] + 2.0 * half_s * reach[1]
    low, wide = rays_near(x - place[1], y - place[2], near_m)
    return x - place[1], y - place[2], near_m, low, wide


@compiled
def all_windows(
    place: Place, over_s: float, unseen: Flags, motion: Motion, sensing: Sensing
) -> tuple[Ints, Offsets, Floats]:
    """Return who is seen at once, and when and where others can be seen on any ray until a time.

    Returns
    -------
    here, who, windows
        The particles within the radius; the others and their pieces at the windows' starts,
        (m, 2); from, to, and what ``facing`` returns, (m, 7).
    """
    pieces, first_piece, end_s, clock, _, _, fastest_mps = motion
    start_s, x0, y0 = place
    (radius_m, speed_mps, _), reach_m = sensing, padded(sensing[0])
    here, at_once = np.empty(len(unseen), dtype=np.int32), 0
    who, count = np.empty((len(unseen), 2), dtype=np.int64), 0
    windows = np.empty((len(unseen), 7))
    now_in, passes_s = clock[bucket_of(motion, start_s)], ring_passes(sensing, fastest_mps)
    for p in range(len(unseen)):
        if not unseen[p] or end_s[p] < start_s:
            continue
        last = first_piece[p + 1] - 1
        k = piece_from(pieces, now_in[p], last, start_s)
        enter_s, to_s = max(start_s, pieces[k, BEGIN]), min(over_s, end_s[p])
        x, y = place_in(pieces, k, enter_s)
        away_m = np.sqrt((x - x0) * (x - x0) + (y - y0) * (y - y0))
        if away_m <= radius_m and enter_s == start_s:
            here[at_once] = p
            at_once += 1
            continue
        x, y, near_m, low, wide = 0.0, 0.0, np.inf, -2.0, 4.0
        if passes_s < np.inf:
            outside_m = away_m - reach_m - speed_mps * (enter_s - start_s)
            enter_s += max(0.0, outside_m) / (speed_mps + fastest_mps)  # earlier is impossible
            if enter_s > to_s:
                continue
            if pieces[k, END] <= enter_s:
                k = max(k, clock[bucket_of(motion, enter_s), p])
                k = piece_from(pieces, k, last, enter_s)
            enter_s, k = ring_entry(place, (reach_m, speed_mps), pieces, (k, last, enter_s))
            window = (enter_s, enter_s + passes_s)
            x, y, near_m, low, wide = facing(place, pieces, k, window, (reach_m, fastest_mps))
        if enter_s <= to_s:
            who[count, 0], who[count, 1] = p, k
            windows[count, 0], windows[count, 1] = enter_s, min(to_s, enter_s + passes_s)
            windows[count, 2], windows[count, 3], windows[count, 4] = x, y, near_m
            windows[count, 5], windows[count, 6] = low, wide
            count += 1
    return here[:at_once], who[:count], windows[:count]


@compiled
def ray_sightings(
    place: Place, rays: Rays, unseen: Flags, motion: Motion, sensing: Sensing
) -> tuple[Ints, Ints, Chain]:
    """Return what the UAV sees at its place and along each ray.

    Returns
    -------
    here, head, chain
        The particles seen at once, whatever the ray; the head of each ray's chain of further
        sightings (-1: nothing), and the chains.
    """
    (bearings, ways, far_s), (start_s, x0, y0), pieces = rays, place, motion[0]
    radius_m, speed_mps, _ = sensing
    many, over_s, count = len(bearings), start_s, 0
    for away_s in far_s:
        over_s = max(over_s, start_s + away_s)
    here, who, windows = all_windows(place, over_s, unseen, motion, sensing)
    head = np.full(many, -1, dtype=np.int32)
    chain: Chain = (np.empty(many, np.int32), np.empty(many, np.int32), np.empty(many))
    for i in range(len(who)):
        x, y, near_m = windows[i, 2], windows[i, 3], windows[i, 4]
        low, wide = windows[i, 5], windows[i, 6]
        j = first_from(bearings, low, 0, many)
        for _ in range(many):
            j = j if j < many else 0
            if turn_from(low, bearings[j]) > wide:  # most particles lie on nobody's way
                break
            leave_s = min(windows[i, 1], start_s + far_s[j])
            aside_m = abs(x * ways[j, 1] - y * ways[j, 0])
            if windows[i, 0] <= leave_s and aside_m <= near_m:
                flight = (x0, y0, speed_mps * ways[j, 0], speed_mps * ways[j, 1], start_s)
                seen = met(flight, (windows[i, 0], leave_s), pieces, who[i, 1], radius_m)
                if seen < np.inf:
                    if count == len(chain[0]):
                        chain = linked(chain, count + 1)
                    chain[0][count], chain[1][count], chain[2][count] = head[j], who[i, 0], seen
                    head[j] = count
                    count += 1
            j += 1
    return here, head, chain
