"""Quickest ways to goals, as drivers choose who weigh roads differently; compiled.

One tree of quickest ways from an edge serves several drivers: each tree has weights of its own.
"""

from typing import Any, NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets
from planner.jit import compiled

NO_EDGE = -1
DIGITS = 2.0**-53


class Graph(NamedTuple):
    """Edges and the turns between them, with what they cost a driver."""

    first_turn: Offsets  # (E + 1,)
    turn_edge: Ints  # (T,)
    edge_s: Floats  # (E,) seconds along an edge
    turn_s: Floats  # (T,) seconds of a turn


class Goals(NamedTuple):
    """Where drivers may go."""

    edge: Ints  # (S,)
    probability: Floats  # (S,)


class Trips(NamedTuple):
    """N drivers, by the tree that they share."""

    seed: int  # of all weights
    source: Offsets  # (G,) the edge from which a tree grows
    number: Offsets  # (G,) which of that edge's trees it is
    first: Offsets  # (G + 1,) where its drivers start
    u: Floats  # (N,) the share of the goals within reach that each one drives to


class Heap(NamedTuple):
    """Edges by the time of their ends, the least on top."""

    time_s: Floats  # (T + 1,)
    edge: Ints  # (T + 1,)


@compiled
def mixed(number: Any) -> Any:
    """Return a number of 64 bits that looks like drawn, another one for each (splitmix64)."""
    z = np.uint64(number) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@compiled
def key_of(seed: int, source: int, number: int) -> Any:
    """Return what the weights of an edge's n-th tree are drawn from."""
    return mixed(mixed(mixed(np.uint64(seed)) ^ np.uint64(source)) ^ np.uint64(number))


@compiled
def share_of(key: Any, edge: int) -> float:
    """Return the number from 0 up to 1 that belongs to an edge under a key."""
    return float(mixed(key ^ np.uint64(edge)) >> np.uint64(11)) * DIGITS


@compiled
def push(heap: Heap, size: int, time_s: float, edge: int) -> int:
    """Put an edge into a heap and return its new size."""
    i = size
    while i > 0:
        above = (i - 1) // 2
        if heap.time_s[above] <= time_s:
            break
        heap.time_s[i], heap.edge[i] = heap.time_s[above], heap.edge[above]
        i = above
    heap.time_s[i], heap.edge[i] = time_s, edge
    return size + 1


@compiled
def sift(heap: Heap, size: int) -> None:
    """Put the last edge of a heap, whose size is one less now, in the place of its top."""
    time_s, edge, i = heap.time_s[size], heap.edge[size], 0
    while True:
        below = 2 * i + 1
        if below >= size:
            break
        if below + 1 < size and heap.time_s[below + 1] < heap.time_s[below]:
            below += 1
        if heap.time_s[below] >= time_s:
            break
        heap.time_s[i], heap.edge[i] = heap.time_s[below], heap.edge[below]
        i = below
    heap.time_s[i], heap.edge[i] = time_s, edge


@compiled
def grow(
    graph: Graph, weight: Floats, source: int, wanted: Flags, heap: Heap, end_s: Floats
) -> Ints:
    """Return from which edge each edge is reached the quickest, (E,); fill in when its end is.

    The tree ends with the last edge that is wanted.
    """
    before = np.full(len(weight), NO_EDGE)
    settled = np.zeros(len(weight), np.bool_)
    left = np.count_nonzero(wanted)
    end_s[:] = np.inf
    end_s[source] = 0.0
    size = push(heap, 0, 0.0, source)
    while size > 0:
        time_s, edge = heap.time_s[0], heap.edge[0]
        size -= 1
        sift(heap, size)
        if settled[edge]:
            continue
        settled[edge] = True
        if wanted[edge]:
            left -= 1
            if left == 0:
                break
        for turn in range(graph.first_turn[edge], graph.first_turn[edge + 1]):
            onto = graph.turn_edge[turn]
            after_s = time_s + graph.turn_s[turn] + graph.edge_s[onto] * weight[onto]
            if after_s < end_s[onto]:
                end_s[onto], before[onto] = after_s, edge
                size = push(heap, size, after_s, onto)
    return before


@compiled
def within_reach(graph: Graph, source: int) -> Flags:
    """Return which edges can be reached from one, itself among them, (E,)."""
    reached = np.zeros(len(graph.edge_s), np.bool_)
    reached[source] = True
    waiting, count = np.empty(len(reached), np.int64), 1
    waiting[0] = source
    while count > 0:
        count -= 1
        edge = waiting[count]
        for turn in range(graph.first_turn[edge], graph.first_turn[edge + 1]):
            onto = graph.turn_edge[turn]
            if not reached[onto]:
                reached[onto] = True
                waiting[count] = onto
                count += 1
    return reached


@compiled
def pick_goals(goals: Goals, reached: Flags, u: Floats) -> Offsets:
    """Return the goals within reach on which shares fall, (k,); NO_EDGE where there is none."""
    cumulative, total, last = np.empty(len(goals.edge)), 0.0, NO_EDGE
    for s in range(len(goals.edge)):
        if reached[goals.edge[s]] and goals.probability[s] > 0.0:
            total += goals.probability[s]
            last = s
        cumulative[s] = total
    picked = np.full(len(u), last, np.int64)
    if last != NO_EDGE:
        for k in range(len(u)):
            s = np.searchsorted(cumulative, u[k] * total, side="right")
            picked[k] = min(s, last)
    return picked


@compiled
def ways_to_goals(
    graph: Graph, goals: Goals, trips: Trips, spread: float
) -> tuple[Offsets, Offsets, Ints]:
    """Return each driver's goal, where its route starts, and the routes' edges.

    A driver without a goal within reach has NO_EDGE and a route of its first edge.

    Parameters
    ----------
    spread
        A road counts to a driver as 1 to 1 + spread times as long as it is.
    """
    n, edges = len(trips.u), len(graph.edge_s)
    heap = Heap(np.empty(len(graph.turn_edge) + 1), np.empty(len(graph.turn_edge) + 1, np.int64))
    end_s, weight = np.empty(edges), np.empty(edges)
    goal, first = np.empty(n, np.int64), np.zeros(n + 1, np.int64)
    route, used = np.empty(64 * n + edges, np.int32), 0
    for g in range(len(trips.source)):
        source, members = int(trips.source[g]), slice(trips.first[g], trips.first[g + 1])
        reached = within_reach(graph, source)
        picked = pick_goals(goals, reached, trips.u[members])
        wanted = np.zeros(edges, np.bool_)
        for s in picked:
            wanted[goals.edge[s] if s != NO_EDGE else source] = True
        key = key_of(trips.seed, source, trips.number[g])
        for edge in range(edges):
            weight[edge] = 1.0 + spread * share_of(key, edge)
        before = grow(graph, weight, source, wanted, heap, end_s)
        for i in range(len(picked)):
            k, s = trips.first[g] + i, picked[i]
            if used + edges > len(route):
                longer = np.empty(2 * len(route) + edges, np.int32)
                longer[:used] = route[:used]
                route = longer
            goal[k], begun = s, used
            edge = goals.edge[s] if s != NO_EDGE else source
            while edge != source:
                route[used] = edge
                edge = before[edge]
                used += 1
            route[used] = source
            used += 1
            route[begun:used] = route[begun:used][::-1].copy()
            first[k + 1] = used
    return goal, first, route[:used].copy()
