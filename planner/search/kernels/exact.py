"""All orders of a small net: flown by shared prefixes, or by branch and bound; compiled."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import first_in_reach
from planner.jit import compiled
from planner.search.kernels.motion import BEGIN, END, VX, VY, X, Y
from planner.search.kernels.prefixes import (
    Case,
    PrefixStates,
    cost,
    cost_of_contact,
    fly,
    value,
)

TIE_S = 1e-6  # times this close are equal


@compiled
def fly_orders(
    case: Case, states: PrefixStates, first: int, alike: Offsets, values: Floats
) -> None:
    """Fill in the value of every order of all roads that begins with a leg, in rising order.

    Depth first: slot d holds the prefix of d legs at hand, and ``alike[d]`` says how many orders
    begin with any one prefix of that length. Where nothing can change any more, all of them get
    the prefix's value.
    """
    legs = len(case.from_node)
    roads = legs // 2  # leg // 2 is the road of a leg
    leg_at = np.zeros(roads + 1, dtype=np.int32)
    flown = np.zeros(roads, dtype=np.bool_)
    leg_at[0] = first
    depth, done = 0, 0
    while True:
        leg = leg_at[depth]
        if leg == legs:
            depth -= 1
            flown[leg_at[depth] // 2] = False
        elif not flown[leg // 2]:
            fits = fly(case, states, depth, leg, depth + 1)
            if fits and states.opens[depth + 1] > 0 and depth + 1 < roads:
                flown[leg // 2] = True
                depth += 1
                leg_at[depth] = 0
                continue
            to = done + alike[depth + 1]
            values[done:to] = value(case, states, depth + 1 if fits else depth)
            done = to
        if depth == 0:
            return
        leg_at[depth] += 1


@compiled
def earliest_meeting(case: Case, place: int, time_s: float, particle: int) -> float:
    """Return the first second at which the UAV could be within the radius of a particle.

    It flies straight there from a place and time: the first second t at which the particle is
    no farther from the place than radius + speed * (t - time). Infinity if it is gone before.
    """
    pieces = case.pieces
    px, py = case.place_xy_m[place]
    for k in range(case.first_piece[particle], case.first_piece[particle + 1]):
        if pieces[k, END] < time_s:
            continue
        now_s = max(time_s, pieces[k, BEGIN])
        driven_s = now_s - pieces[k, BEGIN]
        x = pieces[k, X] + pieces[k, VX] * driven_s - px
        y = pieces[k, Y] + pieces[k, VY] * driven_s - py
        reach_m = case.radius_m + case.speed_mps * (now_s - time_s)
        after_s = first_in_reach((x, y), (pieces[k, VX], pieces[k, VY]), reach_m, case.speed_mps)
        if after_s <= pieces[k, END] - now_s + TIE_S:  # what rounding puts past the end is met
            return float(now_s + after_s)
    return np.inf


@compiled
def completion_bound(case: Case, states: PrefixStates, slot: int, enough: float) -> float:
    """Return the mean cost below which no continuation of a prefix can come.

    Every open particle counts the first second at which the UAV could meet it if it had nothing
    else to do, and from which on, if the sensor misses, it never loses it. The sum may stop short
    once it has reached ``enough``.
    """
    place, time_s = states.place[slot], states.time_s[slot]
    latest_s = min(case.ends_s, case.landing_s)
    bound = states.settled[slot]
    for i in range(states.opens[slot]):
        k = states.open[slot, i]
        meeting_s = earliest_meeting(case, place, time_s, k)
        in_time = meeting_s <= latest_s
        if case.rate_per_s < np.inf:
            costs, left = 0.0, 1.0
            if in_time:
                costs, left = cost_of_contact(case, meeting_s, latest_s)
            bound += case.weight[k] * states.miss[slot, i] * (costs + left * case.miss_cost)
            continue
        bound += case.weight[k] * (cost(case, meeting_s) if in_time else case.miss_cost)
        if bound >= enough:
            break
    return float(bound)


class Tree(NamedTuple):
    """Where branch and bound stands; D legs at most."""

    bound: Floats  # (D, L) of the prefix at hand of d legs and one leg more; inf: nothing to do
    prefix: Ints  # (D,) the prefix at hand
    flown: Flags  # (R,) its roads; that of a leg is leg // 2
    best: Ints  # (D,) the best order so far, then -1


@compiled
def slot_of(case: Case, depth: int, leg: int) -> int:
    """Return where the state after the prefix at hand of ``depth`` legs and one more is kept."""
    return 1 + depth * len(case.from_node) + leg


@compiled
def branch(case: Case, states: PrefixStates, tree: Tree, depth: int, best: float) -> float:
    """Fly every leg that can follow the prefix at hand, bound what follows; return the best."""
    before = slot_of(case, depth - 1, tree.prefix[depth - 1]) if depth > 0 else 0
    tree.bound[depth] = np.inf
    for leg in range(len(case.from_node)):
        after = slot_of(case, depth, leg)
        if tree.flown[leg // 2] or not fly(case, states, before, leg, after):
            continue
        ending_here = value(case, states, after)
        if ending_here < best:
            best = ending_here
            tree.best[:depth] = tree.prefix[:depth]
            tree.best[depth] = leg
            tree.best[depth + 1 :] = -1
        if depth + 1 < len(tree.prefix) and states.opens[after] > 0:
            tree.bound[depth, leg] = completion_bound(case, states, after, best)
    return best


@compiled
def search(
    case: Case, states: PrefixStates, tree: Tree, depth: int, best: float, steps: int
) -> tuple[int, float]:
    """Look for the order of least value, depth first, the lowest bound first.

    Parameters
    ----------
    depth
        Where the search stands: 0 to begin with.
    best
        The mean cost of ``tree.best``.
    steps
        After this many prefixes it pauses; called again, it goes on from there.

    Returns
    -------
    tuple[int, float]
        The new depth, -1 if ``tree.best`` is proven best, and the new value.
    """
    for _ in range(steps):
        leg = np.argmin(tree.bound[depth])
        if tree.bound[depth, leg] < best - case.tie:
            tree.bound[depth, leg] = np.inf
            tree.prefix[depth] = leg
            tree.flown[leg // 2] = True
            depth += 1
            best = branch(case, states, tree, depth, best)
        else:
            depth -= 1
            if depth < 0:
                break
            tree.flown[tree.prefix[depth] // 2] = False
    return depth, best
