"""Simulated annealing of free waypoints, compiled: moves, and the round that tries them.

A way is a row of places with a wait at each; the first is where the UAV takes off, the last where
it waits for the rest. No move touches these two. Every chance that a move takes comes from its
row of uniform draws.
"""

from typing import TypeAlias

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.kernels.closest_approach import FuturesColumns, last_at_or_before, piece_at
from planner.jit import compiled
from planner.search.kernels.cells import Crowd
from planner.search.kernels.waypoints import (
    LEFT,
    REWARD,
    SEEN,
    WAIT,
    Found,
    Goal,
    Limits,
    Marks,
    Way,
    X,
    Y,
    sweep,
)

Draw: TypeAlias = Floats  # (9,) uniform: kind, which, two for a normal, scale, ...
World: TypeAlias = tuple[Crowd, float, Floats, Limits, Goal]
Scale: TypeAlias = tuple[float, float]  # of a wide shift in metres, of a long wait in seconds
Flight: TypeAlias = tuple[Way, Marks, Found]
UNSEEN = 1 << 30

KINDS = 11
SHIFT, ALONG, PAIR, INSERT, DELETE, DELAY, SWAP, TURN, MOVE, MEET, CUT = range(KINDS)
# How often each is tried.
SHARES = np.cumsum(np.array([0.24, 0.2, 0.1, 0.1, 0.07, 0.04, 0.02, 0.02, 0.02, 0.14, 0.05]))


@compiled
def normal(draw: Draw) -> tuple[float, float]:
    """Return two independent standard normal numbers."""
    far = np.sqrt(-2.0 * np.log(1.0 - draw[2]))
    angle = 2.0 * np.pi * draw[3]
    return far * np.cos(angle), far * np.sin(angle)


@compiled
def opened(way: Way, many: int, at: int) -> int:
    """Make room for one waypoint at an index, a copy of the one there; return the new number."""
    for i in range(many, at, -1):
        way[:, i] = way[:, i - 1]
    return many + 1


@compiled
def closed(way: Way, many: int, at: int, count: int) -> int:
    """Take out some waypoints from an index on; return the new number."""
    for i in range(at, many - count):
        way[:, i] = way[:, i + count]
    return many - count


@compiled
def meeting(
    futures: FuturesColumns, particle: int, place: tuple[float, float, float], speed_mps: float
) -> tuple[float, float]:
    """Return about where a UAV that sets out from a place and time meets a particle."""
    time_s, x_m, y_m, first_knot, _ = futures
    at_s, x, y = place
    px, py = x, y
    for _ in range(6):
        k_end = first_knot[particle + 1]
        k = last_at_or_before(time_s, first_knot[particle], k_end, at_s)
        px, py, _, _, _ = piece_at((time_s, x_m, y_m), k, k_end, max(at_s, time_s[k]))
        at_s = place[0] + np.hypot(px - x, py - y) / speed_mps
    return px, py


@compiled
def shifted(way: Way, i: int, kind: int, draw: Draw, scale: Scale) -> None:
    """Shift a waypoint: anywhere, or along the flight to it or from it."""
    a, b = normal(draw)
    far_m = scale[0] * 10.0 ** (-2.7 * draw[4])
    if kind == ALONG:
        j = i - 1 if draw[5] < 0.5 else i + 1
        dx, dy = way[X, j] - way[X, i], way[Y, j] - way[Y, i]
        length = np.hypot(dx, dy)
        if length <= 0.0:
            return
        way[X, i] += a * far_m * dx / length
        way[Y, i] += a * far_m * dy / length
        return
    way[X, i] += a * far_m
    way[Y, i] += b * far_m
    if kind == PAIR:
        way[X, i + 1] += a * far_m
        way[Y, i + 1] += b * far_m


@compiled
def inserted(way: Way, many: int, i: int, draw: Draw, scale: Scale) -> int:
    """Insert a waypoint near the flight to another one; return the new number."""
    a, b = normal(draw)
    far_m = scale[0] * 10.0 ** (-2.7 * draw[4])
    many = opened(way, many, i)
    way[X, i] += draw[5] * (way[X, i - 1] - way[X, i]) + a * far_m
    way[Y, i] += draw[5] * (way[Y, i - 1] - way[Y, i]) + b * far_m
    way[WAIT, i] = 0.0
    return many


@compiled
def met_somewhere(
    way: Way, many: int, known: tuple[Marks, Found], draw: Draw, world: tuple[Crowd, Limits]
) -> tuple[int, int]:
    """Fly to a particle some waypoints before it is seen now; return the new number, the first."""
    marks, found = known
    seen = int(marks[SEEN, many - 1])
    if seen == 0:
        return many, 0
    j = min(seen - 1, int(draw[1] * seen))
    at = 1
    while at < many - 1 and marks[SEEN, at] <= j:
        at += 1
    i = max(1, at - int(5.0 * draw[2] * draw[2]))
    place = (marks[LEFT, i - 1], way[X, i - 1], way[Y, i - 1])
    x, y = meeting(world[0][0], found[0][j], place, world[1][4])
    drop = min(int(3.0 * draw[3]), many - 1 - i)
    if drop > 0:
        many = closed(way, many, i, drop)
    many = opened(way, many, i)
    a = 1.0 if draw[5] < 0.5 else draw[6]
    way[X, i] = way[X, i - 1] + a * (x - way[X, i - 1])
    way[Y, i] = way[Y, i - 1] + a * (y - way[Y, i - 1])
    way[WAIT, i] = 0.0
    return many, i


@compiled
def reordered(way: Way, kind: int, i: int, inner: int, draw: Draw) -> int:
    """Swap two waypoints, turn a run of them round, or move one; return the first that changed."""
    far = 1 + int(5.0 * draw[2]) if kind != SWAP else 1
    j = min(i + far, inner)
    if kind == MOVE:
        at, to = (i, j) if draw[3] < 0.5 else (j, i)
        step = 1 if to > at else -1
        while at != to:
            for row in range(3):
                way[row, at], way[row, at + step] = way[row, at + step], way[row, at]
            at += step
        return i if j > i else 0
    first = i if j > i else 0
    while i < j:
        for row in range(3):
            way[row, i], way[row, j] = way[row, j], way[row, i]
        i, j = i + 1, j - 1
    return first


@compiled
def delayed(way: Way, i: int, draw: Draw, scale: Scale) -> None:
    """Wait longer or less at a waypoint."""
    if way[WAIT, i] > 0.0 and draw[5] < 0.3:
        way[WAIT, i] = 0.0
        return
    longer_s = -np.log(1.0 - draw[2]) * scale[1] * 10.0 ** (-2.0 * draw[4])
    way[WAIT, i] = max(0.0, way[WAIT, i] + (longer_s if draw[6] < 0.5 else -longer_s))


@compiled
def chosen(known: tuple[Marks, Found], many: int, last: int, draw: Draw) -> int:
    """Return a waypoint from 1 to ``last``: half of the time rather where much is still to be seen.

    That is one of those up to the sighting of a random particle.
    """
    marks = known[0]
    seen = marks[SEEN, many - 1]
    if draw[8] < 0.5 and seen > 0:
        j = draw[8] * 2.0 * seen
        at = 1
        while at < last and marks[SEEN, at] <= j:
            at += 1
        last = at
    return 1 + min(last - 1, int(draw[1] * last))


@compiled
def moved(
    way: Way,
    many: int,
    known: tuple[Marks, Found],
    draw: Draw,
    world: tuple[Crowd, Limits],
    scale: Scale,
) -> tuple[int, int]:
    """Change a way by one move; return its number of waypoints, and the first that changed.

    0 if nothing changed.
    """
    kind = np.searchsorted(SHARES, draw[0] * SHARES[-1], side="right")
    useful = many - 1
    while useful > 1 and known[0][SEEN, useful - 1] == known[0][SEEN, many - 1]:
        useful -= 1
    inner = min(useful, many - 2)  # the last one that may be changed
    if kind == MEET and many < way.shape[1]:
        return met_somewhere(way, many, known, draw, world)
    if kind == INSERT or inner < 1:
        if many == way.shape[1]:
            return many, 0
        i = chosen(known, many, useful, draw)
        return inserted(way, many, i, draw, scale), i
    i = chosen(known, many, inner, draw)
    if kind == DELETE:
        return closed(way, many, i, 1), i
    if kind == CUT:
        return closed(way, many, i, min(1 + int(4.0 * draw[2]), inner - i + 1)), i
    if kind == DELAY:
        delayed(way, i, draw, scale)
        return many, i
    if kind in (SWAP, TURN, MOVE):
        return many, reordered(way, kind, i, inner, draw)
    if kind == PAIR and i == inner:
        kind = SHIFT
    shifted(way, i, kind, draw, scale)
    return many, i


@compiled
def taken_over(many: int, begin: int, now: Flight, trial: Flight, place: Ints) -> None:
    """Make a trial the known flight: from its first changed waypoint on."""
    way, marks, found = now
    stands = int(marks[SEEN, begin - 1])
    for j in range(stands, int(marks[SEEN].max())):
        place[found[0][j]] = UNSEEN
    for j in range(stands, int(trial[1][SEEN, many - 1])):
        found[0][j], found[1][j] = trial[2][0][j], trial[2][1][j]
        place[found[0][j]] = j
    way[:, :many] = trial[0][:, :many]
    marks[:, begin:many] = trial[1][:, begin:many]
    marks[:, many:] = 0.0


@compiled
def anneal(
    known: tuple[int, float],
    flights: tuple[Flight, Flight, Way],
    books: tuple[Ints, Ints, Ints],
    world: World,
    draws: Floats,
    rules: tuple[Floats, float, Scale],
) -> tuple[int, float, float]:
    """Try one move per row of draws.

    Parameters
    ----------
    known
        Number of waypoints of the known flight, and the reward of the best one.
    flights
        The known flight, room for a trial, and the best way so far.
    books
        ``place`` and ``met`` as in ``Book``, and counts: rounds, waypoints of the best way,
        moves taken.
    rules
        Per move the temperature, in reward; how far below its bar, in reward, a flight must be
        likely to end to be given up; and the scale of moves.

    Returns
    -------
    many, reward, best
        The number of waypoints then, and the rewards of the known and the best flight.
    """
    now, trial, best_way = flights
    place, met, counts = books
    heat, margin, scale = rules
    way, marks, found = now
    many, best = known
    reward = marks[REWARD, many - 1]
    for m in range(len(draws)):
        counts[0] += 1
        trial[0][:, :many] = way[:, :many]
        seeing = (world[0], world[3])
        count, begin = moved(trial[0], many, (marks, found), draws[m], seeing, scale)
        if begin < 1:
            continue
        trial[1][:, begin - 1] = marks[:, begin - 1]
        least = reward + heat[m] * np.log(1.0 - draws[m, 7])
        book = (place, met, int(marks[SEEN, begin - 1]), int(counts[0]))
        bar = (least, margin, marks, many)
        made = sweep((trial[0], count, begin), (trial[1], trial[2], book), world, bar)
        if made < least:
            continue
        taken_over(count, begin, now, trial, place)
        many, reward = count, made
        counts[2] += 1
        if reward > best:
            best = reward
            best_way[:, :many] = way[:, :many]
            counts[1] = many
    return many, reward, best
