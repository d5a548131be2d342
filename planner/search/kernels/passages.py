"""Which particle passes which road when: the compiled building of the passage index.

A passage is a stretch of time in which a particle may be within the radius of a road. It is cut
generously: what lies outside is certainly not seen from the road, what lies inside is still to be
checked. So a flight along a road has to look at that road's passages in its own minutes only.
"""

from typing import TypeAlias

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.jit import compiled
from planner.search.kernels.motion import BEGIN, END, VX, VY, Motion, X, Y, nothing

# first (2 R + 1,), from_s, to_s, latest_s (M,), particle, its piece at from_s (M,): list r holds
# those that move past road r, list R + r those that rest there; each by rising from_s, latest_s
# the running maximum of to_s.
PassageColumns: TypeAlias = tuple[Offsets, Floats, Floats, Floats, Ints, Offsets]
Roads: TypeAlias = tuple[Offsets, Floats, Floats]  # first_point (R + 1,), x_m, y_m
Box: TypeAlias = tuple[float, float, float, int, int]  # west, south, size, columns, rows
Cells: TypeAlias = tuple[Box, Offsets, Ints]  # box, first, (S, 2): a segment's point, its road
# (M, 4): list, particle, its first piece and its last one so far; (M, 2): from, to
Records: TypeAlias = tuple[Ints, Floats]


@compiled
def padded(radius_m: float) -> float:
    """Return a radius that is certainly not too small, whatever is lost by rounding."""
    return radius_m * (1.0 + 1e-9) + 1e-6


@compiled
def cell_range(
    box: Box, low: tuple[float, float], high: tuple[float, float]
) -> tuple[int, int, int, int]:
    """Return the columns and rows of a box that a rectangle touches: from, to, from, to."""
    west, south, size, columns, rows = box
    return (
        max(0, int(np.floor(max((low[0] - west) / size, -1.0)))),
        min(columns - 1, int(np.floor(min((high[0] - west) / size, columns)))),
        max(0, int(np.floor(max((low[1] - south) / size, -1.0)))),
        min(rows - 1, int(np.floor(min((high[1] - south) / size, rows)))),
    )


@compiled
def box_of(roads: Roads, radius_m: float) -> Box:
    """Return a box of cells around all roads, with about one cell per road segment."""
    _, x_m, y_m = roads
    if len(x_m) == 0:
        return 0.0, 0.0, 1.0, 1, 1
    west, east, south, north = x_m[0], x_m[0], y_m[0], y_m[0]
    for i in range(len(x_m)):
        west, east = min(west, x_m[i]), max(east, x_m[i])
        south, north = min(south, y_m[i]), max(north, y_m[i])
    west, south = west - radius_m, south - radius_m
    width, height = east + radius_m - west, north + radius_m - south
    size = max(np.sqrt(width * height / len(x_m)), max(width, height) / 1000.0, 2.0 * radius_m)
    return west, south, size, int(width / size) + 1, int(height / size) + 1


@compiled
def segment_cells(
    box: Box, x_m: Floats, y_m: Floats, point: int, radius_m: float
) -> tuple[int, int, int, int]:
    """Return the cells from which the road segment after a point may be within the radius."""
    low = (min(x_m[point], x_m[point + 1]) - radius_m, min(y_m[point], y_m[point + 1]) - radius_m)
    high = (max(x_m[point], x_m[point + 1]) + radius_m, max(y_m[point], y_m[point + 1]) + radius_m)
    return cell_range(box, low, high)


@compiled
def roads_by_cell(roads: Roads, radius_m: float) -> Cells:
    """Return for each cell the road segments within the radius of it."""
    first_point, x_m, y_m = roads
    box = box_of(roads, radius_m)
    first = np.zeros(box[3] * box[4] + 1, dtype=np.int64)
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
                a, b, c, d = segment_cells(box, x_m, y_m, point, radius_m)
                for row in range(c, d + 1):
                    for cell in range(row * box[3] + a, row * box[3] + b + 1):
                        if filling:
                            near[free[cell], 0], near[free[cell], 1] = point, road
                            free[cell] += 1
                        else:
                            first[cell + 1] += 1
    return box, first, near


@compiled
def segments_of(roads: Roads) -> Floats:
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
    piece: tuple[float, float, float, float, float], segments: Floats, point: int, radius_m: float
) -> tuple[float, float]:
    """Return from and to, seconds into a piece of motion, when it may be near a road segment.

    Near is the rectangle that reaches one radius beyond the segment on all sides; from > to if
    the piece misses it. The last entry of ``piece`` is its duration.
    """
    x, y, vx, vy, lasts_s = piece
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
    """Return empty columns for so many records."""
    return np.empty((count, 4), dtype=np.int32), np.empty((count, 2))


@compiled
def grown(records: Records) -> Records:
    """Return the same records with room for twice as many."""
    wide = room_for(2 * len(records[0]))
    for i in range(len(records[0])):
        for j in range(4):
            wide[0][i, j] = records[0][i, j]
        for j in range(2):
            wide[1][i, j] = records[1][i, j]
    return wide


@compiled
def record_piece(
    at: tuple[int, int, float],
    pieces: Floats,
    world: tuple[Floats, Cells, float],
    books: tuple[Ints, Ints],
    records: Records,
    count: int,
) -> int:
    """Write down one piece of a particle's motion beside every road that it passes.

    Consecutive pieces beside the same road make one passage. Returns the new count of records,
    for which there must be room.

    Parameters
    ----------
    at
        The piece, the particle, and when it is gone.
    books
        Per road segment the piece last looked at (plus 1), per list the record last opened.
    """
    segments, (box, first, near), radius_m = world
    seen_segment, open_record = books
    kinds, times_s = records
    k, who, gone_s = at
    begin_s, lasts_s = pieces[k, BEGIN], min(pieces[k, END], gone_s) - pieces[k, BEGIN]
    x, y, vx, vy = pieces[k, X], pieces[k, Y], pieces[k, VX], pieces[k, VY]
    way_s, rests = (lasts_s, 0) if lasts_s < np.inf else (0.0, len(open_record) // 2)
    far_x, far_y = x + vx * way_s, y + vy * way_s
    a, b, c, d = cell_range(box, (min(x, far_x), min(y, far_y)), (max(x, far_x), max(y, far_y)))
    for row in range(c, d + 1 if a <= b else c):
        for i in range(first[row * box[3] + a], first[row * box[3] + b + 1]):
            segment, entry = near[i, 0], near[i, 1] + rests
            if seen_segment[segment] == k + 1:
                continue
            seen_segment[segment] = k + 1
            from_s, to_s = beside_segment((x, y, vx, vy, lasts_s), segments, segment, radius_m)
            if from_s <= to_s:
                i_open = open_record[entry]
                if i_open < 0 or kinds[i_open, 1] != who or kinds[i_open, 3] < k - 1:
                    i_open = open_record[entry] = count
                    count += 1
                    kinds[i_open, 0], kinds[i_open, 1], kinds[i_open, 2] = entry, who, k
                    times_s[i_open, 0], times_s[i_open, 1] = np.inf, -np.inf
                kinds[i_open, 3] = k
                times_s[i_open, 0] = min(times_s[i_open, 0], begin_s + from_s)
                times_s[i_open, 1] = max(times_s[i_open, 1], begin_s + to_s)
    return count


@compiled
def all_passages(motion: Motion, roads: Roads, radius_m: float) -> Records:
    """Return every particle's passages along every road, in no certain order."""
    pieces, first_piece, gone_s, _, _, _, _ = motion
    many = len(roads[0]) - 1
    near_m = padded(radius_m)
    world = (segments_of(roads), roads_by_cell(roads, near_m), near_m)
    books = (np.zeros(len(roads[1]), np.int32), np.full(2 * many, -1, np.int32))
    records = room_for(2 * len(pieces) + many)
    count = nothing()
    for who in range(len(gone_s)):
        for k in range(first_piece[who], first_piece[who + 1]):
            if count + many > len(records[0]):
                records = grown(records)
            count = record_piece((k, who, gone_s[who]), pieces, world, books, records, count)
    return records[0][:count], records[1][:count]


@compiled
def in_order(records: Records, order: Offsets, lists: int) -> PassageColumns:
    """Return the records by list; within each in the order given, which is by rising from_s."""
    kinds, times_s = records
    many = len(order)
    first = np.zeros(lists + 1, dtype=np.int64)
    for i in range(many):
        first[kinds[i, 0] + 1] += 1
    for entry in range(lists):
        first[entry + 1] += first[entry]
    free = first.copy()
    from_s, to_s, latest_s = np.empty(many), np.empty(many), np.empty(many)
    particle, piece = np.empty(many, np.int32), np.empty(many, np.int64)
    for i in order:
        entry = kinds[i, 0]
        at = free[entry]
        free[entry] += 1
        from_s[at], to_s[at], particle[at], piece[at] = (
            times_s[i, 0],
            times_s[i, 1],
            kinds[i, 1],
            kinds[i, 2],
        )
        latest_s[at] = to_s[at] if at == first[entry] else max(to_s[at], latest_s[at - 1])
    return first, from_s, to_s, latest_s, particle, piece
