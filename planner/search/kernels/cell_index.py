"""What straight flights see, looked up by cell and tick; compiled.

Particles on the move are listed by tick and cell, those at rest by cell. A flight looks tick by
tick into the cells within the radius of it, and whoever is found there goes through the closed form
of the closest approach. So its cost grows with the particles near it, not with roads.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.kernels.closest_approach import FuturesColumns, Rows, Vector, Window
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
from planner.search.kernels.motion import BEGIN, Course, first_meeting, piece_from
from planner.search.kernels.passages import Box, cell_range, padded
from planner.search.kernels.what_if import Goal, reward_of


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
    goal: Goal


class Gain(NamedTuple):
    """What a flight earns."""

    reward: float
    weight: float  # of the particles that it sees first


MOST_CELLS = 2.0**24  # over all ticks: where there were more, cells are wider
SEEN = np.int32(2**31 - 1)  # in place of a flight's number: seen before all of them


@compiled
def cell_index(
    futures: FuturesColumns,
    pieces: Floats,
    weight: Floats,
    ticks: Slabs,
    radius_m: float,
    goal: Goal,
) -> CellIndex:
    """Return the particles by cell and tick; cells are as wide as the sensor sees, or wider."""
    across = int(np.sqrt(MOST_CELLS / ticks.many)) + 1
    box = cells_around(futures, radius_m, across)
    many = len(futures.gone)
    end_s, last_piece = np.full(many, np.inf), np.empty(many, np.int32)
    for who in range(many):
        last_piece[who] = futures.first_knot[who + 1] - 1
        if futures.gone[who] and last_piece[who] >= futures.first_knot[who]:
            end_s[who] = futures.time_s[last_piece[who]]
    moving, resting = moving_by_cell(futures, box, ticks), resting_by_cell(futures, box)
    return CellIndex(box, ticks, moving, resting, pieces, last_piece, end_s, weight, radius_m, goal)


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
def see(who: int, seen_s: float, index: CellIndex, seen_in: Ints, number: int) -> Gain:
    """Note that a flight sees a particle, if it does so before infinity; return what that earns."""
    if not seen_s < np.inf:
        return Gain(0.0, 0.0)
    seen_in[who] = number
    return Gain(index.weight[who] * reward_of(seen_s, index.goal), index.weight[who])


@compiled
def look_in_row(
    course: Course, part: Window, cells: Rows, index: CellIndex, seen_in: Ints, number: int
) -> Gain:
    """Return what a flight earns in part of a tick from some neighbouring cells of one row.

    ``cells`` are counted over all rows and ticks; parameters else as `look` has them.
    """
    moving, resting = index.moving, index.resting
    reward, weight, all_cells = 0.0, 0.0, index.box.columns * index.box.rows
    for i in range(moving.first[cells.begin], moving.first[cells.end]):
        who = moving.particle[i]
        if seen_in[who] < number:
            seen_s = sighting(course, part, who, moving.knot[i], index)
            gain = see(who, seen_s, index, seen_in, number)
            reward, weight = reward + gain.reward, weight + gain.weight
    for cell in range(cells.begin, cells.end):
        here = cell % all_cells
        for i in range(resting.first[here], resting.first[here + 1]):
            if resting.since_s[i] > part.to_s:
                break
            who = resting.particle[i]
            if seen_in[who] < number:
                seen_s = sighting(course, part, who, index.last_piece[who], index)
                gain = see(who, seen_s, index, seen_in, number)
                reward, weight = reward + gain.reward, weight + gain.weight
    return Gain(reward, weight)


@compiled
def look(course: Course, span: Window, index: CellIndex, seen_in: Ints, number: int) -> Gain:
    """Return what a straight flight earns in a span of time, and note whom it sees.

    Parameters
    ----------
    seen_in
        (N,) the number of the flight that saw a particle last; those of this flight or a later
        number, such as ``SEEN``, are not looked for.
    number
        Of this flight.
    """
    box, ticks = index.box, index.ticks
    reward, weight = 0.0, 0.0
    for tick in range(slab_at(ticks, span.from_s), ticks.many):
        begin_s = ticks.begin_s + tick * ticks.lasts_s
        if begin_s >= span.to_s:
            break
        part = Window(max(span.from_s, begin_s), min(span.to_s, begin_s + ticks.lasts_s))
        low, high = corners(course, part, index.radius_m)
        west, east, south, north = cell_range(box, low, high)
        for row in range(south, north + 1 if west <= east else south):
            at = (tick * box.rows + row) * box.columns
            cells = Rows(at + west, at + east + 1)
            gain = look_in_row(course, part, cells, index, seen_in, number)
            reward, weight = reward + gain.reward, weight + gain.weight
    return Gain(reward, weight)
