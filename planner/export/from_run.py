"""From a stored plan to the flight that is written: simplified, timed by the law, home in time."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.errors import InputError
from planner.export.flight_file import FlightFile, Waypoint
from planner.export.line import Line, line_of, simplified
from planner.export.mavlink import Autopilot
from planner.flight.airspace import Airspace
from planner.flight.as_flown import Battery, home_in_time, line_flown
from planner.flight.law import Aircraft, FlightLaw
from planner.flight.simplified import Clear
from planner.flight.track import Track
from planner.flight.ways import Point
from planner.mission.aircraft import aircraft_of
from planner.mission.opening import OpenScenario
from planner.mission.plan_file import StoredPlan
from planner.network.georeference import is_georeferenced, lonlat
from planner.network.road_network import RoadNetwork
from planner.scenario.uav import UavSection

MOST_OFF_M = 10.0  # that a flight may be off by what is simplified, if nothing is said
PART_OF_RADIUS = 1 / 6  # of the sensor's, and no more than that
DEGREES = 7  # digits that files have of a place
HOLD_DIGITS: dict[Autopilot, int] = {"ardupilot": 0, "px4": 1}  # of the seconds that it hovers
PLANE = "+proj=tmerc +lat_0={} +lon_0={} +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m +no_defs"

LatLon = tuple[float, float]


@dataclass(frozen=True, eq=False)
class RunFlight:
    """The flight that files hold, and how it is flown."""

    flight: FlightFile
    aircraft: Aircraft
    battery: Battery
    track: Track  # from lift-off, to the ground if it lands
    network: RoadNetwork  # with a projection
    airspace: Airspace | None
    ended_s: float | None  # when the battery ends it before the plan's end; None: it does not

    @property
    def lasts_s(self) -> float:
        """How long it is in the air, seconds."""
        return self.track.end_s - float(self.track.time_s[0])


def run_flight(
    opened: OpenScenario,
    stored: StoredPlan,
    *,
    uav: UavSection | None = None,
    origin: LatLon | None = None,
    tolerance_m: float | None = None,
    autopilot: Autopilot = "ardupilot",
) -> RunFlight:
    """Return the flight of a run as it is written.

    Parameters
    ----------
    uav
        Another aircraft that flies it, as long as its battery lasts; None: the scenario's.
    origin
        Latitude and longitude of where x and y are 0, for a net that does not say where it lies.
    tolerance_m
        By which it may be off what was planned, at any time; None: `MOST_OFF_M` or less.
    autopilot
        ArduPilot hovers for whole seconds.

    Raises
    ------
    InputError
        If nobody knows where the net lies, at which height to fly, or how the aircraft flies.
    """
    network = placed(opened.network, origin)
    other, uav = uav is not None, uav or opened.scenario.uav
    aircraft = _real(uav)
    line = simplified(
        _planned(opened, stored),
        _tolerance_m(opened) if tolerance_m is None else tolerance_m,
        None if opened.airspace is None else _clear(opened.airspace),
    )
    law, battery = aircraft.law, _battery(uav, aircraft, opened)
    way = _Way(line.xy_m, line.hold_s, line.streets)
    if other:  # the plan's own aircraft comes home in time, and sooner past fewer corners
        way = _home_in_time(way, law, battery)
    is_cut = not way.is_all_of(line)
    way = way._replace(hold_s=_rounded(way.hold_s, HOLD_DIGITS[autopilot]))
    up_s, lands = stored.plan.take_off_s + law.climb_s, battery.home_m is not None
    track, times = line_flown(way.xy_m, way.hold_s, law, up_s=up_s, lands=lands)
    turn = -2 if lands and len(way.xy_m) > 1 else -1
    return RunFlight(
        flight=_file(opened, network, law, _waypoints(way, up_s + times.arrives_s, network)),
        aircraft=aircraft,
        battery=battery,
        track=track,
        network=network,
        airspace=opened.airspace,
        ended_s=up_s + float(times.leaves_s[turn]) if is_cut else None,
    )


def placed(network: RoadNetwork, origin: LatLon | None) -> RoadNetwork:
    """Return a network that says where on the Earth it lies.

    Raises
    ------
    InputError
        If it does not, and no origin is given; or it does, and one is.
    """
    if is_georeferenced(network):
        if origin is not None:
            raise InputError(f"--origin: {network.given_as} says where it lies; leave it out")
        return network
    if origin is None:
        raise InputError(
            f"{network.given_as}: it does not say where on the Earth it lies; give --origin "
            "LAT,LON, the place where its x and y are 0"
        )
    return replace(network, projection=PLANE.format(*origin), net_offset_m=(0.0, 0.0))


def _real(uav: UavSection) -> Aircraft:
    aircraft = aircraft_of(uav)
    if aircraft is None:
        raise InputError(
            "uav: the plan is for an ideal aircraft, which no real one keeps up with; plan with "
            "uav.acceleration_mps2, corner_m, climb_mps and descend_mps, or have it timed anew "
            "for one of them: --aircraft multicopter, or a file"
        )
    if uav.altitude_m <= 0.0:
        raise InputError("uav.altitude_m: is 0, on the ground; give the height to fly at")
    return aircraft


def _planned(opened: OpenScenario, stored: StoredPlan) -> Line:
    if len(stored.plan.tracks) != 1:
        raise InputError("plan.json: a flight file is for one UAV; plan with one")
    made_for = aircraft_of(opened.scenario.uav)
    law = FlightLaw(opened.scenario.uav.speed_mps) if made_for is None else made_for.law
    return line_of(
        stored.plan.tracks[0],
        stored.plan.legs[0],
        opened.network,
        up_s=law.climb_s,
        down_s=0.0 if opened.return_to_m is None else law.descend_s,
    )


def _tolerance_m(opened: OpenScenario) -> float:
    return min(MOST_OFF_M, PART_OF_RADIUS * opened.scenario.sensor.radius_m)


def _clear(airspace: Airspace) -> Clear:
    def clear(a: Floats, b: Floats) -> bool:
        return airspace.sees(_point(a), _point(b))

    return clear


def _point(place: Floats) -> Point:
    return float(place[0]), float(place[1])


def _battery(uav: UavSection, aircraft: Aircraft, opened: OpenScenario) -> Battery:
    lasts_s = np.inf if uav.max_flight_time_s is None else uav.max_flight_time_s
    home_m, headwind_mps = opened.return_to_m, aircraft.headwind_mps
    return Battery(lasts_s, aircraft.reserve_s, home_m, headwind_mps, opened.airspace)


class _Way(NamedTuple):
    """What is flown of a line."""

    xy_m: Floats  # (W, 2) metres
    hold_s: Floats  # (W,) seconds
    streets: tuple[str, ...]  # W - 1

    def is_all_of(self, line: Line) -> bool:
        """Return whether nothing of a line is left out."""
        many = len(line.xy_m)
        if not np.array_equal(self.xy_m[:many], line.xy_m):
            return False
        return bool(np.all(self.hold_s[:many] >= line.hold_s))


def _home_in_time(way: _Way, law: FlightLaw, battery: Battery) -> _Way:
    """Return a way as far as the battery lasts, and the way home."""
    xy_m, hold_s = home_in_time(way.xy_m, way.hold_s, law, battery)
    same = np.all(xy_m[: len(way.xy_m)] == way.xy_m[: len(xy_m)], axis=1)
    turns = len(same) - 1 if same.all() else int(np.argmin(same))  # the last place before home
    if np.array_equal(xy_m[turns:], battery.way_home(_point(xy_m[turns - 1]))):
        turns -= 1
    streets = way.streets[:turns]
    streets = (*streets, *[""] * (len(xy_m) - 1 - len(streets)))
    return _Way(xy_m, hold_s, streets)


def _rounded(hold_s: Floats, digits: int) -> Floats:
    """Return times of hovering with few digits; what is rounded is made up for at the next."""
    held, wanted, found = 0.0, 0.0, []
    for one in hold_s.tolist():
        wanted += one
        found.append(max(0.0, round(wanted - held, digits)) if one > 0.0 else 0.0)
        held += found[-1]
    return np.array(found)


def _waypoints(way: _Way, arrives_s: Floats, network: RoadNetwork) -> list[Waypoint]:
    degrees = np.round(lonlat(network, way.xy_m), DEGREES).tolist()
    rows = zip(
        degrees,
        way.xy_m.tolist(),
        arrives_s.tolist(),
        way.hold_s.tolist(),
        ("", *way.streets),
        strict=True,
    )
    return [
        Waypoint(lat, lon, x_m, y_m, time_s, hold_s, street)
        for (lon, lat), (x_m, y_m), time_s, hold_s, street in rows
    ]


def _file(
    opened: OpenScenario, network: RoadNetwork, law: FlightLaw, waypoints: list[Waypoint]
) -> FlightFile:
    start, end = ((one.x_m, one.y_m) for one in (waypoints[0], waypoints[-1]))
    comes_home = opened.return_to_m == start == end
    return FlightFile(
        name=opened.scenario.title or opened.scenario.path.parent.name,
        waypoints=tuple(_ends_without_holds(waypoints, comes_home)),
        height_m=law.altitude_m,
        speed_mps=law.speed_mps,
        comes_home=comes_home,
        sighted_at=opened.scenario.target.sighted_at,
        attribution=network.attribution,
    )


def _ends_without_holds(waypoints: list[Waypoint], comes_home: bool) -> list[Waypoint]:
    """Return waypoints of which the first, and the one where it lands, are no places to hover.

    Autopilots have commands of their own for these.
    """
    first, last = waypoints[0], waypoints[-1]
    found = list(waypoints)
    if first.hold_s > 0.0 or len(waypoints) == 1:
        found.insert(0, replace(first, hold_s=0.0))
    if comes_home and last.hold_s > 0.0:
        found.append(replace(last, arrives_s=last.arrives_s + last.hold_s, hold_s=0.0, street=""))
    return found
