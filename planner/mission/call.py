"""A call: what somebody says who rings, in words, as a scenario that can be planned.

Every word is echoed as it was understood, and all that are not are refused together.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from planner import compass
from planner.belief.places import ALONG_DEG, in_circle
from planner.clock import rough, span, to_minute, to_second, when
from planner.errors import Fault, InputError, ScenarioError
from planner.messages import as_written, plain, suggestion
from planner.mission.call_net import at_home, net_of
from planner.mission.call_settings import OPTION, key_of, settled
from planner.network.georeference import grid_convergence_deg, is_georeferenced, lonlat
from planner.network.place_words import Where, heading, on_road, told, where
from planner.network.road_network import RoadNetwork
from planner.scenario.aircraft_file import OF_TOWNS, shipped_aircraft, with_aircraft
from planner.scenario.profiles import shipped_profiles
from planner.scenario.source import Tables
from planner.scenario.toml_text import toml_text
from planner.scenario.uav import UavSection

T = TypeVar("T")

PROFILE = "driving"  # where nobody says which
RADIUS_M = 200.0  # how well a place is known, where nobody says
SENSOR_M = 60.0  # how far the sensor sees, where the net's scenario does not say
PARTICLES, WORK, SEED = 1000, 80_000, 1
TO_PLAN_S = 60.0  # until take-off, where nobody says when the drone is ready
LASTS_S = 1800.0  # how long is searched, where the aircraft has no limit
FARTHEST = timedelta(days=2)  # from now; what is farther away is another day, or a slip
DEGREE_DIGITS, METRE_DIGITS = 6, 1
# Whose word a key of the scenario is, the longer keys first.
OPTIONS = {
    "search.horizon_s": "--until",
    "target.start": "--last-seen",
    "target.profile": "--target",
    "target.last_seen_ago_s": "--at",
    "uav.start": "--drone-at",
    "uav.take_off_s": "--ready",
    "uav.max_flight_time_s": "--battery",
    "uav.aircraft": "--aircraft",
    "target": "--target",
    "uav": "--aircraft",
}
SAID = {
    **{key: option for key, option in OPTIONS.items() if "." in key},
    "target.sighted_at": "--at",
    "network": "NET",
}  # which no other word may say


@dataclass(frozen=True)
class Words:
    """What was said, as it was typed."""

    net: str  # a net's file, or a scenario that has the net
    last_seen: str
    at: str
    drone_at: tuple[str, ...]  # one or more places
    heading: str | None = None
    radius_m: float | None = None
    target: str = PROFILE
    aircraft: Path | None = None
    ready: str | None = None
    until: str | None = None
    battery: str | None = None
    settings: tuple[str, ...] = ()  # keys of the scenario, each KEY=VALUE


@dataclass(frozen=True)
class Call:
    """A call as it was understood."""

    tables: Tables  # a scenario's sections; the drone starts at the first of the places
    sites: tuple[Mapping[str, float], ...]  # where it may start, as `uav.start` has it
    site_names: tuple[str, ...]
    words: Words
    understood: tuple[tuple[str, str], ...]  # what each word means, by name
    title: str
    called_at: datetime  # now, to the second: times of the drone count from here

    @property
    def ready_s(self) -> float:
        """When the drone can take off, seconds from now."""
        return float(self.tables["uav"]["take_off_s"])

    def changed(self, **values: Mapping[str, Any]) -> "Call":
        """Return it with other values of some keys, by section."""
        tables = {key: {**table, **values.get(key, {})} for key, table in self.tables.items()}
        return replace(self, tables=tables)

    def text(self) -> str:
        """Return it as the text of a scenario file."""
        said = (plain(f"# {name}: {' '.join(value.split())}") for name, value in self.understood)
        lines = [f"# A call at {self.called_at.isoformat()}, as it was understood.", *said, ""]
        lines.append(f"title = {toml_text(plain(self.title)[:200])}")
        for name, table in self.tables.items():
            lines += ["", f"[{name}]"]
            for key, value in table.items():
                lines += [*self._said_of(f"{name}.{key}"), f"{key} = {toml_text(value)}"]
        return "\n".join(lines) + "\n"

    def _said_of(self, key: str) -> Iterator[str]:
        """Yield a comment with the words that a key comes from, if it does."""
        for setting in self.words.settings:
            if f"{key_of(setting)}.".startswith(f"{key}."):
                yield plain(f"# {OPTION} {' '.join(setting.split())}")
        option = OPTIONS.get(key, "")
        said = getattr(self.words, option[2:].replace("-", "_"), None)
        if isinstance(said, tuple):
            said = said[self.sites.index(self.tables["uav"]["start"])]
        if said is not None:
            yield plain(f"# {option} {' '.join(str(said).split())}")


def understood(words: Words, now: datetime) -> Call:
    """Return a call as a scenario.

    Parameters
    ----------
    now
        With its offset from UTC.

    Raises
    ------
    InputError
        If the net cannot be read.
    ScenarioError
        With all words that mean nothing, each under its option.
    """
    tables, network = net_of(words.net)
    heard = _Heard(words, now.replace(microsecond=0), network)
    call = heard.call(tables)
    if heard.faults or call is None:
        raise ScenarioError(words.net, heard.faults)
    found = settled(call.tables, words.settings, SAID, tables.get("traffic"))
    if found.faults:
        raise ScenarioError(words.net, found.faults)
    return replace(call, tables=found.tables, understood=(*call.understood, *found.said))


def as_said(fault: Fault, call: Call) -> Fault:
    """Return the fault of a call's scenario as one of the word that its key comes from.

    The key stays beside it where the word named a file, which has keys.
    """
    if any(fault.is_about(key_of(setting)) for setting in call.words.settings):
        return replace(fault, key=f"{OPTION} {fault.key}")
    option = next((word for key, word in OPTIONS.items() if fault.is_about(key)), None)
    files = {"--target": call.tables["target"]["profile"], "--aircraft": call.words.aircraft}
    if option is None:
        return fault
    in_file = str(files.get(option)).endswith(".toml")
    return replace(fault, key=f"{option} ({fault.key})" if in_file else option)


class _Heard:
    """Takes words one by one, and keeps what is wrong with each."""

    def __init__(self, words: Words, now: datetime, network: RoadNetwork) -> None:
        self.words, self.now, self.network = words, now, network
        self.faults: list[Fault] = []
        self._said: list[tuple[str, str]] = []
        self._title = ""

    def call(self, tables: Tables) -> Call | None:
        """Return the call, None if a word that it cannot do without is missing."""
        target = self._target()
        sites = [(one, *self._drone(one)) for one in self.words.drone_at]
        uav = self._uav()
        times = self._times(uav)
        starts = [start for _, start, place in sites if place is not None]
        if self.faults or target is None or uav is None or times is None or not starts:
            return None
        ago_s, ready_s, horizon_s = times
        sighted = self.now - timedelta(seconds=ago_s)
        target |= {"last_seen_ago_s": ago_s, "sighted_at": sighted.isoformat()}
        search = {"horizon_s": horizon_s, "particles": PARTICLES, "sampling": "sobol"}
        whole = {
            "network": tables["network"],
            "target": target,
            "uav": {"start": starts[0], "take_off_s": ready_s, **uav, "return_to": "start"},
            "sensor": tables.get("sensor", {"radius_m": SENSOR_M}),
            **{key: tables[key] for key in ("airspace",) if key in tables},
            "search": {**search, "work": WORK, "seed": SEED},
        }
        names = tuple(place.called for _, _, place in sites if place is not None)
        said = tuple(self._said)
        return Call(whole, tuple(starts), names, self.words, said, self._title, self.now)

    def _tried(self, option: str, meant: Callable[[], T]) -> T | None:
        try:
            return meant()
        except ScenarioError as error:
            self.faults += (Fault(option, f"{fault.key} {fault.text}") for fault in error.faults)
        except InputError as error:
            self.faults.append(Fault(option, str(error)))
        return None

    # Where

    def _target(self) -> dict[str, Any] | None:
        words = self.words
        profile = self._tried("--target", lambda: _profile(words.target))
        to_deg = None
        if words.heading is not None:
            text = words.heading
            to_deg = self._tried("--heading", lambda: heading(text))
        place = self._tried("--last-seen", lambda: self._seen())
        if place is None or profile is None or (to_deg is None and words.heading is not None):
            return None
        if place.edges and words.radius_m is not None:
            text = f"goes with a point, and {place.called} is all of its length; leave it out"
            self.faults.append(Fault("--radius-m", text))
        start = self._tried("--last-seen", lambda: self._start(place, to_deg))
        radius = "" if place.edges else f", within {self._radius_m:g} m"
        to = "" if to_deg is None else f", heading {compass.letters(to_deg)} ({to_deg:g} deg)"
        self._said[0] = ("last seen", f"{self._said[0][1]}{radius}{to}")
        goes, why = at_home(profile, self.network)
        self._said.append(("target", f"{profile}; {why}" if why else profile))
        self._title = f"last seen {place.called}{to}"
        return {"profile": profile, **goes, "start": start, "driving": "free"}

    @property
    def _radius_m(self) -> float:
        return RADIUS_M if self.words.radius_m is None else self.words.radius_m

    def _seen(self) -> Where:
        place = where(self.words.last_seen, self.network)
        moved, said = on_road(self.words.last_seen, place, self.network)
        self._said.append(("last seen", told(place, self.network) + (said and f"; {said}")))
        return moved

    def _start(self, place: Where, to_deg: float | None) -> Any:
        """Return where the target starts, as `target.start` has it."""
        network, in_net_deg = self.network, to_deg
        if to_deg is not None and is_georeferenced(network):
            in_net_deg = to_deg - float(grid_convergence_deg(network, place.xy_m))
        if place.edges:
            edges = [e for e in place.edges if _goes(network, e, in_net_deg)]
            if not edges:
                raise InputError(
                    f"no part of {place.called} within {ALONG_DEG:g} degrees of the heading leads "
                    "on; leave --heading out"
                )
            return [{"edge": edge} for edge in edges]
        radius_m = self._radius_m
        in_circle(network, place.x_m, place.y_m, radius_m, heading_deg=in_net_deg, leads_on=True)
        to = {} if to_deg is None else {"heading_deg": to_deg}
        return {**_written(place, network), "radius_m": radius_m, **to}

    def _drone(self, text: str) -> tuple[dict[str, float], Where | None]:
        place = self._tried("--drone-at", lambda: where(text, self.network))
        if place is None:
            return {}, None
        self._said.append(("drone at", told(place, self.network)))
        return _written(place, self.network), place

    # What it flies, and when

    def _uav(self) -> dict[str, Any] | None:
        """Return the aircraft, and its time in the air, as `[uav]` has them."""
        given = self.words.aircraft or Path(OF_TOWNS)
        stand_in = UavSection.model_validate({"start": {"x_m": 0, "y_m": 0}})
        section = self._tried("--aircraft", lambda: with_aircraft(stand_in, given))
        if section is None:
            return None
        is_shipped = str(given) in shipped_aircraft()
        said: dict[str, Any] = {
            "aircraft": str(given) if is_shipped else given.resolve().as_posix()
        }
        lasts_s = section.max_flight_time_s
        if self.words.battery is not None:
            text = self.words.battery
            lasts_s = self._tried("--battery", lambda: _battery_s(text))
            if lasts_s is None:
                return None
        if lasts_s is not None:
            said["max_flight_time_s"] = lasts_s
        limit = "without a limit" if lasts_s is None else f"up to {rough(lasts_s)} in the air"
        name = given.name.removesuffix(".toml")
        self._said.append(("aircraft", f"{name}, {section.speed_mps:g} m/s, {limit}"))
        return said

    def _times(self, uav: Mapping[str, Any] | None) -> tuple[float, float, float] | None:
        """Return how long ago it was seen, when the drone is ready, and the horizon, seconds."""
        words, now = self.words, self.now
        at = self._tried("--at", lambda: self._past(words.at))
        ready = self._tried("--ready", lambda: self._ready(words.ready))
        until = None
        if words.until is not None:
            text = words.until
            until = self._tried("--until", lambda: self._soon(text))
        if at is None or ready is None or (until is None and words.until is not None):
            return None
        lasts_s = (uav or {}).get("max_flight_time_s", LASTS_S)
        ago_s, ready_s = ((now - at).total_seconds(), (ready - now).total_seconds())
        if until is None:
            until = now + timedelta(seconds=max(ready_s, TO_PLAN_S) + lasts_s)
        if until.second or until.microsecond:  # odds are told at whole minutes
            until = until.replace(second=0, microsecond=0) + timedelta(minutes=1)
        horizon_s = (until - at).total_seconds()
        if horizon_s <= ago_s + ready_s:
            ends, begins = to_minute(until, now), to_second(ready, now)
            text = f"{ends} is not after the drone is ready, {begins}; give a later one"
            self.faults.append(Fault("--until", text))
            return None
        soon = "as soon as there is a plan" if words.ready is None else to_second(ready, now)
        self._said[1:1] = [("seen at", f"{to_second(at, now)}, {_ago(ago_s)}")]
        self._said += [("ready", soon), ("until", to_minute(until, now))]
        return ago_s, ready_s, horizon_s

    def _past(self, text: str) -> datetime:
        at = when(text, self.now)
        if at > self.now:
            raise InputError(f"{to_second(at, self.now)} is still to come; give when it was seen")
        if self.now - at > FARTHEST:
            ago = _ago((self.now - at).total_seconds())
            raise InputError(f"{at.isoformat()} is {ago}, too long for a call; give a later one")
        return at.astimezone(self.now.tzinfo).replace(microsecond=0)

    def _soon(self, text: str) -> datetime:
        soon = when(text, self.now)
        if soon - self.now > FARTHEST:
            at, away = to_second(soon, self.now), rough((soon - self.now).total_seconds())
            raise InputError(f"{at} is {away} away, too long for a call; give an earlier one")
        return soon

    def _ready(self, text: str | None) -> datetime:
        ready = self.now if text is None else self._soon(text)
        if ready < self.now:
            raise InputError(f"{to_second(ready, self.now)} has passed; leave it out")
        return ready.astimezone(self.now.tzinfo).replace(microsecond=0)


def _profile(name: str) -> str:
    if name in shipped_profiles():
        return name
    if name.endswith(".toml") and Path(name).is_file():
        return Path(name).resolve().as_posix()
    hint = suggestion(name, shipped_profiles())
    raise InputError(f"{as_written(name)} is neither a profile nor a .toml file; {hint}")


def _battery_s(text: str) -> float:
    lasts_s = span(text)
    if not 0.0 < lasts_s <= FARTHEST.total_seconds():
        raise InputError(f"{as_written(text)} is no time in the air; write how long, as 25min")
    return lasts_s


def _goes(network: RoadNetwork, name: str, heading_deg: float | None) -> bool:
    """Return whether an edge leads on, and along a heading in the net if one is given."""
    edge = network.edge_index[name]
    if not len(network.turns(edge)):
        return False
    if heading_deg is None:
        return True
    shape = network.edge_shape(edge)
    east_m, north_m = shape[-1] - shape[0]
    bearing_deg = math.degrees(math.atan2(east_m, north_m))
    return abs((bearing_deg - heading_deg + 180.0) % 360.0 - 180.0) <= ALONG_DEG


def _written(place: Where, network: RoadNetwork) -> dict[str, float]:
    """Return a place as a scenario has it: degrees, or metres on a net without a projection."""
    if not is_georeferenced(network):
        return {"x_m": round(place.x_m, METRE_DIGITS), "y_m": round(place.y_m, METRE_DIGITS)}
    lon, lat = np.round(lonlat(network, place.xy_m), DEGREE_DIGITS).tolist()
    return {"lon": lon, "lat": lat}


def _ago(seconds: float) -> str:
    return "now" if seconds < 1.0 else f"{rough(seconds)} ago"
