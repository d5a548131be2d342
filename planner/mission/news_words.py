"""News in words: a line of JSON, or a sentence, as what it means for a mission.

Places are in the words that `planner now` takes, times are seconds or H:M:S since the target was
last seen, a time of day where the scenario says when that was (``target.sighted_at``), or as long
ago as in "-5min". All that is not understood is refused in one line.
"""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from planner.clock import clock
from planner.errors import InputError
from planner.messages import as_written, percent, suggestion
from planner.mission.heard import Heard
from planner.mission.joined import Joined
from planner.mission.news import target_faults
from planner.mission.news_values import NUMBER, Said, Setting
from planner.network.place_words import told
from planner.scenario.faults import faults_of
from planner.scenario.news import KINDS, NothingNews, ReportNews, SearchedNews
from planner.scenario.uav import UavSection
from planner.telemetry.flown import flown
from planner.telemetry.read import read_log

RADIUS_M = 200.0  # how well a place is known, where nobody says
CLOCKS_S = 60.0  # by which the clocks of people may differ; many tell the minute alone
STREET_M = 30.0  # how far from its line who drives on a street may be
HOW_SURE = rf"(?P<sure>{NUMBER}\s*%?)(?:\s*sure)?(?:,\s*within\s+(?P<radius_m>{NUMBER})\s*m)?"
# Which target was seen. No name begins with the verb, and "An den Seen 5" is a place, so that a
# capital letter in the middle makes no verb of a word without "at".
NAMED = r"(?!(?:seen|at)\b)(?P<target>\S.*?)\s+(?:seen\s+at|(?-i:seen))\s+"
SENTENCES = {  # in the order in which they are tried
    "nothing": re.compile(
        rf"nothing\s+(?:at\s+)?(?P<place>.+?)\s+from\s+(?P<from>.+?)\s+to\s+(?P<to>[^,]+),\s*"
        rf"{HOW_SURE}",
        re.IGNORECASE,
    ),
    "report": re.compile(
        rf"(?:{NAMED}|(?:seen\s+)?(?:at\s+)?)(?P<place>.+?)\s+at\s+(?P<at>[^,]+),\s*"
        rf"{HOW_SURE}",
        re.IGNORECASE,
    ),
}
FORMS = (
    '"seen at PLACE at 14:20, 70 % sure" or "nothing at PLACE from 14:10 to 14:20, 80 %", each '
    'with ", within 200 m" if that is known; of several targets, "red seen at PLACE ..."'
)
# of a table [[uav]], of who joins: all but what other words say, and that it flies
UAV_KEYS = {*UavSection.model_fields} - {"start", "take_off_s", "max_flight_time_s", "in_air"}
KEYS = {
    "report": {"place", "at", "sure", "radius_m", "sd_m", "target", "same_source", "insist"},
    "nothing": {"place", "from", "to", "sure", "radius_m"},
    "searched": {"track", "waypoints", "sensor_on", "radius_m", "detects", "speed_mps"},
    "found": {"target"},
    "delay": {"lasts", "uav"},
    "uav": {"place", "battery", "uav"},
    "lost": {"uav", "at"},
    "joined": {"place", "ready", "battery", *UAV_KEYS},
}
UAV_NAME = re.compile(r"(?:uav\s*)?([1-9]\d{0,5})", re.IGNORECASE)


def sentence(text: str) -> dict[str, Any]:
    """Return a sentence as a line of JSON has it.

    Raises
    ------
    InputError
        If it is none that is known.
    """
    said = " ".join(text.split())
    for kind, form in SENTENCES.items():
        found = form.fullmatch(said)
        if found is not None:
            known = {key: value for key, value in found.groupdict().items() if value}
            return {"kind": kind, **known}
    raise InputError(f"{as_written(text)} is no news that is understood; write {FORMS}")


def heard(line: Mapping[str, Any], setting: Setting) -> Heard:
    """Return what a line of news means.

    Raises
    ------
    InputError
        If it means nothing; the text names the key and the remedy.
    """
    kind = line.get("kind")
    if not isinstance(kind, str) or kind not in KEYS:
        hint = suggestion(str(kind), KEYS)
        raise InputError(f"kind: {as_written(kind)} is no kind of news; {hint}")
    unknown = sorted({*line} - KEYS[kind] - {"kind", "at"})
    if unknown:
        hint = suggestion(unknown[0], KEYS[kind])
        raise InputError(f"{unknown[0]}: is no key of news of kind {kind}; {hint}")
    return _Line(line, setting).meant(kind)


class _Line:
    """One line of news, key by key."""

    def __init__(self, line: Mapping[str, Any], setting: Setting) -> None:
        self._line, self._setting, self._said = line, setting, Said(line, setting)

    def meant(self, kind: str) -> Heard:
        match kind:
            case "delay":
                lasts_s = self._said.span("lasts")
                return self._of_uav({"late_s": lasts_s}, f"has stood still for {lasts_s:g} s")
            case "uav":
                return self._uav()
            case "lost":
                return self._lost()
            case "joined":
                return self._joined()
            case "found":
                target = self._said.target()
                return self._news(kind, {"target": target}, f"found{self._said.called(target)}")
            case "searched":
                return self._searched()
        return self._of_place(kind)

    def _of_place(self, kind: str) -> Heard:
        place = self._said.place()
        radius_m = self._said.number("radius_m", STREET_M if place.edges else RADIUS_M)
        table: dict[str, Any] = {"radius_m": radius_m, "sure": self._said.share("sure")}
        if place.edges:
            table["edges"] = list(place.edges)
        else:
            table["place"] = {"x_m": round(place.x_m, 1), "y_m": round(place.y_m, 1)}
        name = told(place, self._setting.network)
        if kind == "nothing":
            table |= {"from_s": self._said.time("from"), "to_s": self._said.time("to")}
            return self._news(kind, table, f"nothing at {name}")
        if "sd_m" in self._line:
            table["sd_m"] = self._said.number("sd_m", 0.0)
            del table["radius_m"]
        table |= {"at_s": self._said.time("at"), "heard_s": self._setting.now_s}
        table["target"] = self._said.target()
        seen = f"seen at {name}, {percent(table['sure'], 0)} sure"
        told_of = self._news(kind, table, seen + self._said.called(table["target"]))
        again, insist = self._said.flag("same_source"), self._said.flag("insist")
        return replace(told_of, same_source=again, insist=insist)

    def _searched(self) -> Heard:
        table = {
            key: self._line[key]
            for key in ("waypoints", "sensor_on", "detects", "speed_mps")
            if key in self._line
        }
        table["radius_m"] = self._said.number("radius_m", 0.0)
        if "track" in self._line:
            table |= self._track(self._line["track"])
        return self._news("searched", table, f"searched, within {table['radius_m']:g} m")

    def _track(self, file: object) -> dict[str, Any]:
        """Return the flight that a file holds, as another aircraft recorded it."""
        setting = self._setting
        if not isinstance(file, str) or setting.reading is None:
            raise InputError("track: should be the path of a recorded flight; or give waypoints")
        track = flown(read_log(setting.folder / file), setting.network, setting.reading).track
        rows = np.stack([track.time_s, track.x_m, track.y_m], axis=1)
        return {"waypoints": rows.tolist(), "sensor_on": track.sensor_on.tolist()}

    def _uav(self) -> Heard:
        standing: dict[str, Any] = {}
        said = []
        if "place" in self._line:
            place = self._said.place(moved=False)
            standing["xy_m"] = (place.x_m, place.y_m)
            said.append(f"is at {told(place, self._setting.network)}")
        if "battery" in self._line:
            standing["left_s"] = self._said.span("battery")
            said.append(f"has a battery for {standing['left_s']:g} s")
        if not standing:
            raise InputError("uav: says neither its place nor its battery; give one of them")
        return self._of_uav(standing, " and ".join(said))

    def _lost(self) -> Heard:
        if "uav" not in self._line:
            raise InputError("uav: is missing; say which UAV is lost, as uav 2")
        lost_s = self._said.time("at") if "at" in self._line else self._setting.now_s
        self._refuse_later("at", lost_s)
        return self._of_uav({"lost_s": lost_s}, f"lost at {clock(lost_s)}")

    def _joined(self) -> Heard:
        place = self._said.place(moved=False)
        ready_s = self._said.time("ready") if "ready" in self._line else self._setting.now_s
        table = {key: self._line[key] for key in {*self._line} & UAV_KEYS}
        table["start"] = {"x_m": place.x_m, "y_m": place.y_m}
        if "battery" in self._line:
            table["max_flight_time_s"] = self._said.span("battery")
        said = f"one more UAV joins from {told(place, self._setting.network)} at {clock(ready_s)}"
        return Heard(standing={"joined": (Joined(ready_s, table),)}, said=(said,))

    def _of_uav(self, standing: Mapping[str, Any], said: str) -> Heard:
        """Return what is said of the UAV that is named, or of the only one."""
        if "uav" not in self._line:
            return Heard(standing=standing, said=(f"the UAV {said}",))
        found = UAV_NAME.fullmatch(str(self._line["uav"]).strip())
        if found is None:
            text = as_written(self._line["uav"])
            raise InputError(f"uav: {text} is no UAV; they are counted from 1: write 2, or uav 2")
        number = int(found[1])
        return Heard(standing={"uavs": {number - 1: standing}}, said=(f"UAV {number} {said}",))

    def _news(self, kind: str, table: Mapping[str, Any], said: str) -> Heard:
        section, errors = KINDS[kind].checked({"kind": kind, **table})
        if errors:
            fault = next(iter(faults_of("", KINDS[kind], errors)))
            key = fault.key.removeprefix(".")
            raise InputError(f"{key}: {fault.text}" if key else fault.text)
        one: Any = section
        faults = [*target_faults([one], len(self._setting.targets))]
        if faults:
            raise InputError(f"target: {faults[0].text}")
        self._refuse_from_the_future(one)
        return Heard(news=(one,), said=(said,))

    def _refuse_from_the_future(self, one: Any) -> None:
        """Do nothing if news is of what has been, by clocks that agree as clocks do."""
        match one:
            case ReportNews():
                key, last_s = "at", one.at_s
            case NothingNews():
                key, last_s = "to", one.to_s
            case SearchedNews():
                key, last_s = "waypoints", one.waypoints[-1][0]
            case _:
                return
        self._refuse_later(key, last_s)

    def _refuse_later(self, key: str, last_s: float) -> None:
        now_s = self._setting.now_s
        if last_s > now_s + CLOCKS_S:
            raise InputError(
                f"{key}: {clock(last_s)} is still to come, as it is {clock(now_s)} now; give when "
                "it was"
            )
