"""Ceilings, compiled: what a flight to and along each of many legs earns at most.

A ceiling is found without flying. A transit sees nobody but who is inside the ring around its
start when that passes, in the directions in which its sector of the compass lies; a road sees
nobody but who passes it meanwhile. So a few legs have to be flown to know the best of thousands.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.detection.kernels.closest_approach import Window
from planner.detection.kernels.worth import reward_of
from planner.jit import compiled
from planner.search.kernels.along_roads import SearchIndex
from planner.search.kernels.transits import Transits, first_from
from planner.search.kernels.what_if import Candidates
from planner.search.kernels.windows import ENTER, LEAVE, LOW, WIDE, Departure, all_windows

SECTORS = 128  # of the compass
DISTANCES = 64  # to which flights are told apart, the nearer the finer


class Doubt(NamedTuple):
    """How likely it is that a sighting is the first."""

    unseen: Floats  # (N,) probability of each particle, as far as it is looked for
    seen_at: Floats  # (N,) seconds, when each was last seen, inf: not yet
    missed: float  # probability that one seen a horizon ago was missed then


@compiled
def worth(who: int, span: Window, doubt: Doubt, index: SearchIndex) -> float:
    """Return the most that a sighting of a particle within a time span can earn."""
    share, seen_s = 1.0, doubt.seen_at[who]
    if seen_s < np.inf:
        since_s = max(0.0, span.to_s - seen_s)
        share = doubt.missed * min(1.0, since_s / index.goal.horizon_s)
    return float(doubt.unseen[who] * share * reward_of(span.from_s, index.goal))


@compiled
def distance_of(lasts_s: float, over_s: float) -> int:
    """Return which of the distances a flight of some seconds has, of flights up to ``over_s``."""
    share = lasts_s / over_s if over_s > 0.0 else 1.0
    return min(DISTANCES - 1, int(DISTANCES * np.sqrt(max(0.0, share))))


@compiled
def sector_of(bearing: float) -> int:
    """Return the sector of a bearing in [-2, 6]; those from 2 on have the number plus SECTORS."""
    return int((bearing + 2.0) / 4.0 * SECTORS)


@compiled
def over_transits(
    departure: Departure, transits: Transits, doubt: Doubt, index: SearchIndex
) -> tuple[float, Floats]:
    """Return what is earned where the UAV sets out, and what each transit earns beyond it at most.

    The latter, (E,), is 0 if the sensor is off in transit.
    """
    start_s, many = departure.time_s, len(transits.lasts_s)
    most, at_once = np.zeros(many), 0.0
    if many == 0 or not index.sensing.in_transit:
        return at_once, most
    over_s = np.max(transits.lasts_s)
    here, windows = all_windows(
        departure, start_s + over_s, doubt.unseen, index.motion, index.sensing
    )
    for who in here:
        at_once += worth(who, Window(start_s, start_s), doubt, index)
    table = np.zeros((SECTORS, DISTANCES))
    for i in range(len(windows.of)):
        enter_s, leave_s = windows.spans[i, ENTER], windows.spans[i, LEAVE]
        value = worth(windows.of[i, 0], Window(enter_s, leave_s), doubt, index)
        low, away = windows.spans[i, LOW], distance_of(enter_s - start_s, over_s)
        first, last = sector_of(low), sector_of(low + windows.spans[i, WIDE])
        for sector in range(first, min(last, first + SECTORS - 1) + 1):
            table[sector % SECTORS, away] += value
    for away in range(1, DISTANCES):
        table[:, away] += table[:, away - 1]
    for e in range(many):
        sector = sector_of(transits.bearing[e]) % SECTORS
        most[e] = table[sector, distance_of(transits.lasts_s[e], over_s)]
    return at_once, most


@compiled
def along_road(road: int, flown: Window, doubt: Doubt, index: SearchIndex) -> float:
    """Return the most that a flight along a road can earn between two times."""
    first, begins_s, ends_s, latest_s, particle, _ = index.passages
    most = 0.0
    for entry in (road, road + len(first) // 2):
        end = first[entry + 1]
        # As in `passages_within`, but few of them begin meanwhile: no need to look for the last.
        i = first_from(latest_s, flown.from_s, first[entry], end)
        while i < end and begins_s[i] <= flown.to_s:
            if ends_s[i] >= flown.from_s and doubt.unseen[particle[i]] > 0.0:
                span = Window(max(flown.from_s, begins_s[i]), min(flown.to_s, ends_s[i]))
                most += worth(particle[i], span, doubt, index)
            i += 1
    return most


@compiled
def ceilings(
    departure: Departure,
    candidates: Candidates,
    transits: Transits,
    doubt: Doubt,
    index: SearchIndex,
) -> Floats:
    """Return what a flight to and along each candidate earns at most, (C,)."""
    at_once, on_the_way = over_transits(departure, transits, doubt, index)
    first_point, after_s = index.legs.first_point, index.legs.after_s
    most = np.empty(len(candidates.leg))
    for c in range(len(most)):
        leg, transit = candidates.leg[c], candidates.transit[c]
        start_s, before = departure.time_s, at_once
        if transit >= 0:
            start_s += transits.lasts_s[transit]
            before += on_the_way[transit]
        start_s += candidates.turns_s[c]
        end_s = start_s + after_s[first_point[leg + 1] - 1]
        most[c] = before + along_road(leg // 2, Window(start_s, end_s), doubt, index)
    return most
