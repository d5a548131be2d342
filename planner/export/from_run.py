"""From a stored plan to the flight that is written: simplified, timed by the law, home in time."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.errors import InputError
from planner.export.by_hand import Judge, Pilot, by_hand
from planner.export.directions import Direction, directions
from planner.export.flight_file import FlightFile, Waypoint
from planner.export.line import Line, line_of, simplified
from planner.export.mavlink import Autopilot
from planner.export.on_earth import ends_without_holds, fixes_of, waypoints_of
from planner.export.way import Way
from planner.flight.airspace import Airspace
from planner.flight.as_flown import Battery, line_flown
from planner.flight.law import Aircraft, FlightLaw, TimedFlight
from planner.flight.plan import Sortie
from planner.flight.separation import Course
from planner.flight.simplified import Clear
from planner.flight.track import Track
from planner.flight.ways import Point
from planner.mission.aircraft import aircraft_of, never_flown
from planner.mission.areas import link_of, within_link
from planner.mission.opening import OpenScenario
from planner.mission.plan_file import StoredPlan
from planner.network.georeference import is_georeferenced
from planner.network.road_network import RoadNetwork
from planner.progress import Progress, silent
from planner.scenario.uav import UavSection

MOST_OFF_M = 10.0  # that a flight may be off by what is simplified, if nothing is said
PART_OF_RADIUS = 1 / 6  # of the sensor's, and no more than that
HOLD_DIGITS: dict[Autopilot, int] = {"ardupilot": 0, "px4": 1}  # of the seconds that it hovers
PLANE = "+proj=tmerc +lat_0={} +lon_0={} +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m +no_defs"

FIRST = Sortie(0)

LatLon = tuple[float, float]


class Hand(NamedTuple):
    """A flight by hand that is asked for."""

    legs: int  # at most
    judge: Judge
    progress: Progress = silent


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
    by_hand: tuple[Direction, ...] = ()  # the legs of a pilot with a stick; empty: an autopilot's
    sortie: Sortie = FIRST  # whose flight it is

    @property
    def whose(self) -> str:
        """What the names of its files say of whose flight it is, where there are several."""
        again = f".{self.sortie.number + 1}" if self.sortie.number else ""
        return f"-uav{self.sortie.uav + 1}{again}"

    @property
    def course(self) -> Course:
        """Where it may be when, for others to keep apart from."""
        law = self.aircraft.law
        lands_s = law.descend_s if self.battery.home_m is not None else 0.0
        return Course.of(self.track, law.altitude_m, law.climb_s, lands_s)

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
    """Return the flight of a run as it is written; one of several: of `StoredPlan.each`.

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
    setting = _Setting.of(opened, stored, uav, origin)
    off_m = _tolerance_m(opened) if tolerance_m is None else tolerance_m
    line = simplified(_planned(opened, stored), off_m, setting.clear)
    way = Way.all_of(line)
    if uav is not None:  # the plan's own aircraft comes home in time, and sooner past fewer corners
        way = way.in_time(setting.law, setting.battery)
    is_cut = not way.is_all_of(line)
    way = way.rounded(HOLD_DIGITS[autopilot])
    track, times = setting.flown(way)
    arrives_s = setting.up_s + times.arrives_s
    turn = -2 if setting.lands and len(way.xy_m) > 1 else -1
    ended_s = setting.up_s + float(times.leaves_s[turn]) if is_cut else None
    sortie = stored.plan.flights[0]
    return replace(setting.flight(opened, way, arrives_s, track), ended_s=ended_s, sortie=sortie)


def hand_flight(
    opened: OpenScenario,
    stored: StoredPlan,
    hand: Hand,
    *,
    uav: UavSection | None = None,
    origin: LatLon | None = None,
) -> RunFlight:
    """Return the flight of a run as a pilot with a stick flies it.

    Parameters
    ----------
    hand
        In how many legs, and what these are chosen by.
    uav, origin
        As `run_flight` takes them.

    Raises
    ------
    InputError
        As `run_flight`, or if no street can be flown along.
    """
    if len(stored.plan.tracks) != 1:
        raise InputError("--by-hand: is for one flight; plan with one UAV, or leave it out")
    setting = _Setting.of(opened, stored, uav, origin)
    if not setting.law.can_hover:
        raise InputError(
            "--by-hand: a pilot with a stick comes to rest to turn, and this aircraft cannot hover "
            "(uav.hover); leave it out"
        )
    pilot = Pilot(setting.law, setting.battery, setting.up_s, setting.clear)
    line, network = _planned(opened, stored), setting.network
    way = by_hand(line, hand.legs, pilot, hand.judge, network, hand.progress)
    track, times = setting.flown(way)
    said = directions(setting.network, way, setting.up_s + times.leaves_s)
    way = way._replace(hold_s=np.zeros(len(way.hold_s)))  # nobody holds by the clock
    found = setting.flight(opened, way, setting.up_s + times.arrives_s, track)
    return replace(found, by_hand=tuple(said))


@dataclass(frozen=True, eq=False)
class _Setting:
    """Who flies where."""

    network: RoadNetwork
    aircraft: Aircraft
    battery: Battery
    up_s: float  # when it is at its height
    airspace: Airspace | None
    called: str  # what is flown
    uav: UavSection  # as its flight begins
    start_m: Point  # where it takes off

    @classmethod
    def of(
        cls,
        opened: OpenScenario,
        stored: StoredPlan,
        uav: UavSection | None,
        origin: LatLon | None,
    ) -> "_Setting":
        network, plan = placed(opened.network, origin), stored.plan
        (whose, _), planned_for = plan.flights[0], opened.scenario.uavs
        several = len(planned_for) > 1 or planned_for[0].sorties is not None
        uav = _as_begun(uav or planned_for[whose], plan.flights[0])
        aircraft, home_m = _real(uav), opened.landings_m[whose]
        airspace = opened.airspaces[whose]
        title = opened.scenario.title or opened.scenario.path.parent.name
        if uav.in_air is not None:
            aircraft = aircraft.in_air
        return cls(
            network,
            aircraft,
            _battery(uav, aircraft, home_m, airspace),
            plan.take_off_s + aircraft.law.climb_s,
            within_link(airspace, link_of(uav, network)),
            f"{title}: {plan.names[0]}" if several else title,
            uav,
            opened.starts_m[whose],
        )

    @property
    def clear(self) -> Clear | None:
        return None if self.airspace is None else _clear(self.airspace)

    @property
    def law(self) -> FlightLaw:
        return self.aircraft.law

    @property
    def lands(self) -> bool:
        return self.battery.home_m is not None

    def flown(self, way: Way) -> tuple[Track, TimedFlight]:
        return line_flown(way.xy_m, way.hold_s, self.law, up_s=self.up_s, lands=self.lands)

    def launch(self, opened: OpenScenario) -> Waypoint | None:
        """Return where it took off, if it flies already."""
        if self.uav.in_air is None:
            return None
        took_off = Way(np.array([self.start_m]), np.zeros(1), ())
        return waypoints_of(took_off, np.array([opened.scenario.take_off_s]), self.network)[0]

    def flight(self, opened: OpenScenario, way: Way, arrives_s: Floats, track: Track) -> RunFlight:
        waypoints = waypoints_of(way, arrives_s, self.network)
        flight = _file(opened, self, waypoints)
        fixes = fixes_of(track, self.law, self.network, lands=self.lands)
        return RunFlight(
            flight=replace(flight, way=fixes),
            aircraft=self.aircraft,
            battery=self.battery,
            track=track,
            network=self.network,
            airspace=self.airspace,
            ended_s=None,
        )


def line_alone(run: RunFlight) -> Track | None:
    """Return how a flight is flown by those who take its line and hold nowhere.

    None if it holds nowhere anyhow.
    """
    places = [(one.x_m, one.y_m) for one in run.flight.waypoints]
    if not any(one.hold_s for one in run.flight.waypoints):
        return None
    kept = [k for k, place in enumerate(places) if k == 0 or place != places[k - 1]]
    xy_m, lands = np.array(places)[kept], run.battery.home_m is not None
    law, up_s = run.aircraft.law, run.flight.waypoints[0].arrives_s
    return line_flown(xy_m, np.zeros(len(xy_m)), law, up_s=up_s, lands=lands)[0]


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
            "--origin: is needed, as the net of this run does not say where on the Earth it lies; "
            "give --origin LAT,LON, the place where its x and y are 0"
        )
    return replace(network, projection=PLANE.format(*origin), net_offset_m=(0.0, 0.0))


def _real(uav: UavSection) -> Aircraft:
    for fault in never_flown(uav):
        raise InputError(str(fault))
    aircraft = aircraft_of(uav)
    assert aircraft is not None
    return aircraft


def _as_begun(uav: UavSection, flight: Sortie) -> UavSection:
    """Return a UAV as one of its flights begins: in the air at most in its first one."""
    return uav.model_copy(update={"in_air": None}) if flight.number else uav


def _planned(opened: OpenScenario, stored: StoredPlan) -> Line:
    if len(stored.plan.tracks) != 1:
        raise InputError("plan.json: holds several flights, which are written one by one")
    flight = stored.plan.flights[0]
    whose, uav = flight.uav, _as_begun(opened.scenario.uavs[flight.uav], flight)
    made_for = aircraft_of(uav)
    law = FlightLaw(uav.speed_mps) if made_for is None else made_for.law
    flies = uav.in_air is not None
    return line_of(
        stored.plan.tracks[0],
        stored.plan.legs[0],
        opened.network,
        up_s=0.0 if flies else law.climb_s,
        down_s=0.0 if opened.landings_m[whose] is None else law.descend_s,
    )


def _tolerance_m(opened: OpenScenario) -> float:
    return min(MOST_OFF_M, PART_OF_RADIUS * opened.scenario.sensor.radius_m)


def _clear(airspace: Airspace) -> Clear:
    def clear(a: Floats, b: Floats) -> bool:
        return airspace.sees(_point(a), _point(b))

    return clear


def _point(place: Floats) -> Point:
    return float(place[0]), float(place[1])


def _battery(
    uav: UavSection, aircraft: Aircraft, home_m: Point | None, airspace: Airspace | None
) -> Battery:
    lasts_s = np.inf if uav.max_flight_time_s is None else uav.max_flight_time_s
    there = uav.in_air
    if there is not None and there.left_s is not None:
        lasts_s = there.left_s
    return Battery(lasts_s, aircraft.reserve_s, home_m, aircraft.headwind_mps, airspace)


def _file(opened: OpenScenario, setting: _Setting, waypoints: list[Waypoint]) -> FlightFile:
    launch = setting.launch(opened)
    start, end = ((one.x_m, one.y_m) for one in (launch or waypoints[0], waypoints[-1]))
    comes_home = setting.battery.home_m == start == end
    return FlightFile(
        name=setting.called,
        waypoints=tuple(ends_without_holds(waypoints, comes_home)),
        height_m=setting.law.altitude_m,
        speed_mps=setting.law.speed_mps,
        comes_home=comes_home,
        sighted_at=opened.scenario.target.sighted_at,
        attribution=setting.network.attribution,
        launch=launch,
    )
