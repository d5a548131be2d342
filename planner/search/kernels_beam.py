"""Beam search over road orders, compiled: states of about the same time compete with each other.

A state is a road order: where and when it ends, and what it has seen. States wait in buckets of
time; of each bucket the most promising go on, along every way that leads from their node.
"""

from typing import TypeAlias

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets
from planner.detection.kernels import FuturesColumns
from planner.jit import compiled
from planner.search.kernels import (
    Chain,
    LegColumns,
    Sensing,
    leg_sightings,
    lengths_of,
    most_sightings,
    transit_sightings,
)
from planner.search.kernels_passages import PassageColumns

# Per node: first (V + 1,), leg (Y,), which of the node's hops leads to the leg (Y,), -1: none.
Ways: TypeAlias = tuple[Offsets, Ints, Ints]
# Per node: first (V + 1,), by bearing: node (Z,), bearing (Z,), unit vector (Z, 2), seconds (Z,).
Hops: TypeAlias = tuple[Offsets, Ints, Floats, Floats, Floats]
# to_node (L,), duration (L,), node places (V, 2), the legs' points, way home by node (V,) s.
Roads: TypeAlias = tuple[Ints, Floats, Floats, LegColumns, Floats]
# ..., weight (N,), whether the sensor is on between roads
World: TypeAlias = tuple[FuturesColumns, PassageColumns, Sensing, Floats, bool]
Goal: TypeAlias = tuple[float, float, float]  # horizon, deadline (inf: none), latest end; seconds
# What the first legs see: where each one's particles start, the particles; and who was unseen.
FirstFlights: TypeAlias = tuple[Offsets, Ints, Flags]
Outlook: TypeAlias = tuple[Floats, float, float]  # reward per unseen weight by time; from, step
Tree: TypeAlias = Ints  # (4, M), rows as below, -1: none
Worth: TypeAlias = Floats  # (4, M), rows as below

PARENT, LEG, NEXT, SLOT = 0, 1, 2, 3  # NEXT: in the bucket's chain; SLOT: of the unseen's bits
END, REWARD, UNSEEN, PROMISE = 0, 1, 2, 3  # UNSEEN: weight of the particles not seen

SAME = 1e-9  # states at the same node that differ less in time and reward are one


@compiled
def reward_of(seen_s: float, goal: Goal) -> float:
    """Return what a sighting is worth, as ``Objective.reward`` says."""
    if goal[1] < np.inf:
        return 1.0 if seen_s <= goal[1] else 0.0
    return max(0.0, goal[0] - seen_s)


@compiled
def fly_ways(
    place: tuple[float, int],
    wanted: tuple[Ints, Ints],
    unseen: Flags,
    roads: Roads,
    hops: Hops,
    world: World,
) -> tuple[Floats, Offsets, Ints, Floats]:
    """Return what each way from a node at a time would see.

    Parameters
    ----------
    place
        Time in seconds, and the node.
    wanted
        Legs, (C,), and which of the node's hops leads to each.

    Returns
    -------
    start_s, first, particle, seen_at
        When each leg's road begins, (C,); where its sightings start, (C + 1,); the sightings.
    """
    now_s, node = place
    legs, hop = wanted
    _, duration_s, node_xy_m, points, _ = roads
    futures, passages, sensing, _, in_transit = world
    begin, end = hops[0][node], hops[0][node + 1]
    if len(legs) == 1 and hop[0] >= 0:  # all other hops lead elsewhere
        begin, end = begin + hop[0], begin + hop[0] + 1
    many = end - begin if in_transit and hop.max() >= 0 else 0
    head: Ints = np.empty(0, np.int32)
    chain: Chain = (head, head, np.empty(0))
    lengths = head
    if many > 0:
        waypoints = (np.empty(2 * many), np.empty(2 * many), np.empty(2 * many))
        for j in range(many):
            there = hops[1][begin + j]
            waypoints[0][2 * j], waypoints[0][2 * j + 1] = now_s, now_s + hops[4][begin + j]
            waypoints[1][2 * j], waypoints[1][2 * j + 1] = node_xy_m[node, 0], node_xy_m[there, 0]
            waypoints[2][2 * j], waypoints[2][2 * j + 1] = node_xy_m[node, 1], node_xy_m[there, 1]
        transits = (hops[2][begin:end], waypoints, hops[3][begin:end])
        here = (now_s, node_xy_m[node, 0], node_xy_m[node, 1])
        head, chain = transit_sightings(here, transits, unseen, futures, sensing)
        lengths = lengths_of(head, chain)
    start_s, heads = np.empty(len(legs)), np.full(len(legs), -1, dtype=np.int32)
    most = 0
    for c in range(len(legs)):
        start_s[c] = now_s
        if hop[c] >= 0:
            at = hops[0][node] + hop[c]
            start_s[c] += hops[4][at]
            if many > 0:
                heads[c] = head[at - begin]
                most += lengths[at - begin]
    spans = np.empty((len(legs), 2, 2), dtype=np.int64)
    most += most_sightings(legs, start_s, start_s + duration_s[legs], passages, spans)
    found = (np.empty(most, dtype=np.int32), np.empty(most))
    flights = (legs, start_s, heads, spans)
    count = leg_sightings(flights, unseen, points, (futures, passages, sensing[0]), chain, found)
    first = np.zeros(len(legs) + 1, dtype=np.int64)
    for c in range(len(legs)):
        first[c + 1] = spans[c, 1, 1]
    return start_s, first, found[0][:count], found[1][:count]


@compiled
def room_for(count: int, tree: Tree, worth: Worth) -> tuple[Tree, Worth]:
    """Return the same states with room for ``count`` at least."""
    many = tree.shape[1]
    if count <= many:
        return tree, worth
    wide_tree = np.full((4, 2 * count), -1, dtype=np.int32)
    wide_worth = np.empty((4, 2 * count))
    wide_tree[:, :many], wide_worth[:, :many] = tree, worth
    return wide_tree, wide_worth


@compiled
def pack(unseen: Flags, mask: Ints) -> None:
    """Write flags (N,) into bits, (ceil(N / 8),) bytes."""
    mask[:] = 0
    for k in range(len(unseen)):
        if unseen[k]:
            mask[k >> 3] |= np.uint8(1 << (k & 7))


@compiled
def unpack(mask: Ints, unseen: Flags) -> None:
    """Write bits into flags, (N,)."""
    for k in range(len(unseen)):
        unseen[k] = (mask[k >> 3] >> (k & 7)) & 1 == 1


@compiled
def promise(end_s: float, reward: float, unseen: float, outlook: Outlook) -> float:
    """Return the reward a state may come to: its own, and what its unseen usually bring."""
    brings, first_s, step_s = outlook
    at = min(max(0.0, (end_s - first_s) / step_s), len(brings) - 1.000001)
    low = int(at)
    here, next_ = brings[low], brings[low + 1]
    return reward + unseen * float(here + (next_ - here) * (at - low))


@compiled
def fittest(head: int, width: int, tree: Tree, worth: Worth, to_node: Ints) -> Ints:
    """Return the most promising states of a bucket, twins only once, best first.

    Equal promise is settled by the order in which states came to be.
    """
    many, i = 0, head
    while i >= 0:
        many += 1
        i = tree[NEXT, i]
    mine = np.empty(many, dtype=np.int32)
    i = head
    for j in range(many):
        mine[many - 1 - j] = i
        i = tree[NEXT, i]
    kept = np.empty(min(width, many), dtype=np.int32)
    count = 0
    for j in np.argsort(-worth[PROMISE][mine], kind="mergesort"):
        i = mine[j]
        twin = False
        for other in kept[:count]:
            twin = twin or (
                to_node[tree[LEG, other]] == to_node[tree[LEG, i]]
                and abs(worth[END, other] - worth[END, i]) < SAME
                and abs(worth[REWARD, other] - worth[REWARD, i]) < SAME * (1.0 + worth[REWARD, i])
            )
        if not twin:
            kept[count] = i
            count += 1
            if count == width:
                break
    return kept[:count]


@compiled
def unseen_after(
    i: int,
    states: tuple[Tree, Worth, Ints],
    flown: FirstFlights,
    setting: tuple[Ways, Hops, Roads, World],
    unseen: Flags,
) -> None:
    """Find out which particles a state has not seen, (N,): its parent's, less its own leg's."""
    ways, hops, roads, world = setting
    tree, worth, masks = states
    parent = tree[PARENT, i]
    if parent < 0:
        first, particle, unseen_at_start = flown
        unseen[:] = unseen_at_start
        for j in range(first[i], first[i + 1]):
            unseen[particle[j]] = False
        return
    unpack(masks[tree[SLOT, parent]], unseen)
    node = roads[0][tree[LEG, parent]]
    for y in range(ways[0][node], ways[0][node + 1]):
        if ways[1][y] == tree[LEG, i]:
            wanted = (ways[1][y : y + 1], ways[2][y : y + 1])
            place = (worth[END, parent], node)
            _, first, particle, _ = fly_ways(place, wanted, unseen, roads, hops, world)
            for j in range(first[0], first[1]):
                unseen[particle[j]] = False


@compiled
def grow(
    bucket: tuple[int, int, float, float],
    states: tuple[Tree, Worth, Ints, Ints, Ints],
    setting: tuple[Ways, Hops, Roads, World],
    goal: Goal,
    outlook: Outlook,
    flown: FirstFlights,
) -> tuple[Tree, Worth, Ints, Ints]:
    """Let the fittest states of one bucket go on along every way; return the states then known.

    Parameters
    ----------
    bucket
        Its number, how many states go on, when bucket 0 begins and how long each is, seconds.
    states
        Tree and worth, the bits of unseen particles by slot, the head of each bucket's chain,
        and three numbers: states known, slots used, the best state.
    flown
        What the orders of one leg have seen.
    """
    number, width, begin_s, bucket_s = bucket
    tree, worth, masks, heads, counts = states
    ways, hops, roads, world = setting
    to_node, duration_s, home_s = roads[0], roads[1], roads[4]
    weight = world[3]
    unseen = np.empty(len(weight), dtype=np.bool_)
    for i in fittest(heads[number], width, tree, worth, to_node):
        now_s, node = worth[END, i], to_node[tree[LEG, i]]
        most = worth[REWARD, i] + worth[UNSEEN, i] * reward_of(now_s, goal)
        if most <= worth[REWARD, counts[2]] * (1.0 + SAME):
            continue
        unseen_after(i, (tree, worth, masks), flown, setting, unseen)
        if counts[1] == len(masks):
            wider = np.empty((2 * len(masks), masks.shape[1]), dtype=np.uint8)
            wider[: len(masks)] = masks
            masks = wider
        tree[SLOT, i] = counts[1]
        pack(unseen, masks[counts[1]])
        counts[1] += 1
        y, y_end = ways[0][node], ways[0][node + 1]
        wanted = (ways[1][y:y_end], ways[2][y:y_end])
        start_s, first, particle, seen_at = fly_ways(
            (now_s, node), wanted, unseen, roads, hops, world
        )
        tree, worth = room_for(counts[0] + len(start_s), tree, worth)
        for c in range(len(start_s)):
            leg = wanted[0][c]
            end_s = start_s[c] + duration_s[leg]
            if end_s + home_s[to_node[leg]] > goal[2] or reward_of(start_s[c], goal) <= 0.0:
                continue
            earned, met = 0.0, 0.0
            for j in range(first[c], first[c + 1]):
                earned += weight[particle[j]] * reward_of(seen_at[j], goal)
                met += weight[particle[j]]
            new, later = counts[0], max(number + 1, int((end_s - begin_s) / bucket_s))
            counts[0] += 1
            tree[PARENT, new], tree[LEG, new] = i, leg
            worth[END, new], worth[REWARD, new] = end_s, worth[REWARD, i] + earned
            worth[UNSEEN, new] = max(0.0, worth[UNSEEN, i] - met)
            worth[PROMISE, new] = promise(end_s, worth[REWARD, new], worth[UNSEEN, new], outlook)
            if later < len(heads):
                tree[NEXT, new], heads[later] = heads[later], new
            if worth[REWARD, new] > worth[REWARD, counts[2]]:
                counts[2] = new
    return tree, worth, masks, counts
