"""What a flight over free waypoints sees, compiled: only what lies near it in space and time.

A piece of the flight looks only into the cells that it passes, in its own slabs of time; whoever
is found there goes through the same closed form as the detection along a finished plan.

A flight that differs from a known one from some waypoint on sees the same before; so only what
follows is swept again, and only for particles not seen until then.
"""

from typing import TypeAlias

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.kernels.closest_approach import FuturesColumns, first_within, piece_at
from planner.jit import compiled
from planner.search.kernels.cells import Crowd, slab_at
from planner.search.kernels.passages import Box, cell_range, padded
from planner.search.kernels.what_if import reward_of

Piece: TypeAlias = tuple[float, float, float, float, float, float]  # from_s, x, y, vx, vy, to_s
# x, y of where the UAV has to land, by when, when sightings end to count, the UAV's speed
Limits: TypeAlias = tuple[float, float, float, float, float]
Goal: TypeAlias = tuple[float, float]  # horizon, deadline (inf: none); seconds
# place of each particle among the known flight's sightings (N,), round in which it was last met
# (N,), and two numbers: how many of the known sightings stand, this round
Book: TypeAlias = tuple[Ints, Ints, int, int]
Found: TypeAlias = tuple[Ints, Floats]  # particle (N,), seen_at (N,)
Way: TypeAlias = Floats  # (3, W), rows as below; the first is where the UAV takes off
# reward to be reached, margin of a guess, marks of the known flight, its number of waypoints
Bar: TypeAlias = tuple[float, float, Floats, int]
Marks: TypeAlias = Floats  # (4, W), rows as below, as they stand when a waypoint is left

X, Y, WAIT = 0, 1, 2
LEFT, REWARD, WEIGHT, SEEN = 0, 1, 2, 3

RARE = 1e-3  # share of all particles from which on the others say nothing about what to expect
NOWHERE = (0.0, 0.0, 0.0, 0.0, 0.0, -np.inf)  # a piece that is not flown


@compiled
def columns_in_row(box: Box, row: int, piece: Piece, radius_m: float) -> tuple[int, int]:
    """Return from which to which column of a row a piece of flight passes within the radius."""
    from_s, x, y, vx, vy, to_s = piece
    low_s, high_s = 0.0, to_s - from_s
    if abs(vy) > 1e-9:
        a = (box[1] + row * box[2] - radius_m - y) / vy
        b = (box[1] + (row + 1) * box[2] + radius_m - y) / vy
        low_s, high_s = max(low_s, min(a, b)), min(high_s, max(a, b))
        if low_s > high_s + 1e-6:
            return 0, -1
    low_x, high_x = x + vx * low_s, x + vx * high_s
    near_m = radius_m + 1e-4 * (abs(vx) + abs(vy))  # more than rounding can cost
    a, b, _, _ = cell_range(
        box, (min(low_x, high_x) - near_m, box[1]), (max(low_x, high_x) + near_m, box[1])
    )
    return a, b


@compiled
def rows_of(box: Box, piece: Piece, radius_m: float) -> tuple[int, int]:
    """Return from which to which row of cells a piece of flight passes within the radius."""
    from_s, x, y, _, vy, to_s = piece
    far_y = y + vy * (to_s - from_s)
    _, _, c, d = cell_range(box, (x, min(y, far_y) - radius_m), (x, max(y, far_y) + radius_m))
    return c, d


@compiled
def met_on_the_move(
    piece: Piece, futures: FuturesColumns, particle: int, k: int, radius_m: float
) -> float:
    """Return when a piece of flight first sees a particle that moves, infinity if not.

    ``k`` is a knot that the particle has passed when the piece begins, or its first one.
    """
    time_s, x_m, y_m, first_knot, _ = futures
    from_s, x, y, vx, vy, to_s = piece
    k_end = first_knot[particle + 1]
    now_s = max(from_s, time_s[k])
    while k + 1 < k_end and time_s[k + 1] <= now_s:
        k += 1
    to_s = min(to_s, time_s[k_end - 1])
    while now_s <= to_s:
        px, py, pvx, pvy, until_s = piece_at((time_s, x_m, y_m), k, k_end, now_s)
        until_s = min(until_s, to_s)
        since_s = now_s - from_s
        offset = (px - x - vx * since_s, py - y - vy * since_s)
        after_s = first_within(offset, (pvx - vx, pvy - vy), until_s - now_s, radius_m)
        if after_s < np.inf:
            return now_s + after_s
        if until_s >= to_s:
            break
        k, now_s = k + 1, until_s
    return np.inf


@compiled
def see_moving(
    piece: Piece, crowd: Crowd, radius_m: float, book: Book, found: Found, count: int
) -> int:
    """Write down the moving particles that a piece of flight sees first; return the new count."""
    futures, box, slabs, (first, particle, knot), _ = crowd
    place, met, stands, number = book
    start_s, x, y, vx, vy, end_s = piece
    near_m = padded(radius_m)
    for s in range(slab_at(slabs, start_s), slabs[2]):
        low_s = max(start_s, slabs[0] + s * slabs[1])
        high_s = min(end_s, slabs[0] + (s + 1) * slabs[1])
        if low_s > end_s or high_s < low_s:
            break
        since_s = low_s - start_s
        part = (low_s, x + vx * since_s, y + vy * since_s, vx, vy, high_s)
        c, d = rows_of(box, part, near_m)
        for row in range(c, d + 1):
            a, b = columns_in_row(box, row, part, near_m)
            if a > b:
                continue
            at = (s * box[4] + row) * box[3]
            for i in range(first[at + a], first[at + b + 1]):
                who = particle[i]
                if place[who] < stands or met[who] == number:
                    continue
                seen = met_on_the_move(part, futures, who, knot[i], radius_m)
                if seen < np.inf:
                    found[0][count], found[1][count] = who, seen
                    met[who] = number
                    count += 1
    return count


@compiled
def see_resting(
    piece: Piece, crowd: Crowd, radius_m: float, book: Book, found: Found, count: int
) -> int:
    """Write down the particles at rest that a piece of flight sees first; return the new count."""
    _, box, _, _, (first, particle, since_s, x_m, y_m) = crowd
    place, met, stands, number = book
    start_s, x, y, vx, vy, end_s = piece
    near_m = padded(radius_m)
    c, d = rows_of(box, piece, near_m)
    for row in range(c, d + 1):
        a, b = columns_in_row(box, row, piece, near_m)
        for cell in range(row * box[3] + a, row * box[3] + b + 1):
            for i in range(first[cell], first[cell + 1]):
                if since_s[i] > end_s:
                    break
                who = particle[i]
                if place[who] < stands or met[who] == number:
                    continue
                now_s = max(start_s, since_s[i])
                gone_by = now_s - start_s
                offset = (x_m[i] - x - vx * gone_by, y_m[i] - y - vy * gone_by)
                after_s = first_within(offset, (-vx, -vy), end_s - now_s, radius_m)
                if after_s < np.inf:
                    found[0][count], found[1][count] = who, now_s + after_s
                    met[who] = number
                    count += 1
    return count


@compiled
def must_turn(piece: Piece, limits: Limits) -> float:
    """Return until when a piece of flight can go on so that the way home is still in time.

    The piece is flown at the UAV's full speed, or hovers.
    """
    from_s, x, y, vx, vy, to_s = piece
    home_x, home_y, landing_s, _, speed_mps = limits
    left_m = (landing_s - from_s) * speed_mps
    if not landing_s < np.inf or not home_x < np.inf:
        return min(to_s, landing_s)
    dx, dy = x - home_x, y - home_y
    if vx == 0.0 and vy == 0.0:
        spare_s = (left_m - np.sqrt(dx * dx + dy * dy)) / speed_mps
    else:
        spare_m2 = left_m * left_m - dx * dx - dy * dy
        away = (dx * vx + dy * vy) / speed_mps + left_m
        spare_s = 0.5 * spare_m2 / away / speed_mps if spare_m2 > 0.0 else 0.0
    return from_s + min(to_s - from_s, max(0.0, spare_s))


@compiled
def piece_of(way: Way, i: int, waits: int, now_s: float, speed_mps: float) -> Piece:
    """Return the flight to a waypoint that sets out now, or the wait there."""
    if waits:
        return now_s, way[X, i], way[Y, i], 0.0, 0.0, now_s + way[WAIT, i]
    dx, dy = way[X, i] - way[X, i - 1], way[Y, i] - way[Y, i - 1]
    lasts_s = np.sqrt(dx * dx + dy * dy) / speed_mps
    vx, vy = (dx / lasts_s, dy / lasts_s) if lasts_s > 0.0 else (0.0, 0.0)
    return now_s, way[X, i - 1], way[Y, i - 1], vx, vy, now_s + lasts_s


@compiled
def cut(piece: Piece, until_s: float, limits: Limits) -> Piece:
    """Return a piece of flight up to a time, or to when sightings end to count."""
    from_s, x, y, vx, vy, _ = piece
    return from_s, x, y, vx, vy, min(until_s, limits[3])


@compiled
def way_home(piece: Piece, until_s: float, limits: Limits) -> Piece:
    """Return the flight home from where a piece of flight is at a time; none without a home."""
    from_s, x, y, vx, vy, _ = piece
    x, y = x + vx * (until_s - from_s), y + vy * (until_s - from_s)
    dx, dy = limits[0] - x, limits[1] - y
    lasts_s = np.sqrt(dx * dx + dy * dy) / limits[4]
    if not 0.0 < lasts_s < np.inf:
        return NOWHERE
    return cut((until_s, x, y, dx / lasts_s, dy / lasts_s, 0.0), until_s + lasts_s, limits)


@compiled
def flown(
    way: Way, many: int, i: int, now_s: float, limits: Limits
) -> tuple[tuple[Piece, Piece, Piece], float]:
    """Return how a waypoint is flown to, what is waited there, and the way home if it is due.

    Also when it is left; infinity if the flight is over by then.
    """
    if not now_s < limits[3]:
        return (NOWHERE, NOWHERE, NOWHERE), np.inf
    flight = piece_of(way, i, 0, now_s, limits[4])
    until_s = must_turn(flight, limits)
    if until_s < flight[5]:
        home = way_home(flight, until_s, limits)
        return (cut(flight, until_s, limits), NOWHERE, home), np.inf
    wait = piece_of(way, i, 1, until_s, limits[4])
    leaves_s = must_turn(wait, limits)
    due = leaves_s < wait[5] or i + 1 == many
    home = way_home(wait, leaves_s, limits) if due else NOWHERE
    pieces = (cut(flight, until_s, limits), cut(wait, leaves_s, limits), home)
    return pieces, (leaves_s if leaves_s == wait[5] else np.inf)


@compiled
def likely_reward(bar: Bar, now_s: float, reward: float, unseen: float, everyone: float) -> float:
    """Return the reward to which a flight may still come, with some margin.

    That is if its unseen particles, in weight, bring as much as those of the known flight do from
    the same time on.
    """
    _, margin, marks, many = bar
    total = marks[REWARD, many - 1]
    j = np.searchsorted(marks[LEFT, :many], now_s)
    if j == 0 or j >= many or not marks[LEFT, j] < np.inf:
        return np.inf
    share = (now_s - marks[LEFT, j - 1]) / (marks[LEFT, j] - marks[LEFT, j - 1])
    earned = marks[REWARD, j - 1] + share * (marks[REWARD, j] - marks[REWARD, j - 1])
    left = everyone - marks[WEIGHT, j - 1] - share * (marks[WEIGHT, j] - marks[WEIGHT, j - 1])
    if left <= RARE * everyone:
        return np.inf
    return reward + unseen / left * (total - earned) + margin


@compiled
def sweep(
    flight: tuple[Way, int, int],
    state: tuple[Marks, Found, Book],
    world: tuple[Crowd, float, Floats, Limits, Goal],
    bar: Bar,
) -> float:
    """Fly a way from a waypoint on and write down what it sees and earns; return the reward.

    Parameters
    ----------
    flight
        The way, its number of waypoints, and the waypoint from which on it is flown: what was
        seen until that one was left is in the marks before.
    bar
        The sweep ends, with a reward of minus infinity, as soon as the bar cannot be reached, or
        most probably will not be.
    """
    way, many, begin = flight
    marks, found, book = state
    crowd, radius_m, weight, limits, goal = world
    now_s, reward = marks[LEFT, begin - 1], marks[REWARD, begin - 1]
    met, count = marks[WEIGHT, begin - 1], int(marks[SEEN, begin - 1])
    everyone = weight.sum()
    for i in range(begin, many):
        pieces, now_s = flown(way, many, i, now_s, limits)
        for piece in pieces:
            if piece[5] <= piece[0] or met >= everyone * (1.0 - 1e-12):
                continue
            since = count
            count = see_moving(piece, crowd, radius_m, book, found, count)
            count = see_resting(piece, crowd, radius_m, book, found, count)
            for j in range(since, count):
                reward += weight[found[0][j]] * reward_of(found[1][j], goal)
                met += weight[found[0][j]]
        marks[LEFT, i], marks[REWARD, i], marks[WEIGHT, i] = now_s, reward, met
        marks[SEEN, i] = count
        likely = (
            likely_reward(bar, now_s, reward, everyone - met, everyone) if i > begin else np.inf
        )
        if min(likely, reward + (everyone - met) * reward_of(now_s, goal)) < bar[0]:
            return -np.inf
    return reward
