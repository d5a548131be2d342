"""Where all particles are, compiled: by cell, and by slab of time as long as they move.

Particles on the move are listed in every cell that they touch during a slab, those at rest in
their cell by when they came to rest. So whoever looks into the cells within the radius of a piece
of flight, in the slabs of that piece, misses nobody.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import (
    FuturesColumns,
    PathColumns,
    Rows,
    Vector,
    Window,
    knots_of,
    last_at_or_before,
    motion_at,
)
from planner.jit import compiled
from planner.search.kernels.passages import Box, cell_range


class Slabs(NamedTuple):
    """Equal spans of time, one after the other."""

    begin_s: float  # when the first one begins
    lasts_s: float  # how long each is
    many: int


class Moving(NamedTuple):
    """The particles on the move by slab and cell, cells as in ``Box``."""

    first: Offsets  # (slabs * cells + 1,) where a cell's entries start
    particle: Ints  # (M,)
    knot: Ints  # (M,) the particle's knot when the slab begins


class Resting(NamedTuple):
    """The particles at rest by cell; within a cell the first to rest first."""

    first: Offsets  # (cells + 1,) where a cell's entries start
    particle: Ints  # (M,)
    since_s: Floats  # (M,) seconds on the target's clock
    x_m: Floats  # (M,) metres
    y_m: Floats  # (M,) metres


class SpaceTimeGrid(NamedTuple):
    """All particles by cell and slab."""

    futures: FuturesColumns
    box: Box
    slabs: Slabs
    moving: Moving
    resting: Resting


class Entries(NamedTuple):
    """Room for the entries of ``Moving``."""

    particle: Ints  # (M,)
    knot: Ints  # (M,)


CELLS = 64  # across the whole box, either way; more find less but cost more to look up


@compiled
def cells_around(futures: FuturesColumns, radius_m: float, many: int) -> Box:
    """Return a box of at most about ``many`` times ``many`` cells around all places."""
    x_m, y_m = futures.x_m, futures.y_m
    if len(x_m) == 0:
        return Box(0.0, 0.0, 1.0, 1, 1)
    west, south = x_m.min(), y_m.min()
    width, height = x_m.max() - west, y_m.max() - south
    size = max(2.0 * radius_m, width / many, height / many, 1e-3)
    return Box(west, south, size, int(width / size) + 1, int(height / size) + 1)


@compiled
def slab_at(slabs: Slabs, moment_s: float) -> int:
    """Return the slab that holds a moment, the later one of two; the first for all before it."""
    s = max(0, int((moment_s - slabs.begin_s) / slabs.lasts_s))
    while s > 0 and slabs.begin_s + s * slabs.lasts_s > moment_s:
        s -= 1
    while slabs.begin_s + (s + 1) * slabs.lasts_s <= moment_s:
        s += 1
    return s


@compiled
def touched(knots: PathColumns, own: Rows, span: Window) -> tuple[Vector, Vector]:
    """Return the rectangle that a particle touches in a time span: its lower and upper corner.

    Parameters
    ----------
    own
        The particle's knots, from the one at or before the span's begin on.
    """
    k, k_end = own
    now_s = max(span.from_s, knots.time_s[k])
    x, y, vx, vy, until_s = motion_at(knots, k, k_end, now_s)
    low_x, high_x, low_y, high_y = x, x, y, y
    while True:
        over_s = min(span.to_s, until_s) - now_s
        x, y = x + vx * over_s, y + vy * over_s
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
        if until_s >= span.to_s or k + 1 >= k_end:
            break
        k, now_s = k + 1, until_s
        x, y, vx, vy, until_s = motion_at(knots, k, k_end, now_s)
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
    return (low_x, low_y), (high_x, high_y)


@compiled
def enter_into_cells(
    who: int, futures: FuturesColumns, box: Box, slabs: Slabs, free: Offsets, entries: Entries
) -> None:
    """Enter a particle into each cell that it touches, by slab, until it comes to rest.

    Goes to the cell's free entry, which moves on. Without room for entries it only counts.
    """
    knots, writing = knots_of(futures), len(entries.knot) > 0
    k, k_end = futures.first_knot[who], futures.first_knot[who + 1]
    if k == k_end:
        return
    begin_s, end_s = knots.time_s[k], knots.time_s[k_end - 1]
    for s in range(slab_at(slabs, begin_s), slabs.many):
        low_s, high_s = slabs.begin_s + s * slabs.lasts_s, slabs.begin_s + (s + 1) * slabs.lasts_s
        if low_s > end_s or high_s < knots.time_s[k]:
            break
        k = last_at_or_before(knots.time_s, k, k_end, low_s)
        low, high = touched(knots, Rows(k, k_end), Window(low_s, min(high_s, end_s)))
        west, east, south, north = cell_range(box, low, high)
        for row in range(south, north + 1):
            at = (s * box.rows + row) * box.columns
            for cell in range(at + west, at + east + 1):
                if writing:
                    entries.particle[free[cell]], entries.knot[free[cell]] = who, k
                free[cell] += 1


@compiled
def moving_by_cell(futures: FuturesColumns, box: Box, slabs: Slabs) -> Moving:
    """Return for each slab and cell the particles that touch it before they come to rest."""
    free = np.zeros(slabs.many * box.columns * box.rows, dtype=np.int64)
    none = Entries(np.empty(0, np.int32), np.empty(0, np.int32))
    for who in range(len(futures.gone)):
        enter_into_cells(who, futures, box, slabs, free, none)
    first = np.zeros(len(free) + 1, dtype=np.int64)
    first[1:] = np.cumsum(free)
    free[:] = first[:-1]
    entries = Entries(np.empty(first[-1], np.int32), np.empty(first[-1], np.int32))
    for who in range(len(futures.gone)):
        enter_into_cells(who, futures, box, slabs, free, entries)
    return Moving(first, entries.particle, entries.knot)


@compiled
def resting_by_cell(futures: FuturesColumns, box: Box) -> Resting:
    """Return for each cell the particles that come to rest there, the first to rest first."""
    time_s, x_m, y_m, first_knot, gone = futures
    particles = len(gone)
    first = np.zeros(box.columns * box.rows + 1, dtype=np.int64)
    cell_of = np.full(particles, -1)
    rests = np.full(particles, np.inf)
    for who in range(particles):
        last = first_knot[who + 1] - 1
        if last >= first_knot[who] and not gone[who]:
            place = (x_m[last], y_m[last])
            touches = cell_range(box, place, place)
            column, row = min(touches.west, box.columns - 1), min(touches.south, box.rows - 1)
            cell_of[who] = row * box.columns + column
            rests[who] = time_s[last]
            first[cell_of[who] + 1] += 1
    first = np.cumsum(first)
    free, many = first.copy(), first[-1]
    resting = Resting(
        first, np.empty(many, np.int32), np.empty(many), np.empty(many), np.empty(many)
    )
    for who in np.argsort(rests, kind="mergesort"):
        if cell_of[who] >= 0:
            at, last = free[cell_of[who]], first_knot[who + 1] - 1
            resting.particle[at], resting.since_s[at] = who, rests[who]
            resting.x_m[at], resting.y_m[at] = x_m[last], y_m[last]
            free[cell_of[who]] += 1
    return resting


@compiled
def grid_of(
    futures: FuturesColumns, radius_m: float, fastest_mps: float, span: Window
) -> SpaceTimeGrid:
    """Return the particles by cell and slab, for flights in a span of time."""
    box = cells_around(futures, radius_m, CELLS)
    lasts_s = max(span.to_s - span.from_s, 1e-3)
    slab_s = min(lasts_s, max(lasts_s / 1000.0, box.size_m / max(fastest_mps, 1e-3)))
    slabs = Slabs(span.from_s, slab_s, int(lasts_s / slab_s) + 1)
    moving, resting = moving_by_cell(futures, box, slabs), resting_by_cell(futures, box)
    return SpaceTimeGrid(futures, box, slabs, moving, resting)
