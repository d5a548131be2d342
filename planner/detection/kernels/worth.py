"""What a sighting is worth, compiled: alone, and beside flights of others that are decided.

A sighting of a particle at t saves the expected seconds from t to the horizon that the others would
leave it unseen, C(t), the integral of its survival under their flights; where nobody else flies
that is the horizon less t. With a deadline it is what they leave unseen by then. So what flights
find together is the sum of what each adds to those before it.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Offsets
from planner.detection.kernels.closest_approach import last_at_or_before
from planner.detection.kernels.contacts import ContactColumns
from planner.detection.kernels.survival import SurvivalColumns, lasting
from planner.jit import compiled


class Others(NamedTuple):
    """What flights of others leave unseen, in pieces; no particles at all: nobody else flies."""

    first: Offsets  # (N + 1,) where a particle's pieces start, or (0,)
    time_s: Floats  # (M,) seconds, when each piece begins, before the horizon; the first is -inf
    survives: Floats  # (M,) probability of being unseen then
    rate_per_s: Floats  # (M,) of detection from then on
    rest_s: Floats  # (M,) expected seconds unseen from then to the horizon; inf in the first
    by: Floats  # (N,) probability of being unseen by the deadline, if there is one


class Goal(NamedTuple):
    """What a search is for, as in ``Objective``, and what others do for it."""

    horizon_s: float
    by_s: float  # the deadline, seconds; infinity: none
    others: Others


@compiled
def reward_of(seen_s: float, goal: Goal) -> float:
    """Return what a sighting is worth at most, and where nobody else flies."""
    if goal.by_s < np.inf:
        return 1.0 if seen_s <= goal.by_s else 0.0
    return max(0.0, goal.horizon_s - seen_s)


@compiled
def others_of(survival: SurvivalColumns, horizon_s: float, by_s: float) -> Others:
    """Return what flights leave unseen until the horizon, and by the deadline."""
    many = len(survival.first) - 1
    first, room = np.zeros(many + 1, dtype=np.int64), len(survival.time_s) + many
    time_s, survives, rates = np.empty(room), np.empty(room), np.empty(room)
    rest_s, by, count = np.empty(room), np.ones(many), 0
    for who in range(many):
        begin = count
        time_s[count], survives[count], rates[count] = -np.inf, 1.0, 0.0
        count += 1
        for i in range(survival.first[who], survival.first[who + 1]):
            if survival.time_s[i] < horizon_s:
                time_s[count], survives[count] = survival.time_s[i], survival.survives[i]
                rates[count] = survival.rate_per_s[i]
                count += 1
        after_s, rest = horizon_s, 0.0
        for i in range(count - 1, begin - 1, -1):
            rest += survives[i] * lasting(rates[i], after_s - time_s[i])
            rest_s[i], after_s = rest, time_s[i]
        if by_s < np.inf:
            i = last_at_or_before(time_s, begin, count, by_s)
            decay = np.exp(-rates[i] * (by_s - time_s[i])) if rates[i] > 0.0 else 1.0
            by[who] = survives[i] * decay
        first[who + 1] = count
    return Others(
        first,
        time_s[:count].copy(),
        survives[:count].copy(),
        rates[:count].copy(),
        rest_s[:count].copy(),
        by,
    )


@compiled
def worth_of(particle: int, seen_s: float, goal: Goal) -> float:
    """Return what a sighting of a particle at a time is worth."""
    first, time_s, survives, rates, rest_s, by = goal.others
    if len(first) == 0 or seen_s >= goal.horizon_s:
        return reward_of(seen_s, goal)
    if goal.by_s < np.inf:
        return float(by[particle]) if seen_s <= goal.by_s else 0.0
    end = first[particle + 1]
    i = last_at_or_before(time_s, first[particle], end, seen_s)
    after_s, rest = (time_s[i + 1], rest_s[i + 1]) if i + 1 < end else (goal.horizon_s, 0.0)
    left = survives[i]
    if rates[i] > 0.0:
        left *= np.exp(-rates[i] * (seen_s - time_s[i]))
    return float(rest + left * lasting(rates[i], after_s - seen_s))


@compiled
def unlike(rate: float, other: float, begins_s: float, lasts_s: float) -> float:
    """Return the seconds from ``begins_s`` on in which one rate has found what the other has not.

    The first has looked since second 0, the other from then on.
    """
    still = np.exp(-rate * begins_s)
    return lasting(other, lasts_s) - float(still) * lasting(rate + other, lasts_s)


@compiled
def worth_of_contact(
    particle: int, from_s: float, to_s: float, rate_per_s: float, goal: Goal
) -> float:
    """Return what a contact with a particle unseen before is expected to be worth.

    That is the integral of the probability of being seen just then, times the worth of that.
    """
    if rate_per_s == np.inf:
        return worth_of(particle, from_s, goal)
    over_s = min(to_s, goal.horizon_s, goal.by_s)
    if over_s <= from_s:
        return 0.0
    lasts_s = over_s - from_s
    seen = -np.expm1(-rate_per_s * lasts_s)
    if goal.by_s < np.inf:
        return float(seen * worth_of(particle, from_s, goal))
    worth = seen * worth_of(particle, over_s, goal)
    first, time_s, survives, rates = goal.others[:4]
    if len(first) == 0:
        return float(worth + unlike(rate_per_s, 0.0, 0.0, lasts_s))
    end = first[particle + 1]
    i, now_s = last_at_or_before(time_s, first[particle], end, from_s), from_s
    while now_s < over_s:
        until_s = min(over_s, time_s[i + 1]) if i + 1 < end else over_s
        left = survives[i]
        if rates[i] > 0.0:
            left *= np.exp(-rates[i] * (now_s - time_s[i]))
        worth += left * unlike(rate_per_s, rates[i], now_s - from_s, until_s - now_s)
        now_s, i = until_s, i + 1
    return float(worth)


@compiled
def mean_time(from_s: float, to_s: float, rate_per_s: float) -> float:
    """Return when a contact is expected to see a particle, if it does."""
    if rate_per_s == np.inf:
        return from_s
    exposure = rate_per_s * (to_s - from_s)
    if exposure > 50.0:
        return from_s + 1.0 / rate_per_s
    if exposure < 1e-4:
        return 0.5 * (from_s + to_s)
    return from_s + 1.0 / rate_per_s - (to_s - from_s) / float(np.expm1(exposure))


@compiled
def judged_contacts(
    contacts: ContactColumns, rates: Floats, goal: Goal
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return when contacts see, how probably, what that is worth, and what is left.

    The first three (M,) in terms of a particle unseen before all of them, the last (N,) how
    probably it is unseen after them. A particle's contacts come by time and one after the other.
    """
    first, from_s, to_s = contacts
    time_s, share, worth = np.empty(len(from_s)), np.empty(len(from_s)), np.empty(len(from_s))
    left = np.ones(len(first) - 1)
    for who in range(len(left)):
        for c in range(first[who], first[who + 1]):
            passes, rate_per_s = 0.0, rates[c]
            if rate_per_s < np.inf:
                passes = float(np.exp(-rate_per_s * (to_s[c] - from_s[c])))
            each = worth_of_contact(who, from_s[c], to_s[c], rate_per_s, goal)
            time_s[c] = mean_time(from_s[c], to_s[c], rate_per_s)
            share[c], worth[c] = left[who] * (1.0 - passes), left[who] * each
            left[who] *= passes
    return time_s, share, worth, left
