"""What-if flights tick by tick, as Figure 6 prints them; compiled, and slow all the same."""

from typing import TypeAlias

import numpy as np

from planner.arrays import Flags, Floats, Ints
from planner.detection.kernels.closest_approach import FuturesColumns, last_at_or_before, piece_at
from planner.jit import compiled
from planner.search.kernels.transits import Place
from planner.search.kernels.what_if import LegColumns

Ticks: TypeAlias = tuple[Floats, Floats, Floats]  # time_s, x_m, y_m of the UAV at each look


@compiled
def looks(place: Place, leg: int, start_s: float, legs: LegColumns, tick_s: float) -> Ticks:
    """Return where the UAV is at each tick of its flight to a leg and along it."""
    first_point, after_s, leg_x, leg_y, _, _ = legs
    begin, end = first_point[leg], first_point[leg + 1]
    flight = (np.empty(end - begin + 1), np.empty(end - begin + 1), np.empty(end - begin + 1))
    flight[0][0], flight[1][0], flight[2][0] = place
    flight[0][1:] = start_s + after_s[begin:end]
    flight[1][1:], flight[2][1:] = leg_x[begin:end], leg_y[begin:end]
    # A billionth of a tick: the look at the very end is not lost by rounding.
    many = int(np.floor((flight[0][-1] - place[0]) / tick_s + 1e-9))
    ticks = (np.empty(many), np.empty(many), np.empty(many))
    for m in range(many):
        now_s = min(place[0] + (m + 1) * tick_s, flight[0][-1])
        i = last_at_or_before(flight[0], 0, len(flight[0]), now_s)
        x, y, _, _, _ = piece_at(flight, i, len(flight[0]), now_s)
        ticks[0][m], ticks[1][m], ticks[2][m] = now_s, x, y
    return ticks


@compiled
def first_look(
    ticks: Ticks, from_s: float, futures: FuturesColumns, particle: int, radius_m: float
) -> float:
    """Return the first tick from a time on at which a particle is within the radius, or inf."""
    time_s, x_m, y_m, first_knot, gone = futures
    k, k_end = first_knot[particle], first_knot[particle + 1]
    if k == k_end:
        return np.inf
    from_s = max(from_s, time_s[k])
    to_s = time_s[k_end - 1] if gone[particle] else np.inf
    for m in range(len(ticks[0])):
        now_s = ticks[0][m]
        if now_s > to_s:
            break
        if now_s >= from_s:
            while k + 1 < k_end and time_s[k + 1] <= now_s:
                k += 1
            x, y, _, _, _ = piece_at((time_s, x_m, y_m), k, k_end, now_s)
            dx, dy = x - ticks[1][m], y - ticks[2][m]
            if dx * dx + dy * dy <= radius_m * radius_m:
                return now_s
    return np.inf


@compiled
def seen_by_ticks(
    place: Place,
    wanted: tuple[Ints, Floats],
    unseen: Flags,
    legs: LegColumns,
    futures: FuturesColumns,
    sensing: tuple[float, float, bool],
) -> Floats:
    """Return when each wanted leg, with its start, sees each unseen particle, (C, N), or inf.

    ``sensing`` holds the radius, the tick, and whether the sensor is on in transit.
    """
    radius_m, tick_s, in_transit = sensing
    seen_at = np.full((len(wanted[0]), len(unseen)), np.inf)
    for c in range(len(wanted[0])):
        start_s = wanted[1][c]
        ticks = looks(place, wanted[0][c], start_s, legs, tick_s)
        from_s = place[0] if in_transit else start_s
        for particle in range(len(unseen)):
            if unseen[particle]:
                seen_at[c, particle] = first_look(ticks, from_s, futures, particle, radius_m)
    return seen_at
