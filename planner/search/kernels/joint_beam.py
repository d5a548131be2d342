"""What joint orders of several UAVs see, compiled: one leg of one of them, after many states.

A state of several UAVs holds for each particle when it is seen first, by whom ever: legs of
different UAVs overlap in time, so a later leg may see a particle sooner than an earlier one.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import Rows
from planner.detection.kernels.worth import Goal, reward_of
from planner.jit import compiled
from planner.search.kernels.beam import BeamSetting, set_out
from planner.search.kernels.what_if import Flights, fly_all


class Movers(NamedTuple):
    """The UAV that moves next in each of m states, and where it is."""

    time_s: Floats  # (m,) when it is free
    leg: Ints  # (m,) that it flew last


class Sighted(NamedTuple):
    """What C flights see; each particle at most once in a flight."""

    first: Offsets  # (C + 1,)
    particle: Ints  # (M,)
    seen_at: Floats  # (M,) seconds


class Gains(NamedTuple):
    """What flights add to what the states before them earn."""

    reward: Floats  # (C,)
    fresh: Floats  # (C,) weight of the particles that nobody has seen before


class Moves(NamedTuple):
    """All legs that can follow m states, C in all."""

    state: Ints  # (C,) which of the m
    way: Ints  # (C,) of the setting's ways
    leg: Ints  # (C,)
    end_s: Floats  # (C,) seconds, when the leg ends
    gains: Gains


@compiled
def gain(
    flight: int, sighted: Sighted, seen: Floats, weight: Floats, goal: Goal
) -> tuple[float, float]:
    """Return what one flight adds to the reward of a state, and the weight seen for the first time.

    ``seen`` (N,) is when the state's flights see each particle, infinity: never.
    """
    reward, fresh = 0.0, 0.0
    for j in range(sighted.first[flight], sighted.first[flight + 1]):
        who, seen_s = sighted.particle[j], sighted.seen_at[j]
        before_s = seen[who]
        if seen_s < before_s:
            reward += weight[who] * (reward_of(seen_s, goal) - reward_of(before_s, goal))
            if before_s == np.inf:
                fresh += weight[who]
    return reward, fresh


@compiled
def first_gains(sighted: Sighted, seen: Floats, weight: Floats, goal: Goal) -> Gains:
    """Return what each of C flights adds to each of m states, (m * C,); ``seen`` is (m, N)."""
    many, flights = len(seen), len(sighted.first) - 1
    gains = Gains(np.empty(many * flights), np.empty(many * flights))
    for i in range(many):
        for c in range(flights):
            at = i * flights + c
            gains.reward[at], gains.fresh[at] = gain(c, sighted, seen[i], weight, goal)
    return gains


@compiled
def see_first(flights: Ints, sighted: Sighted, seen: Floats) -> None:
    """Let one of some flights follow each of m states: ``seen`` (m, N) is then after it."""
    for i in range(len(seen)):
        for j in range(sighted.first[flights[i]], sighted.first[flights[i] + 1]):
            who = sighted.particle[j]
            seen[i, who] = min(seen[i, who], sighted.seen_at[j])


@compiled
def sighted_by(time_s: float, leg: int, ways: Rows, seen: Floats, setting: BeamSetting) -> Flights:
    """Return what flights along some ways see of all that is not seen before they begin."""
    miss = np.empty(len(seen))
    for k in range(len(seen)):
        miss[k] = 1.0 if seen[k] > time_s else 0.0
    departure, candidates, transits = set_out(time_s, leg, ways, setting)
    return fly_all(departure, candidates, transits, miss, setting.search_index)


@compiled
def see_next(movers: Movers, ways: Ints, seen: Floats, setting: BeamSetting) -> None:
    """Let a UAV go one way on from each of m states: ``seen`` (m, N) is then after that leg."""
    for i in range(len(seen)):
        way = Rows(ways[i], ways[i] + 1)
        flown = sighted_by(movers.time_s[i], movers.leg[i], way, seen[i], setting)
        for j in range(len(flown.particle)):
            who = flown.particle[j]
            seen[i, who] = min(seen[i, who], flown.from_s[j])


@compiled
def onward(movers: Movers, seen: Floats, setting: BeamSetting) -> Moves:
    """Return the legs that can follow each of m states, and what they add; ``seen`` is (m, N).

    Those that begin after the search has ended, or after which a UAV could not come home, are left
    out.
    """
    to_node, duration_s, home_s = setting.legs.to_node, setting.legs.duration_s, setting.legs.home_s
    index, first_way = setting.search_index, setting.ways.first
    most = 0
    for i in range(len(seen)):
        node = to_node[movers.leg[i]]
        most += first_way[node + 1] - first_way[node]
    state, way = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64)
    legs = np.empty(most, dtype=np.int32)
    end_s, reward, fresh = np.empty(most), np.empty(most), np.empty(most)
    count = 0
    for i in range(len(seen)):
        node = to_node[movers.leg[i]]
        ways = Rows(first_way[node], first_way[node + 1])
        flown = sighted_by(movers.time_s[i], movers.leg[i], ways, seen[i], setting)
        sighted = Sighted(flown.first, flown.particle, flown.from_s)
        for c in range(len(flown.start_s)):
            leg = setting.ways.leg[ways.begin + c]
            ends_s = flown.start_s[c] + duration_s[leg]
            if ends_s + home_s[to_node[leg]] > setting.landing_s:
                continue
            if reward_of(flown.start_s[c], index.goal) <= 0.0:
                continue
            state[count], way[count], legs[count] = i, ways.begin + c, leg
            end_s[count] = ends_s
            reward[count], fresh[count] = gain(c, sighted, seen[i], index.weight, index.goal)
            count += 1
    gains = Gains(reward[:count], fresh[:count])
    return Moves(state[:count], way[:count], legs[:count], end_s[:count], gains)


@compiled
def still_to_earn(time_s: Floats, seen: Floats, weight: Floats, goal: Goal) -> Floats:
    """Return what each of m states can earn at most from a time on, (m,); ``seen`` is (m, N)."""
    most = np.zeros(len(seen))
    for i in range(len(seen)):
        now = reward_of(time_s[i], goal)
        for k in range(len(weight)):
            more = now - reward_of(seen[i, k], goal)
            if more > 0.0:
                most[i] += weight[k] * more
    return most
