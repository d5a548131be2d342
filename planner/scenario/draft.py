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
    futures: FuturesSection | None
    search: SearchSection | None
    greedy: GreedySection | None
    news: NewsSection | None
    truth_keys: frozenset[str]  # what the file says about the truth alone
    faults: tuple[Fault, ...]

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
        scenario = Scenario(path=self.path, title=self.title, **sections)
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
    if source.parsed:
        for key, model in SECTIONS.items():
            sections[key], errors = model.attempt(tables[key])
            found = [*faults_of(key, model, errors)]
            found += _own_faults(key, sections[key], source.folder, sound=not errors)
            if model is TargetSection:
                found = [one for one in found if not inherited(tables[key], one, key)]
            # What the truth shares with the target is reported there.
            faults += checks.faults_of_fields(found, key, truth) if key == "truth" else found
        faults += _joint_faults(sections, faults)
    return Draft(
        path=source.path,
        title=title,
        truth_keys=frozenset(truth),
        faults=tuple(faults),
        **sections,
    )


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
    if isinstance(tables["uav"], dict) and not source.of_run:
        net = tables["network"]
        abstract = isinstance(net, dict) and net.get("abstract") is True
        tables["uav"] = aircraft_written_out(
            tables["uav"], source.folder, faults, abstract=abstract
        )
    return str(title), tables, truth


def _own_faults(key: str, section: Section | None, folder: Path, *, sound: bool) -> list[Fault]:
    if isinstance(section, NetworkSection):
        # A source that is there but faulty is not one that is missing.
        choice = checks.source_faults(section) if sound else ()
        return [*choice, *checks.missing_files(section, folder)]
    if isinstance(section, AirspaceSection):
        return list(checks.missing_areas(section, folder))
    if isinstance(section, TargetSection):
        return list(target_faults(key, section, folder))
    if isinstance(section, UavSection):
        return list(checks.uav_faults(section)) if sound else []  # a faulty key is not missing
    return []


def _joint_faults(sections: Mapping[str, Any], faults: Sequence[Fault]) -> list[Fault]:
    """Return what sections disagree on, where the keys that it depends on are themselves sound."""
    target, uav, search = (sections[key] for key in ("target", "uav", "search"))
    found: list[Fault] = []
    truth = sections["truth"]
    if target and truth and not _any_about(faults, "target.sighted_at", "truth.sighted_at"):
        found += checks.clock_faults(target, truth)
    if target and uav and search and not _any_about(faults, *checks.HORIZON_KEYS):
        found += checks.horizon_faults(target, uav, search)
    if target and search and not _any_about(faults, *checks.SAMPLING_KEYS):
        found += sampling_faults(target, search)
    greedy = sections["greedy"]
    if greedy and search and not _any_about(faults, "greedy.tick_s", "search.horizon_s"):
        found += checks.tick_faults(search, greedy)
    return found


def _any_about(faults: Sequence[Fault], *keys: str) -> bool:
    return any(fault.is_about(*keys) for fault in faults)
