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
    SensorSection,
)
from planner.scenario.target import TargetSection
from planner.scenario.uav import UavSection

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
DRIVING_KEYS = ("target.driving", "truth.driving")
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


def clock_faults(target: TargetSection, truth: TargetSection) -> Iterator[Fault]:
    """Yield the fault of a truth with a clock of its own: there is one."""
    if truth.sighted_at != target.sighted_at:
        text = "is the moment of time 0 for all; write it as target.sighted_at"
        yield Fault("truth.sighted_at", text)


def uav_faults(uav: UavSection) -> Iterator[Fault]:
    """Yield what an aircraft cannot do with what is said of it."""
    if uav.corner_m is not None and uav.acceleration_mps2 is None:
        text = "says nothing without uav.acceleration_mps2; give both"
        yield Fault("uav.corner_m", text)
    if uav.acceleration_mps2 is not None and uav.corner_m is None:
        text = "says nothing without uav.corner_m; give both, such as corner_m = 2"
        yield Fault("uav.acceleration_mps2", text)
    if not uav.can_hover:
        for key in ("min_speed_mps", "acceleration_mps2"):
            if getattr(uav, key) is None:
                text = "is missing; an aircraft that cannot hover turns by it: give both, with"
                yield Fault(f"uav.{key}", f"{text} uav.corner_m")
    if uav.min_speed_mps is not None and uav.min_speed_mps > uav.speed_mps:
        text = f"is more than uav.speed_mps, {as_written(uav.speed_mps)} m/s; give a lower one"
        yield Fault("uav.min_speed_mps", f"{text}, or fly faster")
    if uav.wind is not None and uav.wind.speed_mps >= uav.speed_mps:
        text = f"is no slower than the UAV, {as_written(uav.speed_mps)} m/s, which drifts away"
        yield Fault("uav.wind.speed_mps", f"{text}; wait for less wind")
    if uav.reserve_s is not None and uav.max_flight_time_s is None:
        text = "is a part of uav.max_flight_time_s, which is not given; give both"
        yield Fault("uav.reserve_s", text)
    elif uav.max_flight_time_s is not None and uav.spent_s >= uav.max_flight_time_s:
        yield Fault(
            "uav.max_flight_time_s",
            f"{as_written(uav.max_flight_time_s)} s leaves no time to search: climb, descent and "
            f"reserve take {as_written(round(uav.spent_s, 1))} s; give a longer one",
        )
    yield from _sortie_faults(uav)


def _sortie_faults(uav: UavSection) -> Iterator[Fault]:
    if uav.sorties is not None and uav.sorties > 1:
        for key in ("return_to", "max_flight_time_s"):
            if getattr(uav, key) is None:
                yield Fault(f"uav.{key}", "is missing; a UAV with uav.sorties comes home: give it")
    elif uav.swap_s is not None:
        yield Fault("uav.swap_s", "says nothing without uav.sorties, 2 or more; give both")


def sensor_faults(sensor: SensorSection) -> Iterator[Fault]:
    """Yield what is wrong with how surely a sensor sees, and with what looks like the target."""
    if (sensor.lookalike is None) != (sensor.check_s is None):
        missing = "lookalike" if sensor.lookalike is None else "check_s"
        yield Fault(f"sensor.{missing}", "is missing; lookalike and check_s go together")
    width_m = sensor.sweep_width_m
    if width_m is None:
        return
    if sensor.detects is not None:
        yield Fault("sensor.sweep_width_m", "says what sensor.detects says; give one of them")
    if width_m > 2.0 * sensor.radius_m:
        text = f"is wider than the sensor sees, {as_written(2.0 * sensor.radius_m)} m"
        yield Fault("sensor.sweep_width_m", f"{text}; write less, or a greater radius_m")


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


def tick_faults(search: SearchSection, greedy: GreedySection) -> Iterator[Fault]:
    """Yield the fault of a tick so short that there are too many to the horizon."""
    if greedy.tick_s and search.horizon_s / greedy.tick_s > MOST_TICKS:
        yield Fault(
            "greedy.tick_s",
            f"{as_written(greedy.tick_s)} s makes more than {MOST_TICKS:,} ticks to the horizon; "
            "choose a longer one, or 0 for continuous time",
        )


def _fastest_mps(target: TargetSection) -> float:
    """Return the highest speed of a target, or of a component of its mixture."""
    return max(
        part.speed_mps.high * (part.flees.factor if part.flees else 1.0)
        for _, part in target.parts("target")
    )


def slow_uav_warning(scenario: Scenario) -> str | None:
    """Return a warning where the UAV is not much faster than the target, else None."""
    uav = scenario.uav
    fastest_mps = max(map(_fastest_mps, (*scenario.targets, *scenario.truths)))
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
