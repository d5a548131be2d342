"""From a scenario's file to a `Scenario`, or to all of its faults at once.

Nothing here opens a network: what needs one is checked by `planner.mission.opening`, which starts
from the `Draft` made here, so that all faults of a scenario are reported together.
"""

import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from planner.errors import Fault, ScenarioError
from planner.messages import as_written, suggestion
from planner.scenario import checks
from planner.scenario.aircraft_file import aircraft_written_out
from planner.scenario.faults import faults_of
from planner.scenario.fleet import with_heights
from planner.scenario.listed import keys_of, listed, named_for
from planner.scenario.news import NewsSection
from planner.scenario.profiles import inherited
from planner.scenario.sections import (
    SECTIONS,
    AirspaceSection,
    FuturesSection,
    GreedySection,
    NetworkSection,
    Scenario,
    SearchSection,
    SensorSection,
)
from planner.scenario.source import Source, read_source
from planner.scenario.target import TargetSection
from planner.scenario.target_checks import (
    count_faults,
    sampling_faults,
    shared_faults,
    target_faults,
)
from planner.scenario.target_tables import Said, said_of_targets
from planner.scenario.traffic import TrafficSection, driving_faults, traffic_faults
from planner.scenario.uav import UavSection
from planner.scenario.values import Section

AnySection = TypeVar("AnySection", bound=Section)

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
    other_targets: tuple[TargetSection, ...] = ()  # those beside the first, as far as tables
    other_truths: tuple[TargetSection, ...] = ()

    @property
    def targets(self) -> tuple[tuple[str, TargetSection], ...]:
        """What is known of each target that can be understood, by key."""
        return _by_key("target", self.target, self.other_targets)

    @property
    def truths(self) -> tuple[tuple[str, TargetSection], ...]:
        """What is true of each target that can be understood, by key."""
        return _by_key("truth", self.truth, self.other_truths)

    @property
    def uavs(self) -> tuple[tuple[str, UavSection], ...]:
        """All UAVs that can be understood, by key; all others are among the faults."""
        return _by_key("uav", self.uav, self.others)

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
        scenario = Scenario(
            path=self.path,
            title=self.title,
            others=self.others,
            other_targets=self.other_targets,
            other_truths=self.other_truths,
            **sections,
        )
        warning = checks.slow_uav_warning(scenario)
        if warning:
            log.log(logging.INFO if in_town else logging.WARNING, "%s", warning)
        return scenario


def _by_key(
    section: str, first: AnySection | None, others: Sequence[AnySection]
) -> tuple[tuple[str, AnySection], ...]:
    """Return all that can be understood of a section that may be there several times, by key."""
    known = ([] if first is None else [first]) + [*others]
    return tuple(zip(keys_of(section, len(known)), known, strict=True))


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
    title, tables, targets = _tables(source, faults)
    sections: dict[str, Any] = dict.fromkeys(SECTIONS)
    others: dict[str, list[Any]] = {"uav": [], "target": [], "truth": []}
    if source.parsed:
        for key, model in SECTIONS.items():
            if model is UavSection:
                (sections[key], *others[key]), found = _uavs(tables[key])
            elif model is TargetSection:
                (sections[key], *others[key]), found = _targets(key, targets, source.folder)
            else:
                sections[key], errors = model.attempt(tables[key])
                found = [*faults_of(key, model, errors)]
                found += _own_faults(sections[key], source.folder, sound=not errors)
            faults += found
        faults += _joint_faults(sections, others, faults)
    return Draft(
        path=source.path,
        title=title,
        truth_keys=frozenset(name for one in targets for name in one.alone),
        faults=tuple(faults),
        others=tuple(others["uav"]),
        other_targets=tuple(others["target"]),
        other_truths=tuple(others["truth"]),
        **sections,
    )


def _targets(section: str, said: Sequence[Said], folder: Path) -> tuple[list[Any], list[Fault]]:
    """Return what is known or true of each target, and the faults; as `_uavs` has it."""
    sections, faults = list[Any](), list[Fault]()
    for one in said:
        key, table = (one.key, one.known) if section == "target" else (one.truth_key, one.true)
        target, errors = TargetSection.attempt(table)
        sections.append(target)
        found = [*faults_of(key, TargetSection, errors)]
        if target is not None:
            found += target_faults(key, target, folder)
            found = [fault for fault in found if not inherited(table, fault, key)]
        # What the truth shares with the target is reported there.
        faults += found if section == "target" else checks.faults_of_fields(found, key, one.alone)
    known = [target for target in sections if target is not None]
    return known or [None], faults


def _uavs(said: Any) -> tuple[list[Any], list[Fault]]:
    """Return a section for each UAV, and their faults; None in place of one that is no table.

    Where there are several, those that are no tables are left out.
    """
    if said == []:
        return [None], [Fault("uav", "is an empty list; give a table for each UAV, or [uav]")]
    sections, faults = [], list[Fault]()
    for key, table in listed("uav", said):
        section, errors = UavSection.attempt(table)
        sections.append(section)
        faults += faults_of(key, UavSection, errors)
        if section is not None and not errors:  # a faulty key is not missing
            faults += named_for(key, checks.uav_faults(section))
    known = [section for section in sections if section is not None]
    if known and all(section.sorties == 0 for section in known):
        faults.append(Fault("uav.sorties", "is 0, and no UAV flies; leave it out, or give 1"))
    return known or [None], faults


def _tables(source: Source, faults: list[Fault]) -> tuple[str, dict[str, Any], list[Said]]:
    """Return the title, a table for each section, and what is said of each target."""
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
    targets = said_of_targets(tables["target"], tables["truth"], source.folder, faults)
    if not source.of_run:
        tables["uav"] = _with_aircraft(tables["uav"], tables["network"], source.folder, faults)
    return str(title), tables, targets


def _with_aircraft(said: Any, net: Any, folder: Path, faults: list[Fault]) -> Any:
    """Return what is said of the UAVs with the keys of their aircraft, each at a height."""
    abstract = isinstance(net, dict) and net.get("abstract") is True
    named, full = listed("uav", said), list[Any]()
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


def _own_faults(section: Section | None, folder: Path, *, sound: bool) -> list[Fault]:
    if isinstance(section, NetworkSection):
        # A source that is there but faulty is not one that is missing.
        choice = checks.source_faults(section) if sound else ()
        return [*choice, *checks.missing_files(section, folder)]
    if isinstance(section, AirspaceSection):
        return list(checks.missing_areas(section, folder))
    if isinstance(section, TrafficSection):
        return list(traffic_faults(section, folder)) if sound else []
    if isinstance(section, SensorSection):
        return list(checks.sensor_faults(section)) if sound else []
    return []


def _joint_faults(
    sections: Mapping[str, Any], others: Mapping[str, Sequence[Any]], faults: Sequence[Fault]
) -> list[Fault]:
    """Return what sections disagree on, where the keys that it depends on are themselves sound."""
    uav, search, traffic = (sections[key] for key in ("uav", "search", "traffic"))
    uavs = _by_key("uav", uav, others["uav"])
    targets = _by_key("target", sections["target"], others["target"])
    truths = _by_key("truth", sections["truth"], others["truth"])
    # What truths share with targets is reported there.
    found = [*shared_faults(targets)] or [*shared_faults(truths)]
    if search:
        found += count_faults(len(targets), search)
    if _any_about(faults, "target[", "truth["):
        targets = ()
    for (key, target), (truth_key, truth) in zip(targets, truths, strict=False):
        if not _any_about(faults, "target.sighted_at", "truth.sighted_at"):
            found += named_for(truth_key, checks.clock_faults(target, truth))
        if search and not _any_about(faults, "uav[", *checks.HORIZON_KEYS):
            for uav_key, one in uavs:
                wrong = named_for(uav_key, checks.horizon_faults(target, one, search))
                found += _of_target(key, wrong)
        if search and not _any_about(faults, *checks.SAMPLING_KEYS):
            found += named_for(key, sampling_faults(target, search))
        if traffic and not _any_about(faults, "traffic", *checks.DRIVING_KEYS):
            found += driving_faults(target.driving, truth.driving, traffic)
    found = list(dict.fromkeys(found))  # what is wrong for several is told once
    greedy = sections["greedy"]
    if greedy and search and not _any_about(faults, "greedy.tick_s", "search.horizon_s"):
        found += checks.tick_faults(search, greedy)
    return found


def _of_target(key: str, faults: Iterable[Fault]) -> Iterator[Fault]:
    """Yield faults, those of the target with its own key; others are the same for all targets."""
    for fault in faults:
        yield from named_for(key, [fault]) if fault.is_about("target.") else [fault]


def _any_about(faults: Sequence[Fault], *keys: str) -> bool:
    return any(fault.is_about(*keys) for fault in faults)
