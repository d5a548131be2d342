"""Whether figures are for what the scenario in run.json asks for, and for flights that it allows.

`verify.py --futures` rests on it, for any number of flights and targets.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import verify_plan
from verify_aircraft import value, wind_mps
from verify_files import Array, Fields, RefusedError
from verify_inputs import Claim, same
from verify_uavs import Pair, misses_said_again, sections_of, sensor_on

OFF_M = 1e-4  # by which all parts of a flight together may be longer than time times speed
OFF_S = 1e-6


class Flight(NamedTuple):
    """A flight: straight from waypoint to waypoint, and when its sensor is on."""

    uav: int
    time_s: Array
    place: Array
    on_s: list[Pair]


def flights_of(plan: Fields) -> list[Flight]:
    """Return all flights of a plan, of which a UAV may have several."""
    found = list[Flight]()
    for number, content in enumerate(plan.items("uavs")):
        fields = Fields(f"plan.json: uavs[{number}]", content)
        time_s, x_m, y_m = verify_plan.waypoints(plan, fields).T
        uav = fields.whole("uav") if "uav" in fields else 0
        found.append(Flight(uav, time_s, x_m + 1j * y_m, sensor_on(fields)))
    return found


def as_asked(run: Fields, planned: Fields, flights: Sequence[Flight]) -> Iterator[Claim]:
    """Yield what run.json asks for beside what the figures are for, and whether flights can be."""
    scenario, rate_per_s = run.part("scenario"), math.inf
    search, sensor = scenario.part("search"), scenario.part("sensor")
    for key, part in (("horizon_s", search), ("radius_m", sensor)):
        yield same(f"{key} of the scenario", planned.number(key), part.number(key))
    if "rate_per_s" in planned:
        rate_per_s = planned.above_zero("rate_per_s")
    said = misses_said_again(scenario, rate_per_s, planned.above_zero("radius_m"))
    yield from (same(*one) for one in said)
    by_s = search.number("by_s") if search.text("objective") == "probability" else None
    found_by_s = planned.number("found_by_s") if "found_by_s" in planned else None
    yield same("found_by_s of the scenario", found_by_s, by_s)
    for number, section in enumerate(sections_of(scenario)):
        mine = sorted((one for one in flights if one.uav == number), key=lambda one: one.time_s[0])
        yield from (_held(f"UAV {number + 1}: {name}", fits) for name, fits in _can(mine, section))
    if any(one.uav >= len(sections_of(scenario)) for one in flights):
        raise RefusedError("plan.json: uavs: one is not in the scenario")


def _can(flights: Sequence[Flight], section: Fields) -> Iterator[tuple[str, bool]]:
    """Yield whether a UAV can fly its flights, sorted by time, as far as its speed says."""
    most = 1 if value(section, "sorties") is None else section.whole("sorties")
    mps = section.above_zero("speed_mps") + math.hypot(*wind_mps(section))
    yield "flies no more often than it may", len(flights) <= most
    after = all(a.time_s[-1] <= b.time_s[0] + OFF_S for a, b in pairwise(flights))
    yield "one flight after the other", after
    off_m = [_off_m(one, mps) for one in flights]
    yield "no faster than it is", all(off <= OFF_M for off in off_m)


def _off_m(flight: Flight, mps: float) -> float:
    late_m = abs(np.diff(flight.place)) - mps * np.diff(flight.time_s)
    return float(np.maximum(0.0, late_m).sum())


def _held(name: str, fits: bool) -> Claim:
    return Claim(name, True, fits, float(not fits))
