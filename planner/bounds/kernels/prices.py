"""The dearest flight at given prices, compiled: one dynamic programme over time and memory.

A state is a node, or a leg just flown; states ``0 .. V - 1`` are the nodes, ``V + leg`` the legs.
"""

from typing import TypeAlias

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.jit import compiled

# By bin and hop: first (bins * h + 1,), particle (M,), reward times weight (M,), known (M,): bit b
# is set where the b-th leg into the hop's first node, flown just before, surely saw the particle
SightingColumns: TypeAlias = tuple[Offsets, Ints, Floats, Ints]
# from, to (h,), bins that a hop lasts, at least and at most one more (2, h), how many are legs
HopColumns: TypeAlias = tuple[Ints, Ints, Ints, int]
# first (V + 1,) and legs by the node that they lead to: of each node's, so many are remembered
ArrivalColumns: TypeAlias = tuple[Offsets, Ints]
World: TypeAlias = tuple[SightingColumns, HopColumns, ArrivalColumns]
REMEMBERED = 8  # legs into a node, at most


@compiled
def sold(prices: Floats, sightings: SightingColumns, entry: int, bit: int) -> float:
    """Return what a hop's sightings earn above prices, but for those known after a leg.

    ``bit`` names the leg; -1: no leg is remembered.
    """
    first, particle, reward, known = sightings
    total = 0.0
    if bit < 0:
        for e in range(first[entry], first[entry + 1]):
            total += max(0.0, reward[e] - prices[particle[e]])
    else:
        for e in range(first[entry], first[entry + 1]):
            if not (known[e] >> bit) & 1:
                total += max(0.0, reward[e] - prices[particle[e]])
    return total


@compiled
def hide(prices: Floats, sightings: SightingColumns, entry: int, hidden: Floats) -> float:
    """Return what a leg's sightings earn; in ``hidden``, what each leg before knows of that."""
    first, particle, reward, known = sightings
    total = 0.0
    hidden[:] = 0.0
    for e in range(first[entry], first[entry + 1]):
        gain = reward[e] - prices[particle[e]]
        if gain > 0.0:
            total += gain
            bits, b = known[e], 0
            while bits:
                if bits & 1:
                    hidden[b] += gain
                bits >>= 1
                b += 1
    return total


@compiled
def worths(prices: Floats, world: World, worth: Floats, since: int) -> None:
    """Fill ``worth`` from a bin on: the most that flights from a state can earn above prices.

    ``worth`` (bins and as many as the longest hop lasts, states) is zero after the last bin.
    """
    sightings, (from_node, to_node, (least, most), legs), (first_into, into) = world
    nodes = len(first_into) - 1
    bins = (len(sightings[0]) - 1) // len(from_node)
    hidden = np.empty(REMEMBERED)
    for i in range(bins - 1, since - 1, -1):
        here, cell = worth[i], i * len(from_node)
        here[:nodes] = 0.0
        for hop in range(legs, len(from_node)):
            node, to = from_node[hop], to_node[hop]
            value = max(worth[i + least[hop], to], worth[i + most[hop], to])
            here[node] = max(here[node], value + sold(prices, sightings, cell + hop, -1))
        for node in range(nodes):
            for at in range(first_into[node], first_into[node + 1]):
                here[nodes + into[at]] = here[node]
        for leg in range(legs):
            node, to = from_node[leg], nodes + leg
            value = max(worth[i + least[leg], to], worth[i + most[leg], to])
            value += hide(prices, sightings, cell + leg, hidden)
            here[node] = max(here[node], value)
            begin, end = first_into[node], first_into[node + 1]
            for at in range(begin, end):
                less = hidden[at - begin] if at - begin < REMEMBERED else 0.0
                state = nodes + into[at]
                here[state] = max(here[state], value - less)


@compiled
def dearest(
    prices: Floats, world: World, worth: Floats, start: tuple[int, int], counts: Floats
) -> None:
    """Add to ``counts`` (N,) how often the dearest flight from a node and bin sells each one."""
    sightings, (from_node, to_node, (least, most), legs), (first_into, into) = world
    first, particle, reward, known = sightings
    nodes, bins = len(first_into) - 1, (len(first) - 1) // len(from_node)
    (node, i), last = start, -1
    while i < bins and worth[i, node if last < 0 else nodes + last] > 0.0:
        back = -1
        for at in range(first_into[node], min(first_into[node] + REMEMBERED, first_into[node + 1])):
            if into[at] == last:
                back = at - first_into[node]
        best, hop, then, cell = -1.0, -1, i, i * len(from_node)
        for h in range(len(from_node)):
            if from_node[h] == node:
                state, bit = (nodes + h, back) if h < legs else (to_node[h], -1)
                soon, late = i + least[h], i + most[h]
                value = max(worth[soon, state], worth[late, state])
                value += sold(prices, sightings, cell + h, bit)
                if value > best:
                    best, hop = value, h
                    then = soon if worth[soon, state] >= worth[late, state] else late
        bit = back if hop < legs else -1
        for e in range(first[cell + hop], first[cell + hop + 1]):
            if reward[e] > prices[particle[e]] and (bit < 0 or not (known[e] >> bit) & 1):
                counts[particle[e]] += 1.0
        node, i, last = to_node[hop], then, hop if hop < legs else -1


@compiled
def narrowed(sightings: SightingColumns, least: Floats, since: int) -> SightingColumns:
    """Return the sightings from a cell on that earn more than the ``least`` of their particle."""
    first, particle, reward, known = sightings
    begins = np.zeros(len(first), dtype=np.int64)
    most = first[-1] - first[since] + 1  # one more: each is written, and kept or overwritten
    who, earns = np.empty(most, particle.dtype), np.empty(most)
    knows = np.empty(most, known.dtype)
    n = 0
    for cell in range(since, len(first) - 1):
        for e in range(first[cell], first[cell + 1]):
            who[n], earns[n], knows[n] = particle[e], reward[e], known[e]
            n += reward[e] > least[particle[e]]
        begins[cell + 1] = n
    return begins, who[:n], earns[:n], knows[:n]


@compiled
def best_sightings(sightings: SightingColumns, since: int, best: Floats) -> None:
    """Raise ``best`` (N,) to the most that a sighting from a cell on earns with each particle."""
    first, particle, reward, _ = sightings
    for e in range(first[since], first[-1]):
        best[particle[e]] = max(best[particle[e]], reward[e])


@compiled
def by_bin(sightings: SightingColumns, hops: int) -> SightingColumns:
    """Return sightings that are sorted by hop and bin sorted by bin and hop."""
    first, particle, reward, known = sightings
    bins = (len(first) - 1) // hops
    begins = np.zeros(len(first), dtype=np.int64)
    for i in range(bins):
        for hop in range(hops):
            cell = hop * bins + i
            begins[i * hops + hop + 1] = begins[i * hops + hop] + first[cell + 1] - first[cell]
    who, earns, knows = np.empty_like(particle), np.empty_like(reward), np.empty_like(known)
    for i in range(bins):
        for hop in range(hops):
            at, cell = begins[i * hops + hop], hop * bins + i
            for e in range(first[cell], first[cell + 1]):
                n = at + e - first[cell]
                who[n], earns[n], knows[n] = particle[e], reward[e], known[e]
    return begins, who, earns, knows
