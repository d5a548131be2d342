"""From a scenario's file to a `Scenario`, or to all of its faults at once.

Nothing here opens a network: what needs one is checked by `planner.mission.opening`, which starts
from the `Draft` made here, so that all faults of a scenario are reported together.
"""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner.errors import Fault, ScenarioError
from planner.messages import as_written, suggestion
from planner.scenario import checks
from planner.scenario.aircraft_file import aircraft_written_out
from planner.scenario.faults import faults_of
from planner.scenario.fleet import named_for, uav_tables, with_heights
from planner.scenario.news import NewsSection
from planner.scenario.profiles import inherited, written_out
from planner.scenario.sections import (
    SECTIONS,
    AirspaceSection,
    FuturesSection,
    GreedySection,
    NetworkSection,
    Scenario,
    SearchSection,
    SensorSection,
    TargetSection,
)
from planner.scenario.source import Source, read_source
from planner.scenario.target_checks import sampling_faults, target_faults
from planner.scenario.traffic import TrafficSection, driving_faults, traffic_faults
from planner.scenario.uav import UavSection
from planner.scenario.values import Section

GOING = ("profile", "goes", "turning")  # in [truth], in place of the target's mixture

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Draft:
    """A scenario as far as it can be understood, and its faults.

    A section that is faulty in some keys is there without them (a faulty start is "anywhere", or
    the UAV's the origin); it is None where it is no table.
    """

    path: Path
    title: str
    network: NetworkSection | None
    target: TargetSection | None
    truth: TargetSection | None
    uav: UavSection | None
    sensor: SensorSection | None
    airspace: AirspaceSection | None
    traffic: TrafficSection | None
    futures: FuturesSection | None
    search: SearchSection | None
    greedy: GreedySection | None
    news: NewsSection | None
    truth_keys: frozenset[str]  # what the file says about the truth alone
    faults: tuple[Fault, ...]
    others: tuple[UavSection, ...] = ()  # UAVs beside the first, as far as they are tables

    @property
    def uavs(self) -> tuple[tuple[str, UavSection], ...]:
        """All UAVs that can be understood, by key; all others are among the faults."""
        known = ([] if self.uav is None else [self.uav]) + [*self.others]
        names = [f"uav[{number}]" for number in range(len(known))] if self.others else ["uav"]
        return tuple(zip(names, known, strict=False))

    @property
    def folder(self) -> Path:
        """Where the scenario's relative paths start."""
        return self.path.parent

    def scenario(self, *, in_town: bool = False) -> Scenario:
        """Return the sound scenario; a UAV that is hardly faster than its target is logged.

        Parameters
        ----------
        in_town
            Whether that is usual, so that `planner check` alone tells it.

        Raises
        ------
        ScenarioError
            With all faults.
        """
        if self.faults:
            raise ScenarioError(str(self.path), self.faults)
        sections = {key: getattr(self, key) for key in SECTIONS}
        scenario = Scenario(path=self.path, title=self.title, others=self.others, **sections)
        warning = checks.slow_uav_warning(scenario)
        if warning:
            log.log(logging.INFO if in_town else logging.WARNING, "%s", warning)
        return scenario


def read_scenario(
    place: str | Path, *, preset: str | None = None, overrides: Sequence[str] = ()
) -> Scenario:
    """Return a sound scenario; see `read_draft`.

    Raises
    ------
    InputError
        If there is no such scenario.
    ScenarioError
        With all faults that can be found without the network.
    """
    return read_draft(place, preset=preset, overrides=overrides).scenario()


def read_draft(
    place: str | Path, *, preset: str | None = None, overrides: Sequence[str] = ()
) -> Draft:
    """Return what a scenario says, with a preset and then overrides applied, and its faults.

    Parameters
    ----------
    place
        A ``.toml`` file, a folder that holds ``scenario.toml``, the name of a shipped scenario, or
        the ``run.json`` of an earlier run, which stands for the scenario as that run had it.
    preset
        One of the scenario's ``[presets.NAME]``.
    overrides
        Such as ``uav.start.distance_m=120000`` or ``target.driving=free``.

    Raises
    ------
    InputError
        If there is no such scenario.
    """
    source = read_source(place, preset=preset, overrides=overrides)
    faults = list(source.faults)
    title, tables, truth = _tables(source, faults)
    sections: dict[str, Any] = dict.fromkeys(SECTIONS)
    others: list[UavSection] = []
    if source.parsed:
        for key, model in SECTIONS.items():
            if model is UavSection:
                (sections[key], *others), found = _uavs(tables[key])
                faults += found
                continue
            sections[key], errors = model.attempt(tables[key])
            found = [*faults_of(key, model, errors)]
            found += _own_faults(key, sections[key], source.folder, sound=not errors)
            if model is TargetSection:
                found = [one for one in found if not inherited(tables[key], one, key)]
            # What the truth shares with the target is reported there.
            faults += checks.faults_of_fields(found, key, truth) if key == "truth" else found
        faults += _joint_faults(sections, others, faults)
    return Draft(
        path=source.path,
        title=title,
        truth_keys=frozenset(truth),
        faults=tuple(faults),
        others=tuple(others),
        **sections,
    )


def _uavs(said: Any) -> tuple[list[Any], list[Fault]]:
    """Return a section for each UAV, and their faults; None in place of one that is no table.

    Where there are several, those that are no tables are left out.
    """
    if said == []:
        return [None], [Fault("uav", "is an empty list; give a table for each UAV, or [uav]")]
    sections, faults = [], list[Fault]()
    for key, table in uav_tables(said):
        section, errors = UavSection.attempt(table)
        sections.append(section)
        faults += faults_of(key, UavSection, errors)
        if section is not None and not errors:  # a faulty key is not missing
            faults += named_for(key, checks.uav_faults(section))
    known = [section for section in sections if section is not None]
    return known or [None], faults


def _tables(source: Source, faults: list[Fault]) -> tuple[str, dict[str, Any], Mapping[str, Any]]:
    """Return the title, a table for each section, and what is said about the truth alone."""
    tables = {key: source.tables.get(key, {}) for key in SECTIONS}
    title = source.tables.get("title", "")
    if not isinstance(title, str):
        text = f"should be text in quotes, not {as_written(title)}; give one line"
        faults.append(Fault("title", text))
    elif len(title) > checks.LONGEST_TITLE:
        text = f"has {len(title):,} characters; give one line of at most {checks.LONGEST_TITLE}"
        faults.append(Fault("title", text))
    known = [*SECTIONS, "title"]
    unknown = [key for key in source.tables if key not in known]
    faults += [
        Fault(key, f"is not a known section; {suggestion(key, known)}", unknown=True)
        for key in unknown
    ]
    truth = tables["truth"]
    if not isinstance(truth, dict):
        text = f"should be a table, not {as_written(truth)}; give keys as in [target]"
        faults.append(Fault("truth", text))
        truth = {}
    known_of_target = tables["target"] if isinstance(tables["target"], dict) else {}
    tables["truth"] = {**known_of_target, **truth}
    if "mix" not in truth and any(name in truth for name in GOING):
        tables["truth"].pop("mix", None)
    for key in ("target", "truth"):
        if isinstance(tables[key], dict):
            found: list[Fault] = []
            tables[key] = written_out(key, tables[key], source.folder, found)
            faults += checks.faults_of_fields(found, key, truth) if key == "truth" else found
    if "profile" in truth:
        truth = {**tables["truth"], **truth}
    if not source.of_run:
        tables["uav"] = _with_aircraft(tables["uav"], tables["network"], source.folder, faults)
    return str(title), tables, truth


def _with_aircraft(said: Any, net: Any, folder: Path, faults: list[Fault]) -> Any:
    """Return what is said of the UAVs with the keys of their aircraft, each at a height."""
    abstract = isinstance(net, dict) and net.get("abstract") is True
    named, full = uav_tables(said), []
    for key, table in named:
        found: list[Fault] = []
        if isinstance(table, dict):
            full.append(aircraft_written_out(table, folder, found, abstract=abstract))
        else:
            full.append(table)
        faults += named_for(key, found)
    if len(full) == 1:
        return full[0]
    usual_m = UavSection.model_fields["altitude_m"].default
    return with_heights([table for _, table in named], full, usual_m)


def _own_faults(key: str, section: Section | None, folder: Path, *, sound: bool) -> list[Fault]:
    if isinstance(section, NetworkSection):
        # A source that is there but faulty is not one that is missing.
        choice = checks.source_faults(section) if sound else ()
        return [*choice, *checks.missing_files(section, folder)]
    if isinstance(section, AirspaceSection):
        return list(checks.missing_areas(section, folder))
    if isinstance(section, TrafficSection):
        return list(traffic_faults(section, folder)) if sound else []
    if isinstance(section, TargetSection):
        return list(target_faults(key, section, folder))
    if isinstance(section, SensorSection):
        return list(checks.sensor_faults(section)) if sound else []
    return []


def _joint_faults(
    sections: Mapping[str, Any], others: Sequence[UavSection], faults: Sequence[Fault]
) -> list[Fault]:
    """Return what sections disagree on, where the keys that it depends on are themselves sound."""
    target, uav, search = (sections[key] for key in ("target", "uav", "search"))
    found: list[Fault] = []
    truth = sections["truth"]
    if target and truth and not _any_about(faults, "target.sighted_at", "truth.sighted_at"):
        found += checks.clock_faults(target, truth)
    if target and uav and search and not _any_about(faults, "uav[", *checks.HORIZON_KEYS):
        for number, one in enumerate([uav, *others]):
            key = f"uav[{number}]" if others else "uav"
            found += named_for(key, checks.horizon_faults(target, one, search))
        found = list(dict.fromkeys(found))  # what is wrong for several is told once
    if uav and all(one.sorties == 0 for one in [uav, *others]):
        found.append(Fault("uav.sorties", "is 0, and no UAV flies; leave it out, or give 1"))
    if target and search and not _any_about(faults, *checks.SAMPLING_KEYS):
        found += sampling_faults(target, search)
    traffic = sections["traffic"]
    if target and truth and traffic and not _any_about(faults, "traffic", *checks.DRIVING_KEYS):
        found += driving_faults(target.driving, truth.driving, traffic)
    greedy = sections["greedy"]
    if greedy and search and not _any_about(faults, "greedy.tick_s", "search.horizon_s"):
        found += checks.tick_faults(search, greedy)
    return found


def _any_about(faults: Sequence[Fault], *keys: str) -> bool:
    return any(fault.is_about(*keys) for fault in faults)
