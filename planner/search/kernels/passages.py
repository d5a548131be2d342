"""Which particle passes which road when: the compiled building of the passage index.

A passage is a stretch of time in which a particle may be within the radius of a road. It is cut
generously: what lies outside is certainly not seen from the road, what lies inside is still to be
checked. So a flight along a road has to look at that road's passages in its own minutes only.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import Vector
from planner.jit import compiled
from planner.search.kernels.motion import BEGIN, END, VX, VY, ParticleMotion, X, Y, zero


class PassageColumns(NamedTuple):
    """The passages of all particles in 2 R lists, one after the other, each by rising from_s.

    List r holds those that move past road r, list R + r those that rest there.
    """

    first: Offsets  # (2 R + 1,) where a list starts
    from_s: Floats  # (M,) seconds on the target's clock
    to_s: Floats  # (M,) seconds
    latest_s: Floats  # (M,) seconds, the running maximum of to_s in its list
    particle: Ints  # (M,)
    piece: Offsets  # (M,) the particle's piece at from_s


class RoadShapes(NamedTuple):
    """The polylines of all roads."""

    first_point: Offsets  # (R + 1,) where a road's points start
    x_m: Floats  # (P,) metres
    y_m: Floats  # (P,) metres


class Box(NamedTuple):
    """A rectangle cut into square cells, row by row from south to north, each from west to east."""

    west_m: float
    south_m: float
    size_m: float  # of a cell, either way
    columns: int
    rows: int


class CellRange(NamedTuple):
    """Which columns and rows of a box are touched, all ends included; none if from > to."""

    west: int
    east: int
    south: int
    north: int


class RoadCells(NamedTuple):
    """For each cell of a box, the road segments near it."""

    box: Box
    first: Offsets  # (cells + 1,) where a cell's segments start
    near: Ints  # (S, 2) the point at which a segment starts, and its road


class Records(NamedTuple):
    """Passages as they are found."""

    of: Ints  # (M, 4) columns as below
    times_s: Floats  # (M, 2) seconds from and to


LIST, PARTICLE, FIRST, LAST = 0, 1, 2, 3  # FIRST, LAST: pieces, the last one so far


class Stretch(NamedTuple):
    """Straight motion for some time."""

    x_m: float  # at its first second
    y_m: float
    vx_mps: float
    vy_mps: float
    lasts_s: float  # infinity: without end


class Roadsides(NamedTuple):
    """Where the roads are, and how near counts."""

    segments: Floats  # (P, 5) as ``segments_of`` returns them
    cells: RoadCells
    radius_m: float


class Looked(NamedTuple):
    """What has been looked at and recorded so far."""

    piece: Ints  # (P,) per road segment the piece looked at last, plus 1
    record: Ints  # (2 R,) per list the record opened last, -1: none


class PieceOf(NamedTuple):
    """A piece of a particle's motion."""

    piece: int
    particle: int
    gone_s: float  # when the particle is gone, seconds; infinity: never


@compiled
def padded(radius_m: float) -> float:
    """Return a radius that is certainly not too small, whatever is lost by rounding."""
    return radius_m * (1.0 + 1e-9) + 1e-6


@compiled
def cell_range(box: Box, low: Vector, high: Vector) -> CellRange:
    """Return the columns and rows of a box that a rectangle touches, given two of its corners."""
    west, south, size, columns, rows = box
    return CellRange(
        max(0, int(np.floor(max((low[0] - west) / size, -1.0)))),
        min(columns - 1, int(np.floor(min((high[0] - west) / size, columns)))),
        max(0, int(np.floor(max((low[1] - south) / size, -1.0)))),
        min(rows - 1, int(np.floor(min((high[1] - south) / size, rows)))),
    )


@compiled
def box_of(roads: RoadShapes, radius_m: float) -> Box:
    """Return a box of cells around all roads, with about one cell per road segment."""
    _, x_m, y_m = roads
    if len(x_m) == 0:
        return Box(0.0, 0.0, 1.0, 1, 1)
    west, east, south, north = x_m[0], x_m[0], y_m[0], y_m[0]
    for i in range(len(x_m)):
        west, east = min(west, x_m[i]), max(east, x_m[i])
        south, north = min(south, y_m[i]), max(north, y_m[i])
    west, south = west - radius_m, south - radius_m
    width, height = east + radius_m - west, north + radius_m - south
    size = max(np.sqrt(width * height / len(x_m)), max(width, height) / 1000.0, 2.0 * radius_m)
    return Box(west, south, size, int(width / size) + 1, int(height / size) + 1)


@compiled
def segment_cells(box: Box, roads: RoadShapes, point: int, radius_m: float) -> CellRange:
    """Return the cells from which the road segment after a point may be within the radius."""
    x_m, y_m = roads.x_m, roads.y_m
    low = (min(x_m[point], x_m[point + 1]) - radius_m, min(y_m[point], y_m[point + 1]) - radius_m)
    high = (max(x_m[point], x_m[point + 1]) + radius_m, max(y_m[point], y_m[point + 1]) + radius_m)
    return cell_range(box, low, high)


@compiled
def roads_by_cell(roads: RoadShapes, radius_m: float) -> RoadCells:
    """Return for each cell the road segments within the radius of it."""
    first_point = roads.first_point
    box = box_of(roads, radius_m)
    first = np.zeros(box.columns * box.rows + 1, dtype=np.int64)
    free = np.zeros(len(first), dtype=np.int64)
    near = np.empty((0, 2), np.int32)
    for filling in range(2):
        if filling:
            for cell in range(len(first) - 1):
                first[cell + 1] += first[cell]
                free[cell] = first[cell]
            near = np.empty((first[-1], 2), np.int32)
        for road in range(len(first_point) - 1):
            for point in range(first_point[road], first_point[road + 1] - 1):
                west, east, south, north = segment_cells(box, roads, point, radius_m)
                for row in range(south, north + 1):
                    for cell in range(row * box.columns + west, row * box.columns + east + 1):
                        if filling:
                            near[free[cell], 0], near[free[cell], 1] = point, road
                            free[cell] += 1
                        else:
                            first[cell + 1] += 1
    return RoadCells(box, first, near)


@compiled
def segments_of(roads: RoadShapes) -> Floats:
    """Return start x, y, direction x, y and length of the road segment after each point, (P, 5)."""
    _, x_m, y_m = roads
    segments = np.zeros((len(x_m), 5))
    for point in range(len(x_m) - 1):
        ex, ey = x_m[point + 1] - x_m[point], y_m[point + 1] - y_m[point]
        length = np.sqrt(ex * ex + ey * ey)
        ex, ey = (ex / length, ey / length) if length > 0.0 else (1.0, 0.0)
        segments[point, 0], segments[point, 1] = x_m[point], y_m[point]
        segments[point, 2], segments[point, 3], segments[point, 4] = ex, ey, length
    return segments


@compiled
def beside_segment(
    motion: Stretch, segments: Floats, point: int, radius_m: float
) -> tuple[float, float]:
    """Return from and to, seconds into a straight motion, when it may be near a road segment.

    Near is the rectangle that reaches one radius beyond the segment on all sides; from > to if
    the motion misses it.
    """
    x, y, vx, vy, lasts_s = motion
    dx, dy = x - segments[point, 0], y - segments[point, 1]
    ex, ey = segments[point, 2], segments[point, 3]
    from_s, to_s = inside(dy * ex - dx * ey, vy * ex - vx * ey, -radius_m, radius_m)
    if from_s > lasts_s or to_s < 0.0:
        return 1.0, 0.0
    far_m = segments[point, 4] + radius_m
    low_s, high_s = inside(dx * ex + dy * ey, vx * ex + vy * ey, -radius_m, far_m)
    return max(0.0, from_s, low_s), min(lasts_s, to_s, high_s)


@compiled
def inside(place: float, speed: float, low: float, high: float) -> tuple[float, float]:
    """Return from and to, seconds, when a coordinate that moves evenly is in [low, high]."""
    if speed == 0.0:
        return (-np.inf, np.inf) if low <= place <= high else (np.inf, -np.inf)
    a, b = (low - place) / speed, (high - place) / speed
    return min(a, b), max(a, b)


@compiled
def room_for(count: int) -> Records:
    """Return empty columns for a number of records."""
    return Records(np.empty((count, 4), dtype=np.int32), np.empty((count, 2)))


@compiled
def with_more_room(records: Records) -> Records:
    """Return the same records with room for twice as many."""
    many = len(records.of)
    larger = room_for(2 * many)
    for i in range(many):
        for j in range(4):
            larger.of[i, j] = records.of[i, j]
        for j in range(2):
            larger.times_s[i, j] = records.times_s[i, j]
    return larger


@compiled
def record_piece(
    part: PieceOf,
    pieces: Floats,
    roadsides: Roadsides,
    looked: Looked,
    records: Records,
    count: int,
) -> int:
    """Write down one piece of a particle's motion beside every road that it passes.

    Consecutive pieces beside the same road make one passage. Returns the new count of records,
    for which there must be room.
    """
    k, who, gone_s = part
    box, first, near = roadsides.cells
    radius_m, of, times_s = roadsides.radius_m, records.of, records.times_s
    begin_s, lasts_s = pieces[k, BEGIN], min(pieces[k, END], gone_s) - pieces[k, BEGIN]
    x, y, vx, vy = pieces[k, X], pieces[k, Y], pieces[k, VX], pieces[k, VY]
    motion = Stretch(x, y, vx, vy, lasts_s)
    way_s, rests = (lasts_s, 0) if lasts_s < np.inf else (0.0, len(looked.record) // 2)
    far_x, far_y = x + vx * way_s, y + vy * way_s
    low, high = (min(x, far_x), min(y, far_y)), (max(x, far_x), max(y, far_y))
    west, east, south, north = cell_range(box, low, high)
    for row in range(south, north + 1 if west <= east else south):
        for i in range(first[row * box.columns + west], first[row * box.columns + east + 1]):
            segment, entry = near[i, 0], near[i, 1] + rests
            if looked.piece[segment] == k + 1:
                continue
            looked.piece[segment] = k + 1
            from_s, to_s = beside_segment(motion, roadsides.segments, segment, radius_m)
            if from_s <= to_s:
                at = looked.record[entry]
                if at < 0 or of[at, PARTICLE] != who or of[at, LAST] < k - 1:
                    at = looked.record[entry] = count
                    count += 1
                    of[at, LIST], of[at, PARTICLE], of[at, FIRST] = entry, who, k
                    times_s[at, 0], times_s[at, 1] = np.inf, -np.inf
                of[at, LAST] = k
                times_s[at, 0] = min(times_s[at, 0], begin_s + from_s)
                times_s[at, 1] = max(times_s[at, 1], begin_s + to_s)
    return count


@compiled
def all_passages(motion: ParticleMotion, roads: RoadShapes, radius_m: float) -> Records:
    """Return every particle's passages along every road, in no certain order."""
    many, near_m = len(roads.first_point) - 1, padded(radius_m)
    roadsides = Roadsides(segments_of(roads), roads_by_cell(roads, near_m), near_m)
    looked = Looked(np.zeros(len(roads.x_m), np.int32), np.full(2 * many, -1, np.int32))
    records = room_for(2 * len(motion.pieces) + many)
    count = zero()
    for who in range(len(motion.end_s)):
        for k in range(motion.first_piece[who], motion.first_piece[who + 1]):
            if count + many > len(records.of):
                records = with_more_room(records)
            part = PieceOf(k, who, motion.end_s[who])
            count = record_piece(part, motion.pieces, roadsides, looked, records, count)
    return Records(records.of[:count], records.times_s[:count])


@compiled
def in_order(records: Records, order: Offsets, lists: int) -> PassageColumns:
    """Return the records by list; within each in the order given, which is by rising from_s."""
    of, times_s = records
    many = len(order)
    first = np.zeros(lists + 1, dtype=np.int64)
    for i in range(many):
        first[of[i, LIST] + 1] += 1
    for entry in range(lists):
        first[entry + 1] += first[entry]
    free = first.copy()
    from_s, to_s, latest_s = np.empty(many), np.empty(many), np.empty(many)
    particle, piece = np.empty(many, np.int32), np.empty(many, np.int64)
    for i in order:
        entry = of[i, LIST]
        at = free[entry]
        free[entry] += 1
        from_s[at], to_s[at] = times_s[i, 0], times_s[i, 1]
        particle[at], piece[at] = of[i, PARTICLE], of[i, FIRST]
        latest_s[at] = to_s[at] if at == first[entry] else max(to_s[at], latest_s[at - 1])
    return PassageColumns(first, from_s, to_s, latest_s, particle, piece)
