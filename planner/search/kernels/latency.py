"""Orders of stops with the least weighted waiting, by local search; compiled.

Stop ``s`` is done in one of two ways, ``2 s`` or ``2 s + 1``: a road in one direction or the other.
A stretch of an order is known by how long it lasts, what waiting it adds if it begins at once, and
its weight; so any few stretches one after the other are weighed without a look at what is in them.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.jit import compiled

LONGEST = 3  # stops that move together
KICKED = 30  # stops in a stretch that a kick moves, at most
GAIN = 1e-9  # of the waiting: less is no gain


class Stops(NamedTuple):
    """What there is to be done."""

    between_s: Floats  # (W + 1, W) from the end of one way to the begin of another; last: the start
    lasts_s: Floats  # (W,)
    waiting: Floats  # (W,) weight times seconds from the begin of a way to what it is for
    weight: Floats  # (W,)


class Stretches(NamedTuple):
    """All stretches of an order, [from, to] both included, and the same turned round."""

    lasts_s: Floats  # (2, n, n)
    waiting: Floats  # (2, n, n)
    weight: Floats  # (2, n, n)


class Flown(NamedTuple):
    """A flight so far."""

    time_s: float
    waiting: float
    last: int  # way


@compiled
def fill_stretches(order: Ints, stops: Stops, out: Stretches) -> None:
    """Fill in all stretches of an order."""
    for turned in range(2):
        for i in range(len(order)):
            way = order[i] ^ turned
            out.lasts_s[turned, i, i] = stops.lasts_s[way]
            out.waiting[turned, i, i], out.weight[turned, i, i] = (
                stops.waiting[way],
                stops.weight[way],
            )
    for i in range(len(order)):
        for j in range(i + 1, len(order)):
            way, back = order[j], order[j] ^ 1
            begins_s = out.lasts_s[0, i, j - 1] + stops.between_s[order[j - 1], way]
            out.lasts_s[0, i, j] = begins_s + stops.lasts_s[way]
            out.waiting[0, i, j] = (
                out.waiting[0, i, j - 1] + stops.waiting[way] + begins_s * stops.weight[way]
            )
            later_s = stops.lasts_s[back] + stops.between_s[back, order[j - 1] ^ 1]
            weight = out.weight[0, i, j - 1]
            out.lasts_s[1, i, j] = later_s + out.lasts_s[1, i, j - 1]
            out.waiting[1, i, j] = stops.waiting[back] + out.waiting[1, i, j - 1] + later_s * weight
            out.weight[0, i, j] = out.weight[1, i, j] = weight + stops.weight[way]


@compiled
def onto(
    flown: Flown, part: tuple[int, int, int], order: Ints, stops: Stops, stretches: Stretches
) -> Flown:
    """Return a flight that goes on with a stretch, given by from, to and whether it is turned."""
    i, j, turned = part
    if j < i:
        return flown
    first, last = (order[j] ^ 1, order[i] ^ 1) if turned else (order[i], order[j])
    begins_s = flown.time_s + stops.between_s[flown.last, first]
    waiting = stretches.waiting[turned, i, j] + begins_s * stretches.weight[turned, i, j]
    return Flown(begins_s + stretches.lasts_s[turned, i, j], flown.waiting + waiting, last)


@compiled
def with_rest(
    flown: Flown, since: int, best: float, order: Ints, stops: Stops, stretches: Stretches
) -> float:
    """Return what is waited if the order goes on as it is, unless ``best`` is passed already."""
    if flown.waiting >= best:
        return np.inf
    return onto(flown, (since, len(order) - 1, 0), order, stops, stretches).waiting


@compiled
def turned_part(
    order: Ints, stops: Stops, stretches: Stretches, least: float
) -> tuple[float, int, int]:
    """Return the best stretch to turn round, and what is waited then."""
    n, best, at, to = len(order), least, 0, -1
    start = Flown(0.0, 0.0, len(stops.lasts_s))
    for i in range(n):
        before = onto(start, (0, i - 1, 0), order, stops, stretches)
        for j in range(i, n):
            flown = onto(before, (i, j, 1), order, stops, stretches)
            waiting = with_rest(flown, j + 1, best, order, stops, stretches)
            if waiting < best:
                best, at, to = waiting, i, j
    return best, at, to


@compiled
def moved_part(
    order: Ints, stops: Stops, stretches: Stretches, least: float, many: int
) -> tuple[float, int, int, int]:
    """Return the best stretch of so many stops to move, its new place, and whether it is turned.

    The place is where it would begin if the others closed up.
    """
    n, best, at, to, how = len(order), least, 0, -1, 0
    start = Flown(0.0, 0.0, len(stops.lasts_s))
    for i in range(n - many + 1):
        end = i + many - 1
        for place in range(n - many + 1):
            if place == i:
                continue
            head = onto(start, (0, min(i, place) - 1, 0), order, stops, stretches)
            if place > i:
                head = onto(head, (end + 1, place + many - 1, 0), order, stops, stretches)
            for turned in range(2):
                flown = onto(head, (i, end, turned), order, stops, stretches)
                if place < i:
                    flown = onto(flown, (place, i - 1, 0), order, stops, stretches)
                since = max(end + 1, place + many)
                waiting = with_rest(flown, since, best, order, stops, stretches)
                if waiting < best:
                    best, at, to, how = waiting, i, place, turned
    return best, at, to, how


@compiled
def swapped_pair(
    order: Ints, stops: Stops, stretches: Stretches, least: float
) -> tuple[float, int, int]:
    """Return the best two stops to change places, and what is waited then."""
    n, best, at, to = len(order), least, 0, -1
    start = Flown(0.0, 0.0, len(stops.lasts_s))
    for i in range(n):
        before = onto(start, (0, i - 1, 0), order, stops, stretches)
        for j in range(i + 2, n):
            flown = onto(before, (j, j, 0), order, stops, stretches)
            flown = onto(flown, (i + 1, j - 1, 0), order, stops, stretches)
            flown = onto(flown, (i, i, 0), order, stops, stretches)
            waiting = with_rest(flown, j + 1, best, order, stops, stretches)
            if waiting < best:
                best, at, to = waiting, i, j
    return best, at, to


@compiled
def descend(order: Ints, stops: Stops, stretches: Stretches) -> float:
    """Improve an order by the best move of each kind until none helps; return what is waited."""
    n = len(order)
    fill_stretches(order, stops, stretches)
    start = Flown(0.0, 0.0, len(stops.lasts_s))
    least = onto(start, (0, n - 1, 0), order, stops, stretches).waiting
    kind, kinds = 0, 2 + LONGEST
    while kind < kinds:
        limit = least - GAIN * abs(least)
        if kind == 0:
            found, i, j = turned_part(order, stops, stretches, limit)
            if j >= 0:
                order[i : j + 1] = order[i : j + 1][::-1].copy() ^ 1
        elif kind <= LONGEST:
            found, i, j, turned = moved_part(order, stops, stretches, limit, kind)
            if j >= 0:
                part = order[i : i + kind].copy()
                if turned:
                    part = part[::-1] ^ 1
                rest = np.concatenate((order[:i], order[i + kind :]))
                order[:] = np.concatenate((rest[:j], part, rest[j:]))
        else:
            found, i, j = swapped_pair(order, stops, stretches, limit)
            if j >= 0:
                order[i], order[j] = order[j], order[i]
        if j >= 0:
            fill_stretches(order, stops, stretches)
            least, kind = found, 0
        else:
            kind += 1
    return least


@compiled
def least_waiting(order: Ints, stops: Stops, kicks: Floats) -> Ints:
    """Return an order with little waiting, from a given one.

    Parameters
    ----------
    kicks
        Each row, three numbers from 0 to 1, exchanges two neighbouring stretches of the best order
        so far: where they begin, and how long they are. The order is improved again, and kept if it
        is better. None for fewer than three stops.
    """
    n = len(order)
    stretches = Stretches(np.zeros((2, n, n)), np.zeros((2, n, n)), np.zeros((2, n, n)))
    best = order.copy()
    least = descend(best, stops, stretches)
    for row in range(len(kicks)):
        a = int(kicks[row, 0] * (n - 1))
        b = a + 1 + int(kicks[row, 1] * min(KICKED, n - a - 2))
        c = b + 1 + int(kicks[row, 2] * min(KICKED, n - b - 1))
        trial = np.concatenate((best[:a], best[b:c], best[a:b], best[c:]))
        waiting = descend(trial, stops, stretches)
        if waiting < least * (1.0 - GAIN):
            best, least = trial, waiting
    return best
