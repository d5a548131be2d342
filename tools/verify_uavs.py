"""What the files of a certified run say of its UAVs, their flights and their sensor, for verify.py.

docs/formats.md has the fields. Where there is one UAV its place and time of take-off are those of
the first waypoint; of several the certificate lists them.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
import verify_plan
from verify_aircraft import climb_s, strays_m, value, wind_mps
from verify_files import Array, Fields, RefusedError
from verify_times import Law, law_of, timed_again

Pair: TypeAlias = tuple[float, float]
Said: TypeAlias = tuple[str, Any, Any]  # name, claimed, found
MOST_UAVS = 50
NEAR = 1e-9  # by which a sweep width may differ, as a share of it


@dataclass(frozen=True)
class Uav:
    """Where and when a UAV takes off, how fast it is, by when it has to land."""

    take_off_s: float
    place_m: Pair
    speed_mps: float
    landing_s: float | None
    sorties: int = 1  # at most; 0: it flies no more
    climb_s: float = 0.0
    strays_m: float = 0.0  # from its line, at most

    @property
    def lands_s(self) -> float:
        """When a flight has to end; infinity: never."""
        return math.inf if self.landing_s is None else self.landing_s


@dataclass(frozen=True)
class NamedLeg:
    """A road that the plan says a UAV flies."""

    road: str
    ends: tuple[str, str]  # names of the nodes from and to
    times_s: tuple[float, float, float]  # departs, starts and ends


@dataclass(frozen=True)
class Flight:
    """A flight as plan.json has it."""

    uav: int  # whose it is
    law: Law | None  # that its aircraft is timed by; None: it is the ideal one
    waypoints: Array  # (points, 3) seconds, x, y
    sensor_on: list[Pair]
    legs: list[NamedLeg]
    fields: Fields


def flights_of(plan: Fields) -> tuple[Flight, ...]:
    """Return all flights of a plan, of which each is another UAV's.

    Raises
    ------
    RefusedError
        If there are none, a UAV flies twice, or a field is of another type.
    """
    some = plan.items("uavs", MOST_UAVS)
    found = tuple(_flight(plan, number, one, len(some)) for number, one in enumerate(some))
    if not found or len({flight.uav for flight in found}) < len(found):
        raise RefusedError("plan.json: uavs should hold one flight of each UAV that flies")
    return found


def _flight(plan: Fields, number: int, content: Any, many: int) -> Flight:
    fields = Fields(f"plan.json: uavs[{number}]", content)
    return Flight(
        uav=fields.whole("uav") if many > 1 or "uav" in fields else 0,
        law=law_of(fields),
        waypoints=verify_plan.waypoints(plan, fields),
        sensor_on=sensor_on(fields),
        legs=[_leg(fields.where, i, leg) for i, leg in enumerate(fields.items("legs"))],
        fields=fields,
    )


def sensor_on(flight: Fields) -> list[Pair]:
    """Return from when to when a flight's sensor is on, one time after the other."""
    windows = flight.rows("sensor_on", 2)
    if (np.diff(windows.ravel()) < 0).any():
        raise RefusedError(f"{flight.where}: sensor_on should be rising and disjoint")
    return [(begin, end) for begin, end in windows.tolist()]


def _leg(where: str, number: int, content: Any) -> NamedLeg:
    leg = Fields(f"{where}: leg {number + 1}", content)
    depart, start, end = (leg.number(key) for key in ("depart_s", "start_s", "end_s"))
    ends = leg.text("from_node"), leg.text("to_node")
    return NamedLeg(leg.text("road"), ends, (depart, start, end))


def uavs_of(run: Fields, certificate: Fields, flights: tuple[Flight, ...]) -> tuple[Uav, ...]:
    """Return the UAVs that a certificate is about; the scenario says how each may fly.

    Raises
    ------
    RefusedError
        If there are several flights and no list of UAVs, or a flight is of none that may fly.
    """
    found = _listed(certificate, flights)
    sections = sections_of(run.part("scenario"))
    if any(value(one, "in_air") is not None for one in sections):
        raise RefusedError("run.json: scenario: uav: no bound is for one that is in the air")
    uavs = tuple(map(_as_said, found, sections)) + found[len(sections) :]
    if not all(uavs[flight.uav].sorties for flight in flights):
        raise RefusedError("plan.json: uavs: one flies that flies no more in the scenario")
    return uavs


def sections_of(scenario: Fields) -> list[Fields]:
    """Return what a scenario says of each UAV."""
    asked = scenario.any("uav")
    if asked == []:
        raise RefusedError(f"{scenario.where}: uav should be of one UAV, or of several")
    asked = asked if isinstance(asked, list) else [asked]
    return [Fields(f"{scenario.where}: uav", one) for one in asked]


def _as_said(uav: Uav, section: Fields) -> Uav:
    sorties = 1 if value(section, "sorties") is None else section.whole("sorties")
    return replace(uav, sorties=sorties, climb_s=climb_s(section), strays_m=strays_m(section))


def _listed(certificate: Fields, flights: tuple[Flight, ...]) -> tuple[Uav, ...]:
    if "uavs" not in certificate:
        if len(flights) > 1 or flights[0].uav:
            raise RefusedError(f"{certificate.where}: has no uavs, but there are several")
        take_off_s, x_m, y_m = flights[0].waypoints[0].tolist()
        return (_uav(certificate, take_off_s, (x_m, y_m)),)
    where = f"{certificate.where}: uavs"
    some = [Fields(where, one) for one in certificate.items("uavs", MOST_UAVS)]
    if len(some) < 2 or max(flight.uav for flight in flights) >= len(some):
        raise RefusedError(f"{where}: should hold each UAV that has a flight, and two at least")
    return tuple(
        _uav(one, one.number("take_off_s"), (one.number("x_m"), one.number("y_m"))) for one in some
    )


def _uav(fields: Fields, take_off_s: float, place_m: Pair) -> Uav:
    return Uav(take_off_s, place_m, fields.above_zero("speed_mps"), fields.maybe("landing_s"))


def flights_said_again(
    run: Fields, plan: Fields, flights: tuple[Flight, ...], uavs: tuple[Uav, ...]
) -> Iterator[Said]:
    """Yield what is said more than once of UAVs and flights."""
    sections = sections_of(scenario := run.part("scenario"))
    yield "UAVs of the scenario", len(uavs), len(sections)
    if len(sections) != len(uavs):
        return
    for number, (uav, section) in enumerate(zip(uavs, sections, strict=True)):
        yield from _named(number, len(uavs), _of_uav(scenario, section, uav))
    for flight in flights:
        section, uav, first = sections[flight.uav], uavs[flight.uav], flight.waypoints[0]
        said = [
            *verify_plan.said_again(run, plan, flight.fields, section, first),
            *timed_again(flight.fields, flight.waypoints),
            ("take-off of the flight", [uav.take_off_s, *uav.place_m], first.tolist()),
        ]
        yield from _named(flight.uav, len(uavs), iter(said))


def _named(number: int, many: int, said: Iterator[Said]) -> Iterator[Said]:
    for name, claimed, found in said:
        yield f"UAV {number + 1}: {name}" if many > 1 else name, claimed, found


def _of_uav(scenario: Fields, section: Fields, uav: Uav) -> Iterator[Said]:
    """Yield what the scenario asks for of a UAV beside what the bound is for."""
    over_ground_mps = section.number("speed_mps") + math.hypot(*wind_mps(section))
    yield "speed_mps of the scenario", uav.speed_mps, over_ground_mps
    longest_s = section.maybe("max_flight_time_s") if "max_flight_time_s" in section else None
    lands_s = None if longest_s is None else uav.take_off_s + longest_s
    yield "landing_s of the scenario", uav.landing_s, lands_s
    ready_s = scenario.part("target").number("last_seen_ago_s") + section.number("take_off_s")
    # Which methods may have to wait.
    later_s = ready_s + scenario.part("search").number("planning_time_s", 0.0)
    is_later = abs(later_s - uav.take_off_s) < abs(ready_s - uav.take_off_s)
    yield "take-off of the scenario", uav.take_off_s, later_s if is_later else ready_s
    start = section.part("start")
    if "x_m" in start:  # otherwise it is told from a node, whose name is not in net.json
        wanted_m = [start.number("x_m"), start.number("y_m")]
        yield "place of take-off of the scenario", list(uav.place_m), wanted_m


def misses_said_again(scenario: Fields, rate_per_s: float, radius_m: float) -> Iterator[Said]:
    """Yield what the scenario says of how probably its sensor detects beside a rate.

    It says so of the first UAV, and as if there were no wind.
    """
    sensor, speed_mps = scenario.part("sensor"), sections_of(scenario)[0].above_zero("speed_mps")
    width_m = sensor.maybe("sweep_width_m") if "sweep_width_m" in sensor else None
    exposure = 2.0 * radius_m * rate_per_s / speed_mps  # of a pass straight over a target at rest
    if width_m is None:
        detects = sensor.maybe("detects") if "detects" in sensor else None
        yield "detects of the scenario", 1.0 if detects is None else detects, -math.expm1(-exposure)
        return
    at, share = np.polynomial.legendre.leggauss(200)
    cosine = np.cos(math.pi / 4 * (at + 1))
    seen = -np.expm1(-exposure * cosine) if exposure < math.inf else np.ones(len(cosine))
    found_m = 2.0 * radius_m * math.pi / 4 * float(share @ (seen * cosine))
    is_near = math.isclose(found_m, width_m, rel_tol=NEAR)
    yield "sweep_width_m of the scenario", width_m, width_m if is_near else found_m
