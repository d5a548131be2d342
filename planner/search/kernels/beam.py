"""Beam search over road orders, compiled: states of about the same time compete with each other.

A state is a road order: where and when it ends, and what it has seen. States wait in buckets of
time; of each bucket the most promising go on, along every way that leads from their node.
"""

from typing import TypeAlias

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets
from planner.jit import compiled
from planner.search.kernels.transits import Ends, Place
from planner.search.kernels.what_if import Flights, World, fly_all, reward_of, score_all

# Per node: first (V + 1,), leg (Y,), which of the node's hops leads to the leg (Y,), -1: none.
Ways: TypeAlias = tuple[Offsets, Ints, Ints]
# Per node: first (V + 1,), by bearing: bearing (Z,), unit vector (Z, 2), seconds (Z,).
Hops: TypeAlias = tuple[Offsets, Floats, Floats, Floats]
# to_node (L,), duration (L,), node places (V, 2), way home by node (V,) s, weights (N,).
Roads: TypeAlias = tuple[Ints, Floats, Floats, Floats, Floats]
Setting: TypeAlias = tuple[Ways, Hops, Roads, World]
Goal: TypeAlias = tuple[float, float, float]  # horizon, deadline (inf: none), latest end; seconds
# What the first legs see: where each one's particles start, the particles; and who was unseen.
FirstFlights: TypeAlias = tuple[Offsets, Ints, Flags]
RewardToGo: TypeAlias = tuple[Floats, float, float]  # reward per unseen weight by time; from, step
Tree: TypeAlias = Ints  # (4, M), rows as below, -1: none
Worth: TypeAlias = Floats  # (4, M), rows as below

PARENT, LEG, NEXT, SLOT = 0, 1, 2, 3  # NEXT: in the bucket's chain; SLOT: of the unseen's bits
END, REWARD, UNSEEN, PROMISE = 0, 1, 2, 3  # UNSEEN: weight of the particles not seen

SAME = 1e-9  # states at the same node that differ less in time and reward are one


@compiled
def set_out(
    moment_s: float, node: int, ways: tuple[int, int], setting: Setting
) -> tuple[Place, Flights, Ends]:
    """Return some of the ways from a node, from (included) to (excluded), as flights from there."""
    (_, leg, hop), (first, bearing, way, away_s), roads, _ = setting
    y, y_end = ways
    begin, end = first[node], first[node + 1]
    return (
        (moment_s, roads[2][node, 0], roads[2][node, 1]),
        (leg[y:y_end], hop[y:y_end]),
        (bearing[begin:end], way[begin:end], away_s[begin:end]),
    )


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
def promise(end_s: float, reward: float, unseen: float, outlook: RewardToGo) -> float:
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
    setting: Setting,
    unseen: Flags,
) -> None:
    """Find out which particles a state has not seen, (N,): its parent's, less its own leg's."""
    ways, _, roads, world = setting
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
            place, flights, ends = set_out(worth[END, parent], node, (y, y + 1), setting)
            _, _, particle, _ = fly_all(place, flights, ends, unseen, world)
            for who in particle:
                unseen[who] = False


@compiled
def grow(
    bucket: tuple[int, int, float, float],
    states: tuple[Tree, Worth, Ints, Ints, Ints],
    setting: Setting,
    goal: Goal,
    outlook: RewardToGo,
    flown: FirstFlights,
) -> tuple[Tree, Worth, Ints, Ints]:
    """Let the fittest states of one bucket go on along every way; return the states then known.

    Parameters
    ----------
    bucket
        Its number, how many states go on, when bucket 0 begins and how long each is, seconds.
    states
        Tree and worth, the bits of unseen particles by slot, the head of each bucket's chain,
        and four numbers: states known, slots used, the best state, flights made.
    flown
        What the orders of one leg have seen.
    """
    number, width, begin_s, bucket_s = bucket
    tree, worth, masks, heads, counts = states
    ways, _, (to_node, duration_s, _, home_s, weight), world = setting
    unseen = np.empty(len(weight), dtype=np.bool_)
    for i in fittest(heads[number], width, tree, worth, to_node):
        now_s, node = worth[END, i], to_node[tree[LEG, i]]
        most = worth[REWARD, i] + worth[UNSEEN, i] * reward_of(now_s, (goal[0], goal[1]))
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
        place, flights, ends = set_out(now_s, node, (ways[0][node], ways[0][node + 1]), setting)
        aim = (weight, (goal[0], goal[1]))
        start_s, earned, seen = score_all(place, flights, ends, unseen, world, aim)
        counts[3] += len(start_s)
        tree, worth = room_for(counts[0] + len(start_s), tree, worth)
        for c in range(len(start_s)):
            leg = flights[0][c]
            end_s = start_s[c] + duration_s[leg]
            if end_s + home_s[to_node[leg]] > goal[2] or reward_of(start_s[c], aim[1]) <= 0.0:
                continue
            new, later = counts[0], max(number + 1, int((end_s - begin_s) / bucket_s))
            counts[0] += 1
            tree[PARENT, new], tree[LEG, new] = i, leg
            worth[END, new], worth[REWARD, new] = end_s, worth[REWARD, i] + earned[c]
            worth[UNSEEN, new] = max(0.0, worth[UNSEEN, i] - seen[c])
            worth[PROMISE, new] = promise(end_s, worth[REWARD, new], worth[UNSEEN, new], outlook)
            if later < len(heads):
                tree[NEXT, new], heads[later] = heads[later], new
            if worth[REWARD, new] > worth[REWARD, counts[2]]:
                counts[2] = new
    return tree, worth, masks, counts
