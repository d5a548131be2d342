"""Survival, compiled: how probably each particle is still unseen at a time, in closed form.

A sensor detects at a constant rate per second while it has a particle within its radius. Rates of
all that see it at once add up, so exposure, the integral of the rate, adds over contacts, over the
legs of a flight and over flights; a particle survives unseen with probability exp(-exposure). A
perfect sensor has an infinite rate: nobody survives the first moment.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import last_at_or_before
from planner.detection.kernels.contacts import ContactColumns
from planner.jit import compiled


class SurvivalColumns(NamedTuple):
    """The survival of N particles in pieces, each with its rate; 1 before the first."""

    first: Offsets  # (N + 1,) where a particle's pieces start
    time_s: Floats  # (M,) seconds, when each piece begins, rising
    survives: Floats  # (M,) probability of being unseen then
    rate_per_s: Floats  # (M,) of detection from then on


@compiled
def lasting(rate_per_s: float, lasts_s: float) -> float:
    """Return the expected seconds unseen under a rate, of so many: (1 - exp(-r s)) / r."""
    if rate_per_s <= 0.0:
        return lasts_s
    return float(-np.expm1(-rate_per_s * lasts_s) / rate_per_s)


@compiled
def piece_at(survival: SurvivalColumns, particle: int, moment_s: float) -> int:
    """Return the piece that holds a moment, the last of several; -1: it is before the first."""
    begin, end = survival.first[particle], survival.first[particle + 1]
    if begin == end or moment_s < survival.time_s[begin]:
        return -1
    return last_at_or_before(survival.time_s, begin, end, moment_s)


@compiled
def unseen_at(survival: SurvivalColumns, particle: int, moment_s: float) -> float:
    """Return the probability that a particle is unseen after a moment."""
    i = piece_at(survival, particle, moment_s)
    if i < 0:
        return 1.0
    since_s = moment_s - survival.time_s[i]
    return float(survival.survives[i] * np.exp(-survival.rate_per_s[i] * since_s))


@compiled
def survival_of(contacts: ContactColumns, rate_per_s: Floats) -> SurvivalColumns:
    """Return the survival under contacts, a particle's in any order, each with its rate, (M,)."""
    many, room = len(contacts.first) - 1, 2 * len(contacts.from_s) + 1
    first, count = np.zeros(many + 1, dtype=np.int64), 0
    time_s, survives, rates = np.empty(room), np.empty(room), np.empty(room)
    for who in range(many):
        begin, end = contacts.first[who], contacts.first[who + 1]
        certain_s = np.inf
        for c in range(begin, end):
            if rate_per_s[c] == np.inf:
                certain_s = min(certain_s, contacts.from_s[c])
        edges = np.concatenate((contacts.from_s[begin:end], contacts.to_s[begin:end]))
        left, level, active, now_s, since = 1.0, 0.0, 0, -np.inf, count
        for e in np.argsort(edges, kind="mergesort"):
            c, begins = begin + e % (end - begin), e < end - begin
            if edges[e] >= certain_s:
                break
            if rate_per_s[c] == np.inf or contacts.from_s[c] == contacts.to_s[c]:
                continue
            if active > 0:
                left *= np.exp(-level * (edges[e] - now_s))
            now_s, active = edges[e], active + (1 if begins else -1)
            level = level + (rate_per_s[c] if begins else -rate_per_s[c]) if active > 0 else 0.0
            if count == since or time_s[count - 1] < now_s:
                count += 1
            time_s[count - 1], survives[count - 1], rates[count - 1] = now_s, left, level
        if certain_s < np.inf:
            time_s[count], survives[count], rates[count] = certain_s, 0.0, 0.0
            count += 1
        first[who + 1] = count
    return SurvivalColumns(
        first, time_s[:count].copy(), survives[:count].copy(), rates[:count].copy()
    )


@compiled
def each_unseen_at(survival: SurvivalColumns, moment_s: Floats) -> Floats:
    """Return the probability that each particle is unseen after its own moment, (N,)."""
    unseen = np.empty(len(moment_s))
    for who in range(len(unseen)):
        unseen[who] = unseen_at(survival, who, moment_s[who])
    return unseen


@compiled
def each_lasts(survival: SurvivalColumns, particle: Ints, until_s: Floats) -> Floats:
    """Return the expected seconds from 0 that particles are unseen until their times, (m,)."""
    first, time_s, survives, rates = survival
    lasts_s = np.empty(len(particle))
    for row in range(len(lasts_s)):
        begin, end = first[particle[row]], first[particle[row] + 1]
        total_s = min(until_s[row], time_s[begin]) if begin < end else until_s[row]
        for i in range(begin, end):
            over_s = min(until_s[row], time_s[i + 1]) if i + 1 < end else until_s[row]
            if over_s > time_s[i] and survives[i] > 0.0:
                total_s += survives[i] * lasting(rates[i], over_s - time_s[i])
        lasts_s[row] = total_s
    return lasts_s


@compiled
def each_falls_to(survival: SurvivalColumns, share: float) -> Floats:
    """Return when the survival of each particle falls to a share below 1, (N,), inf: never."""
    first, time_s, survives, rates = survival
    moment_s = np.full(len(first) - 1, np.inf)
    for who in range(len(moment_s)):
        for i in range(first[who], first[who + 1]):
            if survives[i] <= share:
                moment_s[who] = time_s[i]
                break
            if rates[i] > 0.0:
                falls_s = time_s[i] + np.log(survives[i] / share) / rates[i]
                if i + 1 == first[who + 1] or falls_s < time_s[i + 1]:
                    moment_s[who] = falls_s
                    break
    return moment_s


@compiled
def found_by(survival: SurvivalColumns, weight: Floats, times_s: Floats) -> Floats:
    """Return the probability that a particle is found by each of rising times, (T,)."""
    first, time_s, survives, rates = survival
    steps = np.zeros(len(times_s) + 1)
    for who in range(len(weight)):
        before = 1.0
        for i in range(first[who], first[who + 1]):
            j = np.searchsorted(times_s, time_s[i])
            steps[j] += weight[who] * (before - survives[i])  # all at once: a perfect sensor
            before = survives[i]
            if rates[i] <= 0.0:
                continue
            over_s = time_s[i + 1] if i + 1 < first[who + 1] else np.inf
            while j < len(times_s) and times_s[j] < over_s:
                left = survives[i] * np.exp(-rates[i] * (times_s[j] - time_s[i]))
                steps[j] += weight[who] * (before - left)
                before, j = left, j + 1
            over = survives[i + 1] if i + 1 < first[who + 1] else 0.0
            steps[j] += weight[who] * (before - over)
            before = over
    return np.cumsum(steps)[:-1]
