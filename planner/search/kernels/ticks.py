"""What-if flights tick by tick, as Figure 6 prints them; compiled, and slow all the same."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.kernels.closest_approach import (
    FuturesColumns,
    PathColumns,
    knots_of,
    last_at_or_before,
    motion_at,
)
from planner.jit import compiled
from planner.search.kernels.along_roads import LegColumns, SearchIndex
from planner.search.kernels.windows import Departure


class TimedLegs(NamedTuple):
    """C legs, and when each begins if it is flown next."""

    leg: Ints  # (C,) leg index
    start_s: Floats  # (C,) seconds


@compiled
def looks(
    departure: Departure, leg: int, start_s: float, legs: LegColumns, tick_s: float
) -> PathColumns:
    """Return where the UAV is at each tick of its flight to a leg and along it."""
    begin, end = legs.first_point[leg], legs.first_point[leg + 1]
    many = end - begin + 1
    flight = PathColumns(np.empty(many), np.empty(many), np.empty(many))
    flight.time_s[0], flight.x_m[0], flight.y_m[0] = departure
    flight.time_s[1:] = start_s + legs.after_s[begin:end]
    flight.x_m[1:], flight.y_m[1:] = legs.x_m[begin:end], legs.y_m[begin:end]
    # A billionth of a tick: the look at the very end is not lost by rounding.
    count = int(np.floor((flight.time_s[-1] - departure.time_s) / tick_s + 1e-9))
    ticks = PathColumns(np.empty(count), np.empty(count), np.empty(count))
    for m in range(count):
        now_s = min(departure.time_s + (m + 1) * tick_s, flight.time_s[-1])
        i = last_at_or_before(flight.time_s, 0, many, now_s)
        uav = motion_at(flight, i, many, now_s)
        ticks.time_s[m], ticks.x_m[m], ticks.y_m[m] = now_s, uav.x_m, uav.y_m
    return ticks


@compiled
def first_look(
    ticks: PathColumns, from_s: float, futures: FuturesColumns, particle: int, radius_m: float
) -> float:
    """Return the first tick from a time on at which a particle is within the radius, or inf."""
    knots, time_s = knots_of(futures), futures.time_s
    k, k_end = futures.first_knot[particle], futures.first_knot[particle + 1]
    if k == k_end:
        return np.inf
    from_s = max(from_s, time_s[k])
    to_s = time_s[k_end - 1] if futures.gone[particle] else np.inf
    for m in range(len(ticks.time_s)):
        now_s = ticks.time_s[m]
        if now_s > to_s:
            break
        if now_s >= from_s:
            while k + 1 < k_end and time_s[k + 1] <= now_s:
                k += 1
            there = motion_at(knots, k, k_end, now_s)
            dx, dy = there.x_m - ticks.x_m[m], there.y_m - ticks.y_m[m]
            if dx * dx + dy * dy <= radius_m * radius_m:
                return float(now_s)
    return np.inf


@compiled
def seen_by_ticks(
    departure: Departure,
    wanted: TimedLegs,
    miss: Floats,
    futures: FuturesColumns,
    index: SearchIndex,
    tick_s: float,
) -> Floats:
    """Return when each wanted leg, with its start, sees each unseen particle, (C, N), or inf.

    ``miss`` (N,) is above 0 for the particles looked for.
    """
    sensing = index.sensing
    seen_at = np.full((len(wanted.leg), len(miss)), np.inf)
    for c in range(len(wanted.leg)):
        start_s = wanted.start_s[c]
        ticks = looks(departure, wanted.leg[c], start_s, index.legs, tick_s)
        from_s = departure.time_s if sensing.in_transit else start_s
        for who in range(len(miss)):
            if miss[who] > 0.0:
                seen_at[c, who] = first_look(ticks, from_s, futures, who, sensing.radius_m)
    return seen_at
