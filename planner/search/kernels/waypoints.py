"""What a flight over free waypoints sees, compiled: only what lies near it in space and time.

A piece of the flight looks only into the cells that it passes, in its own slabs of time; whoever
is found there goes through the same closed form as the detection along a finished plan.

A flight that differs from a known one from some waypoint on sees the same before; so only what
follows is swept again, and only for particles not seen until then.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.kernels.closest_approach import (
    FuturesColumns,
    first_within,
    knots_of,
    motion_at,
)
from planner.detection.kernels.worth import Goal, reward_of
from planner.jit import compiled
from planner.search.kernels.cells import SpaceTimeGrid, slab_at
from planner.search.kernels.passages import Box, cell_range, padded
from planner.search.kernels.waypoint_pieces import FlightLimits, FlightPiece, visit

LEFT, REWARD, WEIGHT, SEEN = 0, 1, 2, 3

RARE = 1e-3  # share of all particles from which on the others say nothing about what to expect


class FirstSightings(NamedTuple):
    """Room for sightings."""

    particle: Ints  # (M,)
    seen_at: Floats  # (M,) seconds on the target's clock


class Surroundings(NamedTuple):
    """What a flight has to know of the world."""

    grid: SpaceTimeGrid
    radius_m: float  # of the sensor
    weight: Floats  # (N,) probability of each particle
    limits: FlightLimits
    goal: Goal


class WaypointFlight(NamedTuple):
    """A flight over waypoints, with room for W of them, and what it sees."""

    way: Floats  # (3, W) rows X, Y in metres, WAIT in seconds; the first is the take-off
    # (4, W) as they stand when a waypoint is left: rows LEFT, when that is, in seconds; REWARD;
    # WEIGHT of the particles seen; SEEN, how many sightings
    marks: Floats
    found: FirstSightings  # room for N


class Change(NamedTuple):
    """A flight over ``many`` waypoints that may differ from the known one from ``begin`` on."""

    many: int
    begin: int


class Unseen(NamedTuple):
    """Which particles a sweep looks for: those not among the known sightings that stand."""

    rank: Ints  # (N,) a particle's place among the known flight's sightings
    last_round: Ints  # (N,) the round in which a particle was last seen
    stands: int  # how many of the known sightings stand
    round: int  # the one at hand


class Bar(NamedTuple):
    """The reward that a flight has to reach."""

    reward: float  # minus infinity: none
    margin: float  # how far below that it must be likely to end to be given up
    marks: Floats  # (4, W) of the known flight
    many: int  # the known flight's number of waypoints


@compiled
def columns_in_row(box: Box, row: int, piece: FlightPiece, radius_m: float) -> tuple[int, int]:
    """Return from which to which column of a row a piece of flight passes within the radius."""
    from_s, x, y, vx, vy, to_s = piece
    low_s, high_s = 0.0, to_s - from_s
    if abs(vy) > 1e-9:
        a = (box.south_m + row * box.size_m - radius_m - y) / vy
        b = (box.south_m + (row + 1) * box.size_m + radius_m - y) / vy
        low_s, high_s = max(low_s, min(a, b)), min(high_s, max(a, b))
        if low_s > high_s + 1e-6:
            return 0, -1
    low_x, high_x = x + vx * low_s, x + vx * high_s
    near_m = radius_m + 1e-4 * (abs(vx) + abs(vy))  # more than rounding can cost
    west_m, east_m = min(low_x, high_x) - near_m, max(low_x, high_x) + near_m
    touched = cell_range(box, (west_m, box.south_m), (east_m, box.south_m))
    return touched.west, touched.east


@compiled
def rows_passed(box: Box, piece: FlightPiece, radius_m: float) -> tuple[int, int]:
    """Return from which to which row of cells a piece of flight passes within the radius."""
    x, y = piece.x_m, piece.y_m
    far_y = y + piece.vy_mps * (piece.to_s - piece.from_s)
    touched = cell_range(box, (x, min(y, far_y) - radius_m), (x, max(y, far_y) + radius_m))
    return touched.south, touched.north


@compiled
def meeting_on_the_move(
    piece: FlightPiece, futures: FuturesColumns, particle: int, k: int, radius_m: float
) -> float:
    """Return when a piece of flight first sees a particle that moves, infinity if not.

    ``k`` is a knot that the particle has passed when the piece begins, or its first one.
    """
    knots, time_s = knots_of(futures), futures.time_s
    from_s, x, y, vx, vy, to_s = piece
    k_end = futures.first_knot[particle + 1]
    now_s = max(from_s, time_s[k])
    while k + 1 < k_end and time_s[k + 1] <= now_s:
        k += 1
    to_s = min(to_s, time_s[k_end - 1])
    while now_s <= to_s:
        px, py, pvx, pvy, until_s = motion_at(knots, k, k_end, now_s)
        until_s = min(until_s, to_s)
        since_s = now_s - from_s
        offset = (px - x - vx * since_s, py - y - vy * since_s)
        after_s = first_within(offset, (pvx - vx, pvy - vy), until_s - now_s, radius_m)
        if after_s < np.inf:
            return float(now_s + after_s)
        if until_s >= to_s:
            break
        k, now_s = k + 1, until_s
    return np.inf


@compiled
def is_wanted(who: int, unseen: Unseen) -> bool:
    """Tell whether a sweep still looks for a particle."""
    return bool(unseen.rank[who] >= unseen.stands and unseen.last_round[who] != unseen.round)


@compiled
def see_moving(
    piece: FlightPiece, around: Surroundings, unseen: Unseen, found: FirstSightings, count: int
) -> int:
    """Write down the moving particles that a piece of flight sees first; return the new count."""
    futures, box, slabs, moving, _ = around.grid
    start_s, x, y, vx, vy, end_s = piece
    near_m = padded(around.radius_m)
    for s in range(slab_at(slabs, start_s), slabs.many):
        low_s = max(start_s, slabs.begin_s + s * slabs.lasts_s)
        high_s = min(end_s, slabs.begin_s + (s + 1) * slabs.lasts_s)
        if low_s > end_s or high_s < low_s:
            break
        since_s = low_s - start_s
        part = FlightPiece(low_s, x + vx * since_s, y + vy * since_s, vx, vy, high_s)
        south, north = rows_passed(box, part, near_m)
        for row in range(south, north + 1):
            west, east = columns_in_row(box, row, part, near_m)
            if west > east:
                continue
            at = (s * box.rows + row) * box.columns
            for i in range(moving.first[at + west], moving.first[at + east + 1]):
                who = moving.particle[i]
                if not is_wanted(who, unseen):
                    continue
                seen_s = meeting_on_the_move(part, futures, who, moving.knot[i], around.radius_m)
                if seen_s < np.inf:
                    found.particle[count], found.seen_at[count] = who, seen_s
                    unseen.last_round[who] = unseen.round
                    count += 1
    return count


@compiled
def see_resting(
    piece: FlightPiece, around: Surroundings, unseen: Unseen, found: FirstSightings, count: int
) -> int:
    """Write down the particles at rest that a piece of flight sees first; return the new count."""
    box, resting = around.grid.box, around.grid.resting
    start_s, x, y, vx, vy, end_s = piece
    near_m = padded(around.radius_m)
    south, north = rows_passed(box, piece, near_m)
    for row in range(south, north + 1):
        west, east = columns_in_row(box, row, piece, near_m)
        for cell in range(row * box.columns + west, row * box.columns + east + 1):
            for i in range(resting.first[cell], resting.first[cell + 1]):
                if resting.since_s[i] > end_s:
                    break
                who = resting.particle[i]
                if not is_wanted(who, unseen):
                    continue
                now_s = max(start_s, resting.since_s[i])
                flown_s = now_s - start_s
                offset = (resting.x_m[i] - x - vx * flown_s, resting.y_m[i] - y - vy * flown_s)
                after_s = first_within(offset, (-vx, -vy), end_s - now_s, around.radius_m)
                if after_s < np.inf:
                    found.particle[count], found.seen_at[count] = who, now_s + after_s
                    unseen.last_round[who] = unseen.round
                    count += 1
    return count


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
    return float(reward + unseen / left * (total - earned) + margin)


@compiled
def sweep(
    flight: WaypointFlight, change: Change, unseen: Unseen, around: Surroundings, bar: Bar
) -> float:
    """Fly a way from a waypoint on and write down what it sees and earns; return the reward.

    Parameters
    ----------
    flight
        Its way is flown from ``change.begin`` on: what was seen until the waypoint before was left
        is in that one's marks.
    bar
        The sweep ends, with a reward of minus infinity, as soon as the bar cannot be reached, or
        most probably will not be.
    """
    way, marks, found = flight
    many, begin = change
    weight, limits, goal = around.weight, around.limits, around.goal
    now_s, reward = marks[LEFT, begin - 1], marks[REWARD, begin - 1]
    seen, count = marks[WEIGHT, begin - 1], int(marks[SEEN, begin - 1])
    everyone = weight.sum()
    for i in range(begin, many):
        visited = visit(way, many, i, now_s, limits)
        now_s = visited.leaves_s
        for piece in (visited.flight, visited.wait, visited.home):
            if piece.to_s <= piece.from_s or seen >= everyone * (1.0 - 1e-12):
                continue
            since = count
            count = see_moving(piece, around, unseen, found, count)
            count = see_resting(piece, around, unseen, found, count)
            for j in range(since, count):
                reward += weight[found.particle[j]] * reward_of(found.seen_at[j], goal)
                seen += weight[found.particle[j]]
        marks[LEFT, i], marks[REWARD, i], marks[WEIGHT, i] = now_s, reward, seen
        marks[SEEN, i] = count
        most = reward + (everyone - seen) * reward_of(now_s, goal)
        if i > begin:
            most = min(most, likely_reward(bar, now_s, reward, everyone - seen, everyone))
        if most < bar.reward:
            return -np.inf
    return float(reward)
