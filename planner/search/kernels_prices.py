"""The dearest flight at given prices, compiled: one dynamic programme over time and memory."""

from typing import TypeAlias

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.jit import compiled

# first (h * bins + 1,), particle (M,), reward times weight (M,), known (M of legs, W)
SightingColumns: TypeAlias = tuple[Offsets, Ints, Floats, Ints]
# from, to (h,), bins that a hop lasts, at least and at most (h, 2), how many are legs
HopColumns: TypeAlias = tuple[Ints, Ints, Ints, int]
# first (legs + 1,), walk before and walk after (C,): a leg's contexts, the empty walk's first;
# the node where each walk ends (walks,)
ContextColumns: TypeAlias = tuple[Offsets, Ints, Ints, Ints]
World: TypeAlias = tuple[SightingColumns, HopColumns, ContextColumns]


@compiled
def onward(worth: Floats, walk: int, i: int, lasts: Ints) -> tuple[float, int]:
    """Return the greatest worth that a hop from bin ``i`` can lead to, and the bin."""
    best, at = -1.0, i
    for j in range(i + lasts[0], i + lasts[1] + 1):
        value = worth[walk, j] if j < worth.shape[1] else 0.0
        if value > best:
            best, at = value, j
    return best, at


@compiled
def sold(prices: Floats, sightings: SightingColumns, entry: int, word: Ints) -> float:
    """Return what a hop's sightings earn above their prices, but for those known after a walk.

    ``word`` holds the walk's word and bit; no word (-1) is the empty walk.
    """
    first, particle, reward, known = sightings
    total = 0.0
    for e in range(first[entry], first[entry + 1]):
        gain = reward[e] - prices[particle[e]]
        if gain > 0.0 and not (
            word[0] >= 0 and (known[e, word[0]] >> np.uint64(word[1])) & np.uint64(1)
        ):
            total += gain
    return total


@compiled
def hide(prices: Floats, sightings: SightingColumns, entry: int, hidden: Floats) -> float:
    """Return what a leg's sightings earn above prices; in ``hidden``, what each context knows."""
    first, particle, reward, known = sightings
    total = 0.0
    hidden[:] = 0.0
    for e in range(first[entry], first[entry + 1]):
        gain = reward[e] - prices[particle[e]]
        if gain <= 0.0:
            continue
        total += gain
        for w in range(known.shape[1]):
            bits, c = known[e, w], 64 * w + 1
            while bits:
                if bits & np.uint64(1):
                    hidden[c] += gain
                bits >>= np.uint64(1)
                c += 1
    return total


@compiled
def worths(
    prices: Floats,
    world: World,
    worth: Floats,
) -> None:
    """Fill ``worth`` (walks, bins): the most that flights after a walk can earn above prices.

    Walks ``0 .. nodes - 1`` are the empty ones at each node; ``contexts`` lists for each leg the
    walks that may come before it.
    """
    sightings, hops, contexts = world
    known = sightings[3]
    from_node, to_node, lasts, legs = hops
    first_context, before, then, ends_at = contexts
    bins, none = worth.shape[1], np.array([-1, 0])
    hidden = np.empty(64 * known.shape[1] + 1)
    at_node = np.empty(np.max(ends_at) + 1)
    for i in range(bins - 1, -1, -1):
        at_node[:] = 0.0
        for hop in range(legs, len(from_node)):
            value, _ = onward(worth, to_node[hop], i, lasts[hop])
            value += sold(prices, sightings, hop * bins + i, none)
            at_node[from_node[hop]] = max(at_node[from_node[hop]], value)
        for walk in range(len(worth)):
            worth[walk, i] = at_node[ends_at[walk]]
        for leg in range(legs):
            many = first_context[leg + 1] - first_context[leg]
            total = hide(prices, sightings, leg * bins + i, hidden[:many])
            for c in range(many):
                at = first_context[leg] + c
                value, _ = onward(worth, then[at], i, lasts[leg])
                worth[before[at], i] = max(worth[before[at], i], value + total - hidden[c])


@compiled
def dearest(
    prices: Floats,
    world: World,
    worth: Floats,
    start: tuple[int, int],
    counts: Floats,
) -> None:
    """Add to ``counts`` (N,) how often the dearest flight from a place sells each particle.

    ``start`` is a node and a bin.
    """
    sightings, hops, contexts = world
    first, particle, reward, known = sightings
    from_node, to_node, lasts, legs = hops
    first_context, before, then, _ = contexts
    bins, word = worth.shape[1], np.array([-1, 0])
    walk, i = start
    node = walk
    while i < bins and worth[walk, i] > 0.0:
        most, hop, bit, next_walk, next_bin = -1.0, -1, -1, -1, -1
        for h in range(len(from_node)):
            if from_node[h] != node:
                continue
            context, onto = -1, to_node[h]
            if h < legs:
                for c in range(first_context[h], first_context[h + 1]):
                    if before[c] == walk:
                        context, onto = c - first_context[h] - 1, then[c]
            value, at = onward(worth, onto, i, lasts[h])
            word[0], word[1] = (context >> 6, context & 63) if context >= 0 else (-1, 0)
            value += sold(prices, sightings, h * bins + i, word)
            if value > most:
                most, hop, bit, next_walk, next_bin = value, h, context, onto, at
        for e in range(first[hop * bins + i], first[hop * bins + i + 1]):
            hides = bit >= 0 and (known[e, bit >> 6] >> np.uint64(bit & 63)) & np.uint64(1)
            if reward[e] > prices[particle[e]] and not hides:
                counts[particle[e]] += 1.0
        walk, i, node = next_walk, next_bin, to_node[hop]
