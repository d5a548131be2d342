"""Where all particles are, compiled: by cell, and by slab of time as long as they move.

Particles on the move stand in every cell that they touch during a slab, those at rest in their
cell by when they came to rest. So who looks into the cells within the radius of a piece of flight,
in its own slabs, misses nobody.
"""

from typing import TypeAlias

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import FuturesColumns, last_at_or_before, piece_at
from planner.jit import compiled
from planner.search.kernels.passages import Box, cell_range

Slabs: TypeAlias = tuple[float, float, int]  # when the first begins, how long each is, how many
# first (slabs x cells + 1,), particle, its knot at the slab's begin (M,)
Moving: TypeAlias = tuple[Offsets, Ints, Ints]
# first (cells + 1,), particle, since when (rising within a cell), x, y (N,)
Resting: TypeAlias = tuple[Offsets, Ints, Floats, Floats, Floats]
Crowd: TypeAlias = tuple[FuturesColumns, Box, Slabs, Moving, Resting]

CELLS = 64  # across the whole box, either way; more find less but cost more to look up


@compiled
def cells_around(futures: FuturesColumns, radius_m: float, many: int) -> Box:
    """Return a box of at most about ``many`` times ``many`` cells around all places."""
    _, x_m, y_m, _, _ = futures
    if len(x_m) == 0:
        return 0.0, 0.0, 1.0, 1, 1
    west, south = x_m.min(), y_m.min()
    width, height = x_m.max() - west, y_m.max() - south
    size = max(2.0 * radius_m, width / many, height / many, 1e-3)
    return west, south, size, int(width / size) + 1, int(height / size) + 1


@compiled
def slab_at(slabs: Slabs, moment_s: float) -> int:
    """Return the slab that holds a moment, the later one of two; the first for all before it."""
    s = max(0, int((moment_s - slabs[0]) / slabs[1]))
    while s > 0 and slabs[0] + s * slabs[1] > moment_s:
        s -= 1
    while slabs[0] + (s + 1) * slabs[1] <= moment_s:
        s += 1
    return s


@compiled
def stretch(
    motion: tuple[Floats, Floats, Floats], knots: tuple[int, int], low_s: float, high_s: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the rectangle that a particle touches in a time span: its lower and upper corner."""
    k, k_end = knots
    x, y, vx, vy, until_s = piece_at(motion, k, k_end, max(low_s, motion[0][k]))
    low_x, high_x, low_y, high_y = x, x, y, y
    now_s = max(low_s, motion[0][k])
    while True:
        over_s = min(high_s, until_s) - now_s
        x, y = x + vx * over_s, y + vy * over_s
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
        if until_s >= high_s or k + 1 >= k_end:
            break
        k, now_s = k + 1, until_s
        x, y, vx, vy, until_s = piece_at(motion, k, k_end, now_s)
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
    return (low_x, low_y), (high_x, high_y)


@compiled
def stand_in_cells(
    who: int,
    futures: FuturesColumns,
    grid: tuple[Box, Slabs],
    free: Offsets,
    columns: tuple[Ints, Ints],
    writing: bool,
) -> None:
    """Write down a particle in each cell that it touches, by slab, until it comes to rest.

    Goes to the cell's free entry, which moves on; if not ``writing``, only this.
    """
    time_s, x_m, y_m, first_knot, _ = futures
    box, slabs = grid
    k, k_end = first_knot[who], first_knot[who + 1]
    if k == k_end:
        return
    end_s = time_s[k_end - 1]
    for s in range(slab_at(slabs, time_s[k]), slabs[2]):
        low_s, high_s = slabs[0] + s * slabs[1], slabs[0] + (s + 1) * slabs[1]
        if low_s > end_s or high_s < time_s[k]:
            break
        k = last_at_or_before(time_s, k, k_end, low_s)
        near = stretch((time_s, x_m, y_m), (k, k_end), low_s, min(high_s, end_s))
        a, b, c, d = cell_range(box, near[0], near[1])
        for row in range(c, d + 1):
            at = (s * box[4] + row) * box[3]
            for cell in range(at + a, at + b + 1):
                if writing:
                    columns[0][free[cell]], columns[1][free[cell]] = who, k
                free[cell] += 1


@compiled
def moving_by_cell(futures: FuturesColumns, box: Box, slabs: Slabs) -> Moving:
    """Return for each slab and cell the particles that touch it before they come to rest."""
    free = np.zeros(slabs[2] * box[3] * box[4], dtype=np.int64)
    nothing = (np.empty(0, np.int32), np.empty(0, np.int32))
    for who in range(len(futures[3]) - 1):
        stand_in_cells(who, futures, (box, slabs), free, nothing, False)
    first = np.zeros(len(free) + 1, dtype=np.int64)
    first[1:] = np.cumsum(free)
    free[:] = first[:-1]
    columns = (np.empty(first[-1], np.int32), np.empty(first[-1], np.int32))
    for who in range(len(futures[3]) - 1):
        stand_in_cells(who, futures, (box, slabs), free, columns, True)
    return first, columns[0], columns[1]


@compiled
def resting_by_cell(futures: FuturesColumns, box: Box) -> Resting:
    """Return for each cell the particles that come to rest there, the first to rest first."""
    time_s, x_m, y_m, first_knot, gone = futures
    particles = len(first_knot) - 1
    first = np.zeros(box[3] * box[4] + 1, dtype=np.int64)
    cell_of = np.full(particles, -1)
    rests = np.full(particles, np.inf)
    for who in range(particles):
        last = first_knot[who + 1] - 1
        if last >= first_knot[who] and not gone[who]:
            a, _, c, _ = cell_range(box, (x_m[last], y_m[last]), (x_m[last], y_m[last]))
            cell_of[who] = min(c, box[4] - 1) * box[3] + min(a, box[3] - 1)
            rests[who] = time_s[last]
            first[cell_of[who] + 1] += 1
    first = np.cumsum(first)
    free = first.copy()
    particle = np.empty(first[-1], dtype=np.int32)
    columns = (np.empty(first[-1]), np.empty(first[-1]), np.empty(first[-1]))
    for who in np.argsort(rests, kind="mergesort"):
        if cell_of[who] >= 0:
            at, last = free[cell_of[who]], first_knot[who + 1] - 1
            particle[at], columns[0][at] = who, rests[who]
            columns[1][at], columns[2][at] = x_m[last], y_m[last]
            free[cell_of[who]] += 1
    return first, particle, columns[0], columns[1], columns[2]


@compiled
def crowd_of(
    futures: FuturesColumns, radius_m: float, fastest_mps: float, span: tuple[float, float]
) -> Crowd:
    """Return the particles by cell and slab, for flights in a span of time, seconds."""
    box = cells_around(futures, radius_m, CELLS)
    lasts_s = max(span[1] - span[0], 1e-3)
    slab_s = min(lasts_s, max(lasts_s / 1000.0, box[2] / max(fastest_mps, 1e-3)))
    slabs = (span[0], slab_s, int(lasts_s / slab_s) + 1)
    return (
        futures,
        box,
        slabs,
        moving_by_cell(futures, box, slabs),
        resting_by_cell(futures, box),
    )
