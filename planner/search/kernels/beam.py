"""Beam search over road orders, compiled: states of about the same time compete with each other.

A state is a road order: where and when it ends, and what it has seen. States wait in buckets of
time; of each bucket the most promising go on, along every way that leads from their node.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import Rows
from planner.detection.kernels.worth import reward_of
from planner.jit import compiled
from planner.search.kernels.along_roads import SearchIndex
from planner.search.kernels.contacts import passed_by
from planner.search.kernels.transits import Transits
from planner.search.kernels.turning import REST, Turning, loss_on_way
from planner.search.kernels.what_if import Candidates, fly_all, score_all
from planner.search.kernels.windows import Departure

PARENT, LEG, NEXT, SLOT = 0, 1, 2, 3  # NEXT: in the bucket's chain; SLOT: of the unseen
END, REWARD, UNSEEN, PROMISE = 0, 1, 2, 3  # UNSEEN: weight of the particles not seen
KNOWN, SLOTS, BEST, FLIGHTS = 0, 1, 2, 3  # states known, slots used, the best state, flights made

LEVELS = 65_535  # of a probability in two bytes
# Along roads, who is unseen with less than that is not looked for any more: a third of the time
# saved, and plans as good as with a thousandth, on grid5x5 at detects .5 to .9.
FORGOTTEN = 0.03
SAME = 1e-9  # states at the same node that differ less in time and reward are one


class BeamWays(NamedTuple):
    """The legs that can follow at each node, at once or after a hop to another node."""

    first: Offsets  # (V + 1,) where a node's ways start
    leg: Ints  # (Y,) leg index
    hop: Ints  # (Y,) which of the node's hops leads to the leg, -1: none, it starts here


class BeamHops(NamedTuple):
    """The straight flights from each node to others in reach, by rising bearing."""

    first: Offsets  # (V + 1,) where a node's hops start
    bearing: Floats  # (Z,)
    way: Floats  # (Z, 2) unit vectors
    lasts_s: Floats  # (Z,) seconds of flight


class LegEnds(NamedTuple):
    """Where legs lead."""

    to_node: Ints  # (L,) node index
    duration_s: Floats  # (L,) seconds to fly the road
    node_xy_m: Floats  # (V, 2) metres
    home_s: Floats  # (V,) seconds of flight from a node to where the UAV has to land
    first_way: Floats  # (L, 2) unit vectors, in which direction legs begin
    last_way: Floats  # (L, 2) and end
    turning: Turning


class BeamSetting(NamedTuple):
    """What a beam moves in."""

    ways: BeamWays
    hops: BeamHops
    legs: LegEnds
    landing_s: float  # seconds on the target's clock
    search_index: SearchIndex


class FirstSeen(NamedTuple):
    """What the orders of one leg have seen."""

    first: Offsets  # (C + 1,) where an order's particles start
    particle: Ints  # (M,)
    seen: Floats  # (M,) how probably, as far as the particle is unseen before all orders
    miss: Floats  # (N,) probability that a particle is unseen before all orders


class ToGo(NamedTuple):
    """What unseen particles usually bring from a time on."""

    brings: Floats  # (B,) reward per unit of weight
    first_s: float  # seconds, the first entry's time
    step_s: float  # seconds from entry to entry


class BeamStates(NamedTuple):
    """The orders known so far, with room for more: M in all.

    An order is its parent, which is one leg shorter, and its last leg. Where all particles are
    either seen or not, one bit says whether one is unseen; else two bytes say how probably.
    """

    links: Ints  # (4, M) rows PARENT, LEG, NEXT, SLOT; -1: none
    figures: Floats  # (4, M) rows END (s), REWARD, UNSEEN, PROMISE
    masks: Ints  # (S, ceil(N / 8)) bytes, or (S, 2 N): in each slot the unseen particles
    heads: Ints  # (B,) the first state of each bucket's chain, -1: none
    counts: Ints  # (4,) KNOWN, SLOTS, BEST, FLIGHTS


class Bucket(NamedTuple):
    """A stretch of time whose states compete."""

    number: int
    width: int  # how many of its states go on
    per_node: int  # and how many of these at most from each node
    begin_s: float  # when bucket 0 begins, seconds
    lasts_s: float  # length of a bucket, seconds


class Limits(NamedTuple):
    """How many flights buckets may take."""

    narrow: float  # in all; buckets get narrower so that it suffices to the end. inf: they do not
    pause: float  # until it is asked whether to go on


@compiled
def turns_after(before: int, ways: Rows, hop_way: Floats, setting: BeamSetting) -> Floats:
    """Return the seconds lost at corners before each of some ways on from the end of a leg."""
    legs, turns_s = setting.legs, np.zeros(ways.end - ways.begin)
    if not legs.turning.acceleration_mps2 < np.inf:
        return turns_s
    heading = (legs.last_way[before, 0], legs.last_way[before, 1])
    for y in range(ways.begin, ways.end):
        leg, hop, transit = setting.ways.leg[y], setting.ways.hop[y], REST
        if hop >= 0:
            transit = (hop_way[hop, 0], hop_way[hop, 1])
        onto = (legs.first_way[leg, 0], legs.first_way[leg, 1])
        turns_s[y - ways.begin] = loss_on_way(heading, transit, onto, legs.turning)
    return turns_s


@compiled
def set_out(
    moment_s: float, before: int, ways: Rows, setting: BeamSetting
) -> tuple[Departure, Candidates, Transits]:
    """Return some of the ways on from the end of a leg as flights from there."""
    hops, node, (y, y_end) = setting.hops, setting.legs.to_node[before], ways
    begin, end = hops.first[node], hops.first[node + 1]
    x_m, y_m = setting.legs.node_xy_m[node]
    hop_way = hops.way[begin:end]
    turns_s = turns_after(before, ways, hop_way, setting)
    return (
        Departure(moment_s, x_m, y_m),
        Candidates(setting.ways.leg[y:y_end], setting.ways.hop[y:y_end], turns_s),
        Transits(hops.bearing[begin:end], hop_way, hops.lasts_s[begin:end]),
    )


@compiled
def with_room_for(count: int, links: Ints, figures: Floats) -> tuple[Ints, Floats]:
    """Return the same states with room for ``count`` at least."""
    many = links.shape[1]
    if count <= many:
        return links, figures
    more_links = np.full((4, 2 * count), -1, dtype=np.int32)
    more_figures = np.empty((4, 2 * count))
    more_links[:, :many], more_figures[:, :many] = links, figures
    return more_links, more_figures


@compiled
def with_a_free_slot(masks: Ints, used: int) -> Ints:
    """Return the same masks with room for one more at least."""
    if used < len(masks):
        return masks
    more = np.empty((2 * len(masks), masks.shape[1]), dtype=np.uint8)
    more[: len(masks)] = masks
    return more


@compiled
def pack(miss: Floats, mask: Ints, forgotten: float) -> None:
    """Write which particles are unseen, ``miss`` (N,), into bits, or into two bytes each.

    In two bytes who is unseen with less than ``forgotten`` counts as seen.
    """
    if len(mask) == 2 * len(miss):
        for k in range(len(miss)):
            share = int(LEVELS * miss[k] + 0.5) if miss[k] >= forgotten else 0
            mask[2 * k], mask[2 * k + 1] = share & 255, share >> 8
        return
    whole = len(miss) // 8
    for b in range(whole):  # whole bytes first: such a loop is compiled to few instructions
        bits = 0
        for j in range(8):
            bits |= (miss[8 * b + j] > 0.0) << j
        mask[b] = bits
    if whole < len(mask):
        bits = 0
        for k in range(8 * whole, len(miss)):
            bits |= (miss[k] > 0.0) << (k & 7)
        mask[whole] = bits


@compiled
def unpack(mask: Ints, miss: Floats) -> None:
    """Write what was packed into ``miss``, (N,)."""
    if len(mask) == 2 * len(miss):
        for k in range(len(miss)):
            miss[k] = (mask[2 * k] + 256.0 * mask[2 * k + 1]) / LEVELS
        return
    whole = len(miss) // 8
    for b in range(whole):  # as in `pack`
        for j in range(8):
            miss[8 * b + j] = (mask[b] >> j) & 1
    for k in range(8 * whole, len(miss)):
        miss[k] = (mask[whole] >> (k & 7)) & 1


@compiled
def promise(end_s: float, reward: float, unseen: float, to_go: ToGo) -> float:
    """Return the reward a state may come to: its own, and what its unseen usually bring."""
    brings, first_s, step_s = to_go
    at = min(max(0.0, (end_s - first_s) / step_s), len(brings) - 1.000001)
    low = int(at)
    here, next_ = brings[low], brings[low + 1]
    return reward + unseen * float(here + (next_ - here) * (at - low))


@compiled
def fittest(bucket: Bucket, states: BeamStates, to_node: Ints) -> Ints:
    """Return the most promising states of a bucket, twins only once, best first.

    Equal promise is settled by the order in which states came to be.
    """
    links, figures, width = states.links, states.figures, bucket.width
    many, i = 0, states.heads[bucket.number]
    while i >= 0:
        many += 1
        i = links[NEXT, i]
    mine = np.empty(many, dtype=np.int32)
    i = states.heads[bucket.number]
    for j in range(many):
        mine[many - 1 - j] = i
        i = links[NEXT, i]
    kept = np.empty(min(width, many), dtype=np.int32)
    count = 0
    for j in np.argsort(-figures[PROMISE][mine], kind="mergesort"):
        i = mine[j]
        twin, here = False, 0
        for other in kept[:count]:
            if to_node[links[LEG, other]] != to_node[links[LEG, i]]:
                continue
            here += 1
            alike = SAME * (1.0 + figures[REWARD, i])
            twin = twin or (
                abs(figures[END, other] - figures[END, i]) < SAME
                and abs(figures[REWARD, other] - figures[REWARD, i]) < alike
            )
        if not twin and here < bucket.per_node:
            kept[count] = i
            count += 1
            if count == width:
                break
    return kept[:count]


@compiled
def miss_after(
    i: int, states: BeamStates, flown: FirstSeen, setting: BeamSetting, miss: Floats
) -> None:
    """Find out how probably a state has not seen each particle, (N,): its parent, then its leg."""
    links, (first_way, way_leg, _) = states.links, setting.ways
    parent = links[PARENT, i]
    if parent < 0:
        miss[:] = flown.miss
        for j in range(flown.first[i], flown.first[i + 1]):
            who = flown.particle[j]
            miss[who] = max(0.0, miss[who] - flown.miss[who] * flown.seen[j])
        return
    unpack(states.masks[links[SLOT, parent]], miss)
    node = setting.legs.to_node[links[LEG, parent]]
    for y in range(first_way[node], first_way[node + 1]):
        if way_leg[y] == links[LEG, i]:
            moment_s = states.figures[END, parent]
            before, way = links[LEG, parent], Rows(y, y + 1)
            departure, candidates, transits = set_out(moment_s, before, way, setting)
            seen = fly_all(departure, candidates, transits, miss, setting.search_index)
            rate_per_s = setting.search_index.sensing.rate_per_s
            for j in range(len(seen.particle)):
                miss[seen.particle[j]] *= passed_by(seen.from_s[j], seen.to_s[j], rate_per_s)


@compiled
def grow(
    bucket: Bucket, states: BeamStates, setting: BeamSetting, to_go: ToGo, flown: FirstSeen
) -> BeamStates:
    """Let the fittest states of one bucket go on along every way; return the states then known."""
    to_node, duration_s, home_s = setting.legs.to_node, setting.legs.duration_s, setting.legs.home_s
    goal, landing_s, first_way = setting.search_index.goal, setting.landing_s, setting.ways.first
    links, figures, masks, heads, counts = states
    number, _, _, begin_s, lasts_s = bucket
    miss = np.empty(len(setting.search_index.weight))
    for i in fittest(bucket, states, to_node):
        now_s, node = figures[END, i], to_node[links[LEG, i]]
        most = figures[REWARD, i] + figures[UNSEEN, i] * reward_of(now_s, goal)
        if most <= figures[REWARD, counts[BEST]] * (1.0 + SAME):
            continue
        now = BeamStates(links, figures, masks, heads, counts)
        miss_after(i, now, flown, setting, miss)
        masks = with_a_free_slot(masks, counts[SLOTS])
        links[SLOT, i] = counts[SLOTS]
        pack(miss, masks[counts[SLOTS]], FORGOTTEN)
        counts[SLOTS] += 1
        onward = Rows(first_way[node], first_way[node + 1])
        departure, candidates, transits = set_out(now_s, links[LEG, i], onward, setting)
        legs = candidates.leg
        starts_s, earned, seen = score_all(
            departure, candidates, transits, miss, setting.search_index
        )
        counts[FLIGHTS] += len(legs)
        links, figures = with_room_for(counts[KNOWN] + len(legs), links, figures)
        for c in range(len(legs)):
            leg, end_s = legs[c], starts_s[c] + duration_s[legs[c]]
            if end_s + home_s[to_node[leg]] > landing_s or reward_of(starts_s[c], goal) <= 0.0:
                continue
            new, later = counts[KNOWN], max(number + 1, int((end_s - begin_s) / lasts_s))
            counts[KNOWN] += 1
            links[PARENT, new], links[LEG, new] = i, leg
            figures[END, new], figures[REWARD, new] = end_s, figures[REWARD, i] + earned[c]
            figures[UNSEEN, new] = max(0.0, figures[UNSEEN, i] - seen[c])
            figures[PROMISE, new] = promise(
                end_s, figures[REWARD, new], figures[UNSEEN, new], to_go
            )
            if later < len(heads):
                links[NEXT, new], heads[later] = heads[later], new
            if figures[REWARD, new] > figures[REWARD, counts[BEST]]:
                counts[BEST] = new
    return BeamStates(links, figures, masks, heads, counts)


@compiled
def affordable(bucket: Bucket, states: BeamStates, most: float) -> int:
    """Return the width with which a beam comes to its last bucket within so many flights."""
    went_on, flights = states.counts[SLOTS], states.counts[FLIGHTS]
    if went_on == 0 or most == np.inf:
        return bucket.width
    left = (most - flights) / (len(states.heads) - bucket.number)
    return max(1, min(bucket.width, int(left * went_on / flights)))


@compiled
def grow_on(
    bucket: Bucket,
    limits: Limits,
    states: BeamStates,
    setting: BeamSetting,
    to_go: ToGo,
    flown: FirstSeen,
) -> tuple[Bucket, BeamStates]:
    """Let bucket after bucket grow, from one on; return the first that did not, and all states."""
    number = bucket.number
    while number < len(states.heads) and states.counts[FLIGHTS] < limits.pause:
        if states.heads[number] >= 0:
            here = Bucket(number, bucket.width, bucket.per_node, bucket.begin_s, bucket.lasts_s)
            width = affordable(here, states, limits.narrow)
            here = Bucket(number, width, bucket.per_node, bucket.begin_s, bucket.lasts_s)
            states = grow(here, states, setting, to_go, flown)
        number += 1
    on = Bucket(number, bucket.width, bucket.per_node, bucket.begin_s, bucket.lasts_s)
    return on, states
