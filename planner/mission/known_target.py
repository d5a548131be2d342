"""What the network and files say of a target's start, or what is wrong with it there."""

import logging
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path

from planner.arrays import Floats
from planner.belief.goals import Goals, goals_of, places_of, reached_from
from planner.belief.prior import Known, start_probability
from planner.belief.starts import stretches_of
from planner.belief.stretches import Stretches
from planner.belief.ways import can_reach
from planner.belief.zone_file import read_zone
from planner.errors import Fault, InputError
from planner.messages import as_written
from planner.network.road_network import RoadNetwork
from planner.network.street_names import no_edge
from planner.scenario.target import TargetSection
from planner.scenario.target_values import Goal, StretchStart, TazStart

log = logging.getLogger(__name__)

TOLERANCE_M = 0.01  # lengths in net files have two decimals
TINY = 1e-9  # of the probability
SHOWN = 3  # edges that a message names


def known_target(
    key: str, target: TargetSection, network: RoadNetwork, folder: Path
) -> tuple[Known, list[Fault]]:
    """Return what is looked up for a target, and what is wrong with it on this network.

    Parameters
    ----------
    key
        Under which faults are reported.
    folder
        Where the scenario's paths start.
    """
    found: list[Fault] = []
    stretches = _stretches(key, target, network, folder, found)
    goals = _goals(key, target, network, folder, found)
    if goals is None or found:
        return Known(stretches=stretches), found
    reach = reached_from(goals, network)
    start = start_probability(target, network, stretches)
    if not start[reach].any():
        text = "none of the starts leads there; correct it, or target.start"
        return Known(), [Fault(f"{key}.goes", text)]
    lost = float(start[~reach].sum())
    if lost > TINY and target.start != "anywhere":
        log.warning(
            "%s.goes: %.3g %% of the starts, by probability, do not lead there and are left out",
            key,
            100.0 * lost,
        )
    if isinstance(target.goes, tuple):
        found += _goal_faults(f"{key}.goes", target.goes, network, folder, start)
    return Known(stretches=stretches, goals=goals, reach=reach), found


def _goals(
    key: str, target: TargetSection, network: RoadNetwork, folder: Path, found: list[Fault]
) -> Goals | None:
    listed = target.goes if isinstance(target.goes, tuple) else ()
    unknown = [
        Fault(f"{key}.goes[{i}].edge", f"{goal.edge} {no_edge(goal.edge, network)}")
        for i, goal in enumerate(listed)
        if goal.edge is not None and goal.edge not in network.edge_index
    ]
    found += unknown
    if unknown:
        return None
    for i, goal in enumerate(listed):
        try:
            if goal.taz is not None:
                zone = read_zone(folder / (goal.file or ""), goal.taz)
                _tell_unknown(f"{key}.goes[{i}]", goal.taz, zone.goals, network)
            places_of(goal, network, folder)
        except InputError as error:
            found.append(Fault(f"{key}.goes[{i}]", str(error)))
            return None
    try:
        return goals_of(target.goes, network, folder)
    except InputError as error:
        found.append(Fault(f"{key}.goes", str(error)))
        return None


def _tell_unknown(key: str, taz: str, edges: Collection[str], network: RoadNetwork) -> None:
    """Say which edges of a zone the net does not have; those that are not for cars it does."""
    known = network.edge_index.keys() | network.closed_edges
    unknown = [name for name in edges if name not in known]
    if unknown:
        log.warning(
            "%s: %d of the %d edges of the taz %s are not in the net, and left out (%s%s)",
            key,
            len(unknown),
            len(edges),
            taz,
            ", ".join(unknown[:SHOWN]),
            ", ..." if len(unknown) > SHOWN else "",
        )


def _goal_faults(
    key: str, goals: tuple[Goal, ...], network: RoadNetwork, folder: Path, start: Floats
) -> Iterator[Fault]:
    """Yield the goals that no start leads to; of those that only some do, the log tells."""
    for i, goal in enumerate(goals):
        reach = can_reach(network, places_of(goal, network, folder).edge)
        lost = float(start[~reach].sum() / start.sum())
        if not start[reach].any():
            text = "cannot be reached from any start; leave it out, or correct it"
            yield Fault(f"{key}[{i}]", text)
        elif lost > TINY:
            log.warning(
                "%s[%d]: %.3g %% of the starts, by probability, do not lead there; who starts "
                "there goes elsewhere",
                key,
                i,
                100.0 * lost,
            )


def _stretches(
    key: str, target: TargetSection, network: RoadNetwork, folder: Path, found: list[Fault]
) -> Stretches | None:
    if isinstance(target.start, tuple):
        wrong = list(_stretch_faults(f"{key}.start", target.start, network))
        if wrong:
            found += wrong
            return None
    try:
        if isinstance(target.start, TazStart):
            zone = read_zone(folder / target.start.file, target.start.taz)
            _tell_unknown(f"{key}.start", target.start.taz, zone.starts, network)
        return stretches_of(target.start, network, folder)
    except InputError as error:
        found.append(Fault(f"{key}.start", str(error)))
        return None


def _stretch_faults(
    key: str, stretches: tuple[StretchStart, ...], network: RoadNetwork
) -> Iterator[Fault]:
    for i, stretch in enumerate(stretches):
        if stretch.edge not in network.edge_index:
            text = f"{stretch.edge} {no_edge(stretch.edge, network)}"
            yield Fault(f"{key}[{i}].edge", text)
            continue
        edge = network.edge_index[stretch.edge]
        length_m = float(network.edge_length_m[edge])
        reaches_m = max(stretch.from_m, stretch.to_m or 0.0)
        if len(network.turns(edge)) == 0:
            text = f"{stretch.edge} has no way on; choose an edge that leads to another one"
            yield Fault(f"{key}[{i}].edge", text)
        elif reaches_m > length_m + TOLERANCE_M or stretch.from_m >= length_m:
            last = "from_m" if stretch.to_m is None else "to_m"
            yield Fault(
                f"{key}[{i}].{last}",
                f"{as_written(reaches_m)} is beyond the end of {stretch.edge}, which is "
                f"{as_written(length_m)} m long; stay within it",
            )


def told_once(faults: Iterable[Fault]) -> Iterator[Fault]:
    """Yield faults, of those that components of a mixture share the first one only."""
    told: set[tuple[str, str]] = set()
    for fault in faults:
        component, _, field = fault.key.partition("].")
        same = (field if ".mix[" in component else fault.key, fault.text)
        if same not in told:
            told.add(same)
            yield fault
