"""What straight flights see, looked up by cell and tick; compiled.

Particles on the move are listed by tick and cell, those at rest by cell. A flight looks tick by
tick into the cells within the radius of it, and whoever is found there goes through the closed form
of the closest approach. So its cost grows with the particles near it, not with roads.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import (
    FuturesColumns,
    Rows,
    Vector,
    Window,
    while_within,
)
from planner.detection.kernels.worth import Goal, worth_of, worth_of_contact
from planner.jit import compiled
from planner.search.kernels.cells import (
    Moving,
    Resting,
    Slabs,
    cells_around,
    moving_by_cell,
    resting_by_cell,
    slab_at,
)
from planner.search.kernels.contacts import passed_by
from planner.search.kernels.motion import (
    BEGIN,
    END,
    VX,
    VY,
    Course,
    first_meeting,
    piece_from,
    place_in,
)
from planner.search.kernels.passages import Box, cell_range, padded


class CellIndex(NamedTuple):
    """All particles by cell and tick, and what a sighting of each is worth."""

    box: Box
    ticks: Slabs
    moving: Moving
    resting: Resting
    pieces: Floats  # (K, 6) straight motion from each knot on, columns as in ``kernels.motion``
    last_piece: Ints  # (N,)
    end_s: Floats  # (N,) seconds, from when on a particle is nowhere; infinity: it rests
    weight: Floats  # (N,) probability of each particle
    radius_m: float  # of the sensor
    rate_per_s: float  # of its detection; infinity: it sees everybody
    goal: Goal


class Looked(NamedTuple):
    """Whom flights have seen, and how probably they have missed others."""

    # (N,) the number of the flight that saw a particle last, or, if the sensor may miss, was in
    # contact with it; who has that of the flight at hand, or a later one such as `SEEN`, is not
    # looked for, or not unless the sensor may miss
    seen_in: Ints
    # Only if the sensor may miss, else without entries:
    miss: Floats  # (N,) probability of being unseen before the flight at hand
    left: Floats  # (N,) and now, of those it has been in contact with
    part: Offsets  # (N + 1,) in which part of a tick each was last looked for; at the end the last


class PieceOf(NamedTuple):
    """A particle and one of its pieces."""

    particle: int
    piece: int


class Gain(NamedTuple):
    """What a flight earns."""

    reward: float
    weight: float  # of the particles that it sees first, as far as it does


MOST_CELLS = 2.0**24  # over all ticks: where there were more, cells are wider
SEEN = np.int32(2**31 - 1)  # in place of a flight's number: seen before all of them


@compiled
def cell_index(
    futures: FuturesColumns,
    pieces: Floats,
    weight: Floats,
    ticks: Slabs,
    sensor: tuple[float, float],
    goal: Goal,
) -> CellIndex:
    """Return the particles by cell and tick; cells are as wide as the sensor sees, or wider.

    ``sensor`` is its radius and its rate.
    """
    radius_m, rate_per_s = sensor
    across = int(np.sqrt(MOST_CELLS / ticks.many)) + 1
    box = cells_around(futures, radius_m, across)
    many = len(futures.gone)
    end_s, last_piece = np.full(many, np.inf), np.empty(many, np.int32)
    for who in range(many):
        last_piece[who] = futures.first_knot[who + 1] - 1
        if futures.gone[who] and last_piece[who] >= futures.first_knot[who]:
            end_s[who] = futures.time_s[last_piece[who]]
    moving, resting = moving_by_cell(futures, box, ticks), resting_by_cell(futures, box)
    return CellIndex(
        box, ticks, moving, resting, pieces, last_piece, end_s, weight, radius_m, rate_per_s, goal
    )


@compiled
def sighting(course: Course, window: Window, who: int, k: int, index: CellIndex) -> float:
    """Return when a straight flight first sees a particle within a span of time, or infinity.

    ``k`` is a piece of the particle that begins before the span does, or its first one.
    """
    pieces = index.pieces
    from_s, to_s = max(window.from_s, pieces[k, BEGIN]), min(window.to_s, index.end_s[who])
    if from_s > to_s:
        return np.inf
    k = piece_from(pieces, k, index.last_piece[who], from_s)
    return first_meeting(course, Window(from_s, to_s), pieces, k, index.radius_m)


@compiled
def corners(course: Course, span: Window, radius_m: float) -> tuple[Vector, Vector]:
    """Return the rectangle within a radius of a flight: its lower and upper corner."""
    x, y, vx, vy, at_s = course
    near_m = padded(radius_m)
    x1, x2 = x + vx * (span.from_s - at_s), x + vx * (span.to_s - at_s)
    y1, y2 = y + vy * (span.from_s - at_s), y + vy * (span.to_s - at_s)
    low = (min(x1, x2) - near_m, min(y1, y2) - near_m)
    return low, (max(x1, x2) + near_m, max(y1, y2) + near_m)


@compiled
def see(
    course: Course, part: Window, ahead: PieceOf, index: CellIndex, looked: Looked, number: int
) -> Gain:
    """Note that a flight sees a particle in part of a tick, if it does; return what that earns."""
    who, k = ahead
    if index.rate_per_s < np.inf:
        return see_in_part(course, part, ahead, index, looked, number)
    seen_s = sighting(course, part, who, k, index)
    if not seen_s < np.inf:
        return Gain(0.0, 0.0)
    looked.seen_in[who] = number
    return Gain(index.weight[who] * worth_of(who, seen_s, index.goal), index.weight[who])


@compiled
def see_in_part(
    course: Course, part: Window, ahead: PieceOf, index: CellIndex, looked: Looked, number: int
) -> Gain:
    """As `see`, for a sensor that may miss: exposures add up over parts, each looked at once."""
    (who, k), pieces, rate_per_s = ahead, index.pieces, index.rate_per_s
    if looked.part[who] == looked.part[-1]:
        return Gain(0.0, 0.0)
    looked.part[who] = looked.part[-1]
    now_s, over_s = max(part.from_s, pieces[k, BEGIN]), min(part.to_s, index.end_s[who])
    if now_s > over_s:
        return Gain(0.0, 0.0)
    reward, seen = 0.0, 0.0
    k = piece_from(pieces, k, index.last_piece[who], now_s)
    left = looked.left[who] if looked.seen_in[who] == number else looked.miss[who]
    x, y, vx, vy, at_s = course
    while True:
        until_s = min(over_s, pieces[k, END]) if k < index.last_piece[who] else over_s
        place, flown_s = place_in(pieces, k, now_s), now_s - at_s
        offset = (place[0] - x - vx * flown_s, place[1] - y - vy * flown_s)
        drift = (pieces[k, VX] - vx, pieces[k, VY] - vy)
        within = while_within(offset, drift, until_s - now_s, index.radius_m)
        if within.from_s < within.to_s:
            from_s, to_s = now_s + within.from_s, now_s + within.to_s
            unseen, passes = index.weight[who] * left, passed_by(from_s, to_s, rate_per_s)
            reward += unseen * worth_of_contact(who, from_s, to_s, rate_per_s, index.goal)
            seen += unseen * (1.0 - passes)
            left *= passes
        if until_s >= over_s:
            break
        now_s = until_s
        k += 1
    if seen > 0.0:
        looked.left[who], looked.seen_in[who] = left, number
    return Gain(reward, seen)


@compiled
def look_in_row(
    course: Course, part: Window, cells: Rows, index: CellIndex, looked: Looked, number: int
) -> Gain:
    """Return what a flight earns in part of a tick from some neighbouring cells of one row.

    ``cells`` are counted over all rows and ticks; parameters else as `look` has them.
    """
    moving, resting, seen_in = index.moving, index.resting, looked.seen_in
    again = index.rate_per_s < np.inf  # who was in contact may be missed still
    reward, weight, all_cells = 0.0, 0.0, index.box.columns * index.box.rows
    for i in range(moving.first[cells.begin], moving.first[cells.end]):
        who = moving.particle[i]
        if seen_in[who] < number or (again and seen_in[who] == number):
            gain = see(course, part, PieceOf(who, moving.knot[i]), index, looked, number)
            reward, weight = reward + gain.reward, weight + gain.weight
    for cell in range(cells.begin, cells.end):
        here = cell % all_cells
        for i in range(resting.first[here], resting.first[here + 1]):
            if resting.since_s[i] > part.to_s:
                break
            who = resting.particle[i]
            if seen_in[who] < number or (again and seen_in[who] == number):
                ahead = PieceOf(who, index.last_piece[who])
                gain = see(course, part, ahead, index, looked, number)
                reward, weight = reward + gain.reward, weight + gain.weight
    return Gain(reward, weight)


@compiled
def look(course: Course, span: Window, index: CellIndex, looked: Looked, number: int) -> Gain:
    """Return what a straight flight, of a number, earns in a span of time; note whom it sees."""
    box, ticks = index.box, index.ticks
    reward, weight = 0.0, 0.0
    for tick in range(slab_at(ticks, span.from_s), ticks.many):
        begin_s = ticks.begin_s + tick * ticks.lasts_s
        if begin_s >= span.to_s:
            break
        part = Window(max(span.from_s, begin_s), min(span.to_s, begin_s + ticks.lasts_s))
        looked.part[-1] += 1
        low, high = corners(course, part, index.radius_m)
        west, east, south, north = cell_range(box, low, high)
        for row in range(south, north + 1 if west <= east else south):
            at = (tick * box.rows + row) * box.columns
            cells = Rows(at + west, at + east + 1)
            gain = look_in_row(course, part, cells, index, looked, number)
            reward, weight = reward + gain.reward, weight + gain.weight
    return Gain(reward, weight)
