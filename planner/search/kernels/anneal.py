"""Simulated annealing of free waypoints, compiled: moves, and the round that tries them.

A way is a row of places with a wait at each; the first is where the UAV takes off, the last where
it waits for the rest. No move touches these two. Every chance that a move takes comes from its
row of uniform draws.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.kernels.closest_approach import (
    FuturesColumns,
    Vector,
    knots_of,
    last_at_or_before,
    motion_at,
)
from planner.jit import compiled
from planner.search.kernels.waypoint_pieces import WAIT, X, Y
from planner.search.kernels.waypoints import (
    LEFT,
    SEEN,
    Bar,
    Change,
    Surroundings,
    Unseen,
    WaypointFlight,
    sweep,
)
from planner.search.kernels.windows import Departure


class Scale(NamedTuple):
    """How wide moves are."""

    shift_m: float  # of a wide shift
    wait_s: float  # of a long wait


class Rules(NamedTuple):
    """What governs a round of M moves."""

    heat: Floats  # (M,) temperature, in reward
    margin: float  # as in ``Bar``
    scale: Scale


class Flights(NamedTuple):
    """The flights that a round of moves works on."""

    known: WaypointFlight
    trial: WaypointFlight  # room for a changed flight
    best_way: Floats  # (3, W) rows as in ``WaypointFlight``


class Memory(NamedTuple):
    """What moves remember from round to round."""

    rank: Ints  # (N,) a particle's place among the known flight's sightings, or UNSEEN
    last_round: Ints  # (N,) the round in which a particle was last seen
    counts: Ints  # (3,) ROUNDS, BEST_MANY, TAKEN


class Standing(NamedTuple):
    """Where annealing stands."""

    many: int  # waypoints of the known flight
    reward: float  # of the known flight
    best_reward: float


UNSEEN = 1 << 30
ROUNDS, BEST_MANY, TAKEN = 0, 1, 2  # rounds so far, waypoints of the best way, moves taken

KINDS = 11
SHIFT, ALONG, PAIR, INSERT, DELETE, DELAY, SWAP, TURN, MOVE, MEET, CUT = range(KINDS)
# How often each is tried.
SHARES = np.cumsum(np.array([0.24, 0.2, 0.1, 0.1, 0.07, 0.04, 0.02, 0.02, 0.02, 0.14, 0.05]))


@compiled
def normal(draw: Floats) -> Vector:
    """Return two independent standard normal numbers."""
    far = np.sqrt(-2.0 * np.log(1.0 - draw[2]))
    angle = 2.0 * np.pi * draw[3]
    return far * np.cos(angle), far * np.sin(angle)


@compiled
def insert_slot(way: Floats, many: int, at: int) -> int:
    """Make room for one waypoint at an index, a copy of the one there; return the new number."""
    for i in range(many, at, -1):
        way[:, i] = way[:, i - 1]
    return many + 1


@compiled
def remove_slots(way: Floats, many: int, at: int, count: int) -> int:
    """Remove some waypoints from an index on; return the new number."""
    for i in range(at, many - count):
        way[:, i] = way[:, i + count]
    return many - count


@compiled
def meeting_place(
    futures: FuturesColumns, particle: int, departure: Departure, speed_mps: float
) -> Vector:
    """Return about where a UAV that sets out from a place and time meets a particle."""
    knots, first_knot = knots_of(futures), futures.first_knot
    at_s, x, y = departure
    px, py = x, y
    for _ in range(6):
        k_end = first_knot[particle + 1]
        k = last_at_or_before(knots.time_s, first_knot[particle], k_end, at_s)
        there = motion_at(knots, k, k_end, max(at_s, knots.time_s[k]))
        px, py = there.x_m, there.y_m
        at_s = departure.time_s + np.hypot(px - x, py - y) / speed_mps
    return px, py


@compiled
def shift(way: Floats, i: int, kind: int, draw: Floats, scale: Scale) -> None:
    """Shift a waypoint: anywhere, or along the flight to it or from it."""
    a, b = normal(draw)
    far_m = scale.shift_m * 10.0 ** (-2.7 * draw[4])
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
def insert(way: Floats, many: int, i: int, draw: Floats, scale: Scale) -> int:
    """Insert a waypoint near the flight to another one; return the new number."""
    a, b = normal(draw)
    far_m = scale.shift_m * 10.0 ** (-2.7 * draw[4])
    many = insert_slot(way, many, i)
    way[X, i] += draw[5] * (way[X, i - 1] - way[X, i]) + a * far_m
    way[Y, i] += draw[5] * (way[Y, i - 1] - way[Y, i]) + b * far_m
    way[WAIT, i] = 0.0
    return many


@compiled
def meet_earlier(
    way: Floats, many: int, known: WaypointFlight, draw: Floats, around: Surroundings
) -> Change:
    """Fly to a particle some waypoints before it is seen now; return what has changed."""
    marks, found = known.marks, known.found
    seen = int(marks[SEEN, many - 1])
    if seen == 0:
        return Change(many, 0)
    j = min(seen - 1, int(draw[1] * seen))
    at = 1
    while at < many - 1 and marks[SEEN, at] <= j:
        at += 1
    i = max(1, at - int(5.0 * draw[2] * draw[2]))
    departure = Departure(marks[LEFT, i - 1], way[X, i - 1], way[Y, i - 1])
    who, speed_mps = found.particle[j], around.limits.speed_mps
    x, y = meeting_place(around.grid.futures, who, departure, speed_mps)
    drop = min(int(3.0 * draw[3]), many - 1 - i)
    if drop > 0:
        many = remove_slots(way, many, i, drop)
    many = insert_slot(way, many, i)
    a = 1.0 if draw[5] < 0.5 else draw[6]
    way[X, i] = way[X, i - 1] + a * (x - way[X, i - 1])
    way[Y, i] = way[Y, i - 1] + a * (y - way[Y, i - 1])
    way[WAIT, i] = 0.0
    return Change(many, i)


@compiled
def reorder(way: Floats, kind: int, i: int, inner: int, draw: Floats) -> int:
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
def delay(way: Floats, i: int, draw: Floats, scale: Scale) -> None:
    """Wait longer or less at a waypoint."""
    if way[WAIT, i] > 0.0 and draw[5] < 0.3:
        way[WAIT, i] = 0.0
        return
    longer_s = -np.log(1.0 - draw[2]) * scale.wait_s * 10.0 ** (-2.0 * draw[4])
    way[WAIT, i] = max(0.0, way[WAIT, i] + (longer_s if draw[6] < 0.5 else -longer_s))


@compiled
def drawn_waypoint(marks: Floats, many: int, last: int, draw: Floats) -> int:
    """Return a random waypoint from 1 to ``last``.

    Every other time it is one up to which a random particle is seen: so waypoints are preferred
    after which much is still to be seen.
    """
    seen = marks[SEEN, many - 1]
    if draw[8] < 0.5 and seen > 0:
        j = draw[8] * 2.0 * seen
        at = 1
        while at < last and marks[SEEN, at] <= j:
            at += 1
        last = at
    return 1 + min(last - 1, int(draw[1] * last))


@compiled
def change_way(
    way: Floats,
    many: int,
    known: WaypointFlight,
    draw: Floats,
    around: Surroundings,
    scale: Scale,
) -> Change:
    """Change a way, a copy of the known one, by one move; return what has changed.

    It begins at 0 if nothing has changed. ``draw`` (9,) is uniform: kind, which, two for a normal
    number, scale, ...
    """
    marks = known.marks
    kind = np.searchsorted(SHARES, draw[0] * SHARES[-1], side="right")
    useful = many - 1
    while useful > 1 and marks[SEEN, useful - 1] == marks[SEEN, many - 1]:
        useful -= 1
    inner = min(useful, many - 2)  # the last one that may be changed
    if kind == MEET and many < way.shape[1]:
        return meet_earlier(way, many, known, draw, around)
    if kind == INSERT or inner < 1:
        if many == way.shape[1]:
            return Change(many, 0)
        i = drawn_waypoint(marks, many, useful, draw)
        return Change(insert(way, many, i, draw, scale), i)
    i = drawn_waypoint(marks, many, inner, draw)
    if kind == DELETE:
        return Change(remove_slots(way, many, i, 1), i)
    if kind == CUT:
        count = min(1 + int(4.0 * draw[2]), inner - i + 1)
        return Change(remove_slots(way, many, i, count), i)
    if kind == DELAY:
        delay(way, i, draw, scale)
        return Change(many, i)
    if kind in (SWAP, TURN, MOVE):
        return Change(many, reorder(way, kind, i, inner, draw))
    if kind == PAIR and i == inner:
        kind = SHIFT
    shift(way, i, kind, draw, scale)
    return Change(many, i)


@compiled
def take_over(change: Change, known: WaypointFlight, trial: WaypointFlight, rank: Ints) -> None:
    """Make a trial the known flight: from its first changed waypoint on."""
    many, begin = change
    marks, found = known.marks, known.found
    stands = int(marks[SEEN, begin - 1])
    for j in range(stands, int(marks[SEEN].max())):
        rank[found.particle[j]] = UNSEEN
    for j in range(stands, int(trial.marks[SEEN, many - 1])):
        found.particle[j], found.seen_at[j] = trial.found.particle[j], trial.found.seen_at[j]
        rank[found.particle[j]] = j
    known.way[:, :many] = trial.way[:, :many]
    marks[:, begin:many] = trial.marks[:, begin:many]
    marks[:, many:] = 0.0


@compiled
def anneal(
    standing: Standing,
    flights: Flights,
    memory: Memory,
    around: Surroundings,
    draws: Floats,
    rules: Rules,
) -> Standing:
    """Try one move per row of draws, (M, 9) uniform numbers; return where annealing then stands."""
    known, trial, best_way = flights
    rank, last_round, counts = memory
    many, reward, best_reward = standing
    for m in range(len(draws)):
        counts[ROUNDS] += 1
        trial.way[:, :many] = known.way[:, :many]
        change = change_way(trial.way, many, known, draws[m], around, rules.scale)
        before = change.begin - 1
        if before < 0:
            continue
        trial.marks[:, before] = known.marks[:, before]
        least = reward + rules.heat[m] * np.log(1.0 - draws[m, 7])
        unseen = Unseen(rank, last_round, int(known.marks[SEEN, before]), int(counts[ROUNDS]))
        bar = Bar(least, rules.margin, known.marks, many)
        made = sweep(trial, change, unseen, around, bar)
        if made < least:
            continue
        take_over(change, known, trial, rank)
        many, reward = change.many, made
        counts[TAKEN] += 1
        if reward > best_reward:
            best_reward = reward
            best_way[:, :many] = known.way[:, :many]
            counts[BEST_MANY] = many
    return Standing(many, reward, best_reward)
