"""Checks across the sections of a scenario, beyond the type of each value."""

from collections.abc import Container, Iterable, Iterator
from pathlib import Path, PurePosixPath

from planner.errors import Fault
from planner.messages import as_written
from planner.scenario.sections import (
    OF_SUMO,
    AirspaceSection,
    GreedySection,
    NetworkSection,
    Scenario,
    SearchSection,
    TargetSection,
    UavSection,
)
from planner.scenario.values import probability_fault

# The keys that checks across sections depend on.
HORIZON_KEYS = (
    "target.last_seen_window_s",
    "target.last_seen_ago_s",
    "uav.take_off_s",
    "search.horizon_s",
    "search.planning_time_s",
    "search.objective",
    "search.by_s",
)
SAMPLING_KEYS = (
    "target.start",
    "target.goes",
    "target.distance_m",
    "target.speed",
    "search.sampling",
)
MOST_TICKS = 10_000_000  # to the horizon
LONGEST_TITLE = 500  # characters
MUCH_FASTER = 3.0  # times the target's speed; below, the paper's assumption is in doubt


def source_faults(section: NetworkSection) -> Iterator[Fault]:
    """Yield what is wrong with the choice of sources for the network."""
    named = section.files
    given: list[str] = [key for key in ("net", "osm") if key in named]
    if "nodes" in named or "edges" in named:
        given.append("nodes and edges")
    if len(given) != 1:
        sources = " and ".join(given) or "no source"
        remedy = "write either nodes and edges, or net, or osm"
        yield Fault("network", f"gives {sources}; {remedy}")
    elif given == ["nodes and edges"]:
        for key in sorted({"nodes", "edges"} - set(named)):
            text = "is missing; give the path of the other plain-XML file"
            yield Fault(f"network.{key}", text)
    else:
        for key in ("connections", "signals", "abstract"):
            if getattr(section, key):
                yield Fault(f"network.{key}", "goes with nodes and edges only; leave it out")
    if section.abstract and section.road_tolerance_m:
        text = "the roads of an abstract net are its edges; leave it out"
        yield Fault("network.road_tolerance_m", text)


def missing_files(section: NetworkSection, folder: Path) -> Iterator[Fault]:
    """Yield the network's sources that are not there; those that come with SUMO are not sought."""
    for key, name in section.files.items():
        if key == "net" and name.startswith(OF_SUMO):
            if not _is_below(name.removeprefix(OF_SUMO)):
                text = f"{as_written(name)} does not stay within SUMO's folder; give the path"
                yield Fault(f"network.{key}", f"{text} below it, as sumo:tools/game/NET.net.xml")
        elif "\0" in name or not (folder / name).is_file():
            text = f"there is no file {folder / name}; correct the path"
            yield Fault(f"network.{key}", text)


def missing_areas(section: AirspaceSection, folder: Path) -> Iterator[Fault]:
    """Yield the files of an airspace that are not there."""
    for key, name in section.files.items():
        if "\0" in name or not (folder / name).is_file():
            yield Fault(f"airspace.{key}", f"there is no file {folder / name}; correct the path")


def _is_below(name: str) -> bool:
    """Return whether a path leads down from where it starts, and is read alike everywhere."""
    path = PurePosixPath(name)
    odd = "\0" in name or "\\" in name or ":" in name or name.startswith("/")
    return bool(path.parts) and not odd and ".." not in path.parts


def target_faults(key: str, section: TargetSection, folder: Path) -> Iterator[Fault]:
    """Yield what is wrong with the probabilities of a target, or a turn file that is missing."""
    if isinstance(section.start, dict):
        fault = probability_fault(list(section.start.values()))
        if fault:
            yield Fault(f"{key}.start", fault)
    elif not isinstance(section.start, str) and not isinstance(section.distance_m, str):
        yield Fault(
            f"{key}.distance_m",
            f"goes with whole edges only, but {key}.start says where on them; leave it out",
        )
    if section.goes not in (None, "turns"):
        yield from _going_faults(key, section)
    if isinstance(section.turning, dict):
        for edge, ways in section.turning.items():
            fault = probability_fault(list(ways.values()))
            if fault:
                yield Fault(f"{key}.turning.{edge}", fault)
    elif not isinstance(section.turning, str):
        path = folder / section.turning.file
        if "\0" in str(path) or not path.is_file():
            yield Fault(f"{key}.turning.file", f"there is no file {path}; correct the path")


def clock_faults(target: TargetSection, truth: TargetSection) -> Iterator[Fault]:
    """Yield the fault of a truth with a clock of its own: there is one."""
    if truth.sighted_at != target.sighted_at:
        text = "is the moment of time 0 for all; write it as target.sighted_at"
        yield Fault("truth.sighted_at", text)


def _going_faults(key: str, section: TargetSection) -> Iterator[Fault]:
    """Yield the keys that mean nothing for a target that goes somewhere."""
    if section.turning != "equal":
        text = f"goes with turns by chance, but {key}.goes says where to; leave one of them out"
        yield Fault(f"{key}.turning", text)
    if section.speed_drawn == "per road":
        text = f'"per road" goes with turns by chance, not with {key}.goes; write "once"'
        yield Fault(f"{key}.speed_drawn", text)


def horizon_faults(
    target: TargetSection, uav: UavSection, search: SearchSection
) -> Iterator[Fault]:
    """Yield the fault of a horizon or a deadline that leaves no time to search."""
    take_off_s = target.last_seen_ago_s + uav.take_off_s + search.planning_time_s
    window_s = target.last_seen_window_s or 0.0
    if window_s >= search.horizon_s:
        yield Fault(
            "target.last_seen_window_s",
            f"{as_written(window_s)} s does not end before search.horizon_s, "
            f"{as_written(search.horizon_s)} s; choose a shorter one",
        )
    if search.horizon_s <= take_off_s:
        yield Fault(
            "search.horizon_s",
            f"{as_written(search.horizon_s)} is not after take-off at "
            f"{as_written(take_off_s)} s (target.last_seen_ago_s + uav.take_off_s + "
            "search.planning_time_s); choose a later horizon",
        )
    elif search.objective == "probability" and search.by_s is None:
        text = 'is missing; objective = "probability" needs the time to find it by'
        yield Fault("search.by_s", text)
    elif search.by_s is not None and not take_off_s < search.by_s <= search.horizon_s:
        yield Fault(
            "search.by_s",
            f"{as_written(search.by_s)} is not between take-off at {as_written(take_off_s)} s "
            f"and the horizon, {as_written(search.horizon_s)} s; choose a time in between",
        )


def sampling_faults(target: TargetSection, search: SearchSection) -> Iterator[Fault]:
    """Yield the distributions that have too many values for all of them to be taken."""
    if search.sampling != "all":
        return
    if not isinstance(target.start, str | dict):
        yield Fault(
            "target.start",
            'stretches have endlessly many places, but search.sampling is "all"; write a table of '
            'edges, or search.sampling = "sobol"',
        )
    if target.goes not in (None, "turns"):
        yield Fault(
            "target.goes",
            'has endlessly many routes, but search.sampling is "all"; leave it out, or write '
            'search.sampling = "sobol"',
        )
    if target.last_seen_window_s:
        yield Fault(
            "target.last_seen_window_s",
            'has many seconds, but search.sampling is "all"; leave it out, or write '
            'search.sampling = "sobol"',
        )
    for name in ("distance_m", "speed_mps"):
        numbers = getattr(target, name)
        form = numbers if isinstance(numbers, str) else numbers.form
        if form not in ("list", "constant"):
            yield Fault(
                f"target.{name}",
                f'{form} has endlessly many values, but search.sampling is "all"; '
                'write { list = [...] } or { constant = x }, or search.sampling = "sobol"',
            )
    if target.speed_drawn == "per road" and target.speed_mps.form != "constant":
        yield Fault(
            "target.speed_drawn",
            '"per road" makes endlessly many combinations, but '
            'search.sampling is "all"; write "once", or search.sampling = "sobol"',
        )


def tick_faults(search: SearchSection, greedy: GreedySection) -> Iterator[Fault]:
    """Yield the fault of a tick so short that there are too many to the horizon."""
    if greedy.tick_s and search.horizon_s / greedy.tick_s > MOST_TICKS:
        yield Fault(
            "greedy.tick_s",
            f"{as_written(greedy.tick_s)} s makes more than {MOST_TICKS:,} ticks to the horizon; "
            "choose a longer one, or 0 for continuous time",
        )


def slow_uav_warning(scenario: Scenario) -> str | None:
    """Return a warning where the UAV is not much faster than the target, else None."""
    uav = scenario.uav
    fastest_mps = max(scenario.target.speed_mps.high, scenario.truth.speed_mps.high)
    if uav.speed_mps >= MUCH_FASTER * fastest_mps:
        return None
    return (
        f"uav.speed_mps: {as_written(uav.speed_mps)} m/s is less than {MUCH_FASTER:g} times the "
        f"fastest target ({as_written(fastest_mps)} m/s); "
        "the method assumes a UAV that is much faster"
    )


def faults_of_fields(
    faults: Iterable[Fault], section: str, names: Container[str]
) -> Iterator[Fault]:
    """Yield the faults of a section that are about some of its fields."""
    return (fault for fault in faults if fault.field_of(section) in names)
