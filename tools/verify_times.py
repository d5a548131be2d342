"""Whether a real aircraft is at its waypoints when plan.json says so, from plan.json alone.

docs/formats.md has the flight law. Between two places where it rests, an aircraft is as fast as it
may be: at each waypoint the square of its speed is the least that limits allow, and no neighbour
is out of reach by accelerating or braking. An aircraft that cannot hover flies in at full speed.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from verify_files import Array, Fields, RefusedError

OFF_S = 0.01  # by which all parts of a flight together may take longer or less
MOMENT_S = 1e-6  # what is shorter is no rest
STRAIGHT = 0.99999  # sine of half the inner angle at a waypoint, from which on it is no corner
EVER = np.inf  # of a rate that plan.json calls null: at once


class Law(NamedTuple):
    """What decides how long an aircraft takes."""

    speed_mps: float
    rate_mps2: float
    corner_m: float
    climb_s: float
    descend_s: float
    wind: complex  # where the air moves to, x + iy, m/s
    hovers: bool


def law_of(flight: Fields) -> Law | None:
    """Return the law that a flight in plan.json is timed by; None: that of the ideal aircraft."""
    if "aircraft" not in flight:
        return None
    aircraft = flight.part("aircraft")
    rates = [
        EVER if aircraft.any(key) is None else aircraft.above_zero(key)
        for key in ("acceleration_mps2", "corner_m", "climb_mps", "descend_mps")
    ]
    height_m, wind = flight.number("altitude_m", 0.0), aircraft.items("wind_mps", 2)
    if len(wind) != 2 or not all(type(one) in (int, float) for one in wind):
        raise RefusedError(f"{aircraft.where}: wind_mps should be two numbers")
    return Law(
        speed_mps=flight.above_zero("speed_mps"),
        rate_mps2=rates[0],
        corner_m=rates[1],
        climb_s=height_m / rates[2],
        descend_s=height_m / rates[3],
        wind=complex(*wind),
        hovers=aircraft.flag("hover"),
    )


def timed_again(flight: Fields, waypoints: Array) -> Iterator[tuple[str, Any, Any]]:
    """Yield what is said of the times of a real aircraft: name, claimed, found.

    Parameters
    ----------
    waypoints
        Time, x and y, (W, 3).
    """
    law = law_of(flight)
    if law is None:
        return
    time_s, place = waypoints[:, 0], waypoints[:, 1] + 1j * waypoints[:, 2]
    late_s = np.abs(np.diff(time_s) - _lasting_s(time_s, place, law))
    yield "times by the flight law", 0.0, _off(late_s.sum())
    lands = flight.any("landing") is not None
    stays = place[1:] == place[:-1]
    least_s = law.climb_s, law.descend_s if lands else 0.0
    steps = (1, -1)
    for name, needs_s, step in zip(("climb", "descent"), least_s, steps, strict=True):
        stay_s = _first_stay_s(np.diff(time_s)[::step], stays[::step])
        yield f"time for the {name}", 0.0, _off(max(0.0, needs_s - stay_s))
    if not law.hovers:
        hovers_s = float(np.diff(time_s)[stays].sum()) - sum(least_s)
        yield "hovering of what cannot hover", 0.0, _off(max(0.0, hovers_s))
    on = flight.rows("sensor_on", 2).ravel()
    if len(on):
        begins_s, ends_s = time_s[0] + least_s[0], time_s[-1] - least_s[1]
        beyond_s = max(0.0, begins_s - on.min(), on.max() - ends_s)
        yield "sensor on at height only", 0.0, _off(beyond_s)


def _off(seconds: float) -> float:
    return 0.0 if seconds <= OFF_S else float(seconds)


def _first_stay_s(lasts_s: Array, stays: Array) -> float:
    """Return for how long it stays where it begins."""
    many = len(stays) if stays.all() else int(np.argmin(stays))
    return float(lasts_s[:many].sum())


def _lasting_s(time_s: Array, place: Array, law: Law) -> Array:
    """Return how long each part of a flight should last, (W - 1,); a stay lasts as it does."""
    lasts_s, step = np.diff(time_s), np.diff(place)
    rests = np.cumsum((step == 0) & (lasts_s > MOMENT_S))  # how many there have been
    moves = np.flatnonzero(step)
    if len(moves) == 0:
        return lasts_s
    for run in np.split(moves, np.flatnonzero(np.diff(rests[moves])) + 1):  # from rest to rest
        lasts_s[run] = _run_s(step[run], law)
    return lasts_s


def _run_s(step: Array, law: Law) -> Array:
    """Return how long each of some steps takes that are flown without a rest between them."""
    length, unit = np.abs(step), step / np.abs(step)
    top = _over_ground(unit, law)
    if np.isinf(law.rate_mps2):
        return length / top
    power = _least_squares(length, unit, top, law)
    first, second = np.sqrt(power[:-1]), np.sqrt(power[1:])
    peak = np.minimum(top, np.sqrt((power[:-1] + power[1:]) / 2 + law.rate_mps2 * length))
    changes_m = (2 * peak**2 - power[:-1] - power[1:]) / (2 * law.rate_mps2)
    even_m = np.maximum(0.0, length - changes_m)
    return (2 * peak - first - second) / law.rate_mps2 + even_m / peak


def _over_ground(unit: Array, law: Law) -> Array:
    """Return the speed over ground on each course: the wind along it, and what is left of ours."""
    drift = law.wind * np.conj(unit)
    ahead = law.speed_mps**2 - drift.imag**2
    return np.maximum(0.0, drift.real + np.sqrt(np.maximum(0.0, ahead))) * (ahead > 0.0)


def _least_squares(length: Array, unit: Array, top: Array, law: Law) -> Array:
    """Return the square of the speed at each end of each step, (steps + 1,)."""
    turn = (unit[1:] * np.conj(unit[:-1])).real  # cosine of the turn
    sine = np.sqrt(np.clip((1.0 + turn) / 2.0, 0.0, 1.0))
    is_corner = (sine <= STRAIGHT) & np.isfinite(law.corner_m)
    radius_m = np.full(len(turn), EVER)
    radius_m[is_corner] = law.corner_m * sine[is_corner] / (1.0 - sine[is_corner])
    inner = np.minimum(np.minimum(top[1:], top[:-1]) ** 2, law.rate_mps2 * radius_m)
    ends = (0.0, 0.0) if law.hovers else (top[0] ** 2, top[-1] ** 2)
    power = np.concatenate(([ends[0]], inner, [ends[1]]))
    gain = 2 * law.rate_mps2 * length
    for order in (range(len(length)), range(len(length) - 1, -1, -1)):
        for i in order:
            near, far = (i, i + 1) if order.step > 0 else (i + 1, i)
            power[far] = min(power[far], power[near] + gain[i])
    return power
