"""What sections of a scenario have to agree on, beyond the type of each value."""

import math
from collections.abc import Container, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from planner.messages import shown

if TYPE_CHECKING:
    from planner.scenario.sections import (
        NetworkSection,
        SearchSection,
        TargetSection,
        UavSection,
    )
    from planner.scenario.values import DistributionSection

SUM_TOLERANCE = 1e-6  # three thirds written with seven digits are one
FARTHEST_SD = 6.0  # a cut normal farther out than this has hardly any probability left
# What the checks of two sections hang on.
HORIZON_KEYS = (
    "target.last_seen_ago_s",
    "uav.take_off_s",
    "search.horizon_s",
    "search.planning_time_s",
    "search.objective",
    "search.by_s",
)
SAMPLING_KEYS = ("target.distance_m", "target.speed", "search.sampling")
MUCH_FASTER = 3.0  # times the target's speed; below, the paper's assumption is in doubt


def probability_fault(probabilities: Sequence[float]) -> str | None:
    """Return what is wrong with probabilities that should sum to one, or None."""
    negative = [p for p in probabilities if p < 0]
    if negative:
        return f"the probability {shown(negative[0])} is negative; give numbers from 0 to 1"
    total = math.fsum(probabilities)
    if abs(total - 1) > SUM_TOLERANCE:
        return f"the probabilities sum to {shown(total)}, not to one; change them until they do"
    return None


def distribution_fault(section: "DistributionSection") -> str | None:
    """Return what is wrong with a distribution, or None."""
    given = [form for form in section.forms if getattr(section, form) is not None]
    if len(given) != 1:
        return (
            f"gives {' and '.join(given) or 'nothing'}; write exactly one of "
            "{ uniform = [low, high] }, { normal = ... }, { list = [...] }, { constant = x }"
        )
    if section.uniform is not None or section.normal is not None:
        return _range_fault(section)
    return _list_fault(section)


def _range_fault(section: "DistributionSection") -> str | None:
    low, high, normal = section.low, section.high, section.normal
    if not low < high:
        return (
            f"low {shown(low)} is not below high {shown(high)}; "
            "write the lower one first, or { constant = x } for a single value"
        )
    if section.probabilities is not None:
        return "gives probabilities without a list; add list = [...] or leave them out"
    if normal is not None:
        away = max(low - normal.mean, normal.mean - high) / normal.sd
        if away > FARTHEST_SD:
            return f"lies {away:.0f} sd from its mean; choose a mean nearer to low and high"
    return None


def _list_fault(section: "DistributionSection") -> str | None:
    if section.probabilities is None:
        return None
    if section.list is None:
        return "gives probabilities without a list; add list = [...] or leave them out"
    if len(section.list) != len(section.probabilities):
        return (
            f"has {len(section.list)} values but {len(section.probabilities)} probabilities; "
            "give one probability for each value"
        )
    return probability_fault(section.probabilities)


def source_faults(section: "NetworkSection") -> Iterator[str]:
    """Yield what is wrong with the choice of sources for the network."""
    named = section.files
    given: list[str] = [key for key in ("net", "osm") if key in named]
    if "nodes" in named or "edges" in named:
        given.append("nodes and edges")
    if len(given) != 1:
        yield (
            f"network: gives {' and '.join(given) or 'no source'}; "
            "write either nodes and edges, or net, or osm"
        )
    elif given == ["nodes and edges"]:
        for key in sorted({"nodes", "edges"} - set(named)):
            yield f"network.{key}: is missing; give the path of the other plain-XML file"
    else:
        for key in ("connections", "signals", "abstract"):
            if getattr(section, key):
                yield f"network.{key}: goes with nodes and edges only; leave it out"


def missing_files(section: "NetworkSection", folder: Path) -> Iterator[str]:
    """Yield the network's sources that are not there."""
    for key, name in section.files.items():
        if not (folder / name).is_file():
            yield f"network.{key}: there is no file {folder / name}; correct the path"


def target_faults(key: str, section: "TargetSection", folder: Path) -> Iterator[str]:
    """Yield what is wrong with the probabilities of a target, and a turn file not there."""
    if not isinstance(section.start, str):
        fault = probability_fault(list(section.start.values()))
        if fault:
            yield f"{key}.start: {fault}"
    if isinstance(section.turning, dict):
        for edge, ways in section.turning.items():
            fault = probability_fault(list(ways.values()))
            if fault:
                yield f"{key}.turning.{edge}: {fault}"
    elif not isinstance(section.turning, str):
        path = folder / section.turning.file
        if not path.is_file():
            yield f"{key}.turning.file: there is no file {path}; correct the path"


def horizon_faults(
    target: "TargetSection", uav: "UavSection", search: "SearchSection"
) -> Iterator[str]:
    """Yield what is wrong with a horizon or a deadline that leaves no time to search."""
    take_off_s = target.last_seen_ago_s + uav.take_off_s + search.planning_time_s
    if search.horizon_s <= take_off_s:
        yield (
            f"search.horizon_s: {shown(search.horizon_s)} is not after take-off at "
            f"{shown(take_off_s)} s (target.last_seen_ago_s + uav.take_off_s + "
            "search.planning_time_s); choose a later horizon"
        )
    elif search.objective == "probability" and search.by_s is None:
        yield 'search.by_s: is missing; objective = "probability" needs the time to find it by'
    elif search.by_s is not None and not take_off_s < search.by_s <= search.horizon_s:
        yield (
            f"search.by_s: {shown(search.by_s)} is not between take-off at {shown(take_off_s)} s "
            f"and the horizon, {shown(search.horizon_s)} s; choose a time in between"
        )


def sampling_faults(target: "TargetSection", search: "SearchSection") -> Iterator[str]:
    """Yield what cannot be taken all of."""
    if search.sampling != "all":
        return
    for name in ("distance_m", "speed_mps"):
        numbers = getattr(target, name)
        form = numbers if isinstance(numbers, str) else numbers.form
        if form not in ("list", "constant"):
            yield (
                f'target.{name}: {form} has endlessly many values, but search.sampling is "all"; '
                'write { list = [...] } or { constant = x }, or search.sampling = "sobol"'
            )
    if target.speed_drawn == "per road" and target.speed_mps.form != "constant":
        yield (
            'target.speed_drawn: "per road" makes endlessly many combinations, but '
            'search.sampling is "all"; write "once", or search.sampling = "sobol"'
        )


def slow_uav_warning(uav: "UavSection", fastest_mps: float) -> str | None:
    """Return a warning where the UAV is not much faster than the target, else None."""
    if uav.speed_mps >= MUCH_FASTER * fastest_mps:
        return None
    return (
        f"uav.speed_mps: {shown(uav.speed_mps)} m/s is less than {MUCH_FASTER:g} times the "
        f"fastest target ({shown(fastest_mps)} m/s); the method assumes a UAV that is much faster"
    )


def about(faults: Iterable[str], key: str, names: Container[str]) -> Iterator[str]:
    """Yield the faults of a section that concern some of its fields."""
    for fault in faults:
        name = fault.removeprefix(f"{key}.").partition(":")[0].partition(".")[0]
        if name.partition("[")[0] in names:
            yield fault
