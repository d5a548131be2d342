"""A call: what somebody says who rings, in words, as a scenario that can be planned.

Every word is echoed as it was understood, and all that are not are refused together.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from planner.errors import Fault, InputError, ScenarioError
from planner.messages import as_written, plain, suggestion
from planner.mission.call_net import at_home, net_of
from planner.mission.call_places import drone_site, last_seen
from planner.mission.call_settings import OPTION, key_of, settled
from planner.mission.call_times import aircraft, times
from planner.mission.call_words import Faults, Words
from planner.network.road_network import RoadNetwork
from planner.scenario.profiles import shipped_profiles
from planner.scenario.source import Tables
from planner.scenario.toml_text import toml_text

SENSOR_M = 60.0  # how far the sensor sees, where the net's scenario does not say
PARTICLES, WORK, SEED = 1000, 80_000, 1
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
    faults = Faults()
    call = _heard(words, now.replace(microsecond=0), tables, network, faults)
    if faults.found or call is None:
        raise ScenarioError(words.net, faults.found)
    found = settled(call.tables, words.settings, SAID, tables.get("traffic"))
    if found.faults:
        raise ScenarioError(words.net, found.faults)
    return replace(call, tables=found.tables, understood=(*call.understood, *found.said))


def as_said(fault: Fault, call: Call, site: int = 0) -> Fault:
    """Return the fault of a call's scenario as one of the word that its key comes from.

    The key stays beside it where the word named a file, which has keys.

    Parameters
    ----------
    site
        From which of the places the drone takes off in that scenario.
    """
    if any(fault.is_about(key_of(setting)) for setting in call.words.settings):
        return replace(fault, key=f"{OPTION} {fault.key}")
    option = next((word for key, word in OPTIONS.items() if fault.is_about(key)), None)
    files = {"--target": call.tables["target"]["profile"], "--aircraft": call.words.aircraft}
    if option is None:
        return fault
    if option == "--drone-at" and len(call.sites) > 1:
        return replace(fault, key=f"{option} {as_written(call.words.drone_at[site])}")
    in_file = str(files.get(option)).endswith(".toml")
    return replace(fault, key=f"{option} ({fault.key})" if in_file else option)


def _heard(
    words: Words, now: datetime, tables: Tables, network: RoadNetwork, faults: Faults
) -> Call | None:
    """Return the call, None if a word that it cannot do without is missing."""
    profile = faults.tried("--target", lambda: _profile(words.target))
    seen = last_seen(words, network, faults)
    sites = [drone_site(text, network, faults) for text in words.drone_at]
    flies = aircraft(words, faults)
    timed = times(words, now, {} if flies is None else flies.keys, faults)
    known = [site for site in sites if site is not None]
    if faults.found or not known:
        return None
    assert profile is not None
    assert seen is not None
    assert flies is not None
    assert timed is not None
    goes, why = at_home(profile, network)
    sighted = now - timedelta(seconds=timed.ago_s)
    sections = {
        "network": tables["network"],
        "target": {
            "profile": profile,
            **goes,
            "start": seen.start,
            "driving": "free",
            "last_seen_ago_s": timed.ago_s,
            "sighted_at": sighted.isoformat(),
        },
        "uav": {
            "start": known[0].start,
            "take_off_s": timed.ready_s,
            **flies.keys,
            "return_to": "start",
        },
        "sensor": tables.get("sensor", {"radius_m": SENSOR_M}),
        **{key: tables[key] for key in ("airspace",) if key in tables},
        "search": {
            "horizon_s": timed.horizon_s,
            "particles": PARTICLES,
            "sampling": "sobol",
            "work": WORK,
            "seed": SEED,
        },
    }
    said = (
        ("last seen", seen.said),
        ("seen at", timed.at),
        ("target", f"{profile}; {why}" if why else profile),
        *(("drone at", site.said) for site in known),
        ("aircraft", flies.said),
        ("ready", timed.ready),
        ("until", timed.until),
    )
    starts, names = tuple(site.start for site in known), tuple(site.called for site in known)
    return Call(sections, starts, names, words, said, f"last seen {seen.called}", now)


def _profile(name: str) -> str:
    if name in shipped_profiles():
        return name
    if name.endswith(".toml") and Path(name).is_file():
        return Path(name).resolve().as_posix()
    hint = suggestion(name, shipped_profiles())
    raise InputError(f"{as_written(name)} is neither a profile nor a .toml file; {hint}")
