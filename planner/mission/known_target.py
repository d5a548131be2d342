"""What the network and files say of a target's start, or what is wrong with it there."""

from collections.abc import Iterator
from pathlib import Path

from planner.belief.prior import Known
from planner.belief.starts import stretches_of
from planner.belief.stretches import Stretches
from planner.errors import Fault, InputError
from planner.messages import as_written, suggestion
from planner.network.road_network import RoadNetwork
from planner.scenario.sections import TargetSection
from planner.scenario.target_values import StretchStart

TOLERANCE_M = 0.01  # lengths in net files have two decimals


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
    return Known(stretches=stretches), found


def _stretches(
    key: str, target: TargetSection, network: RoadNetwork, folder: Path, found: list[Fault]
) -> Stretches | None:
    if isinstance(target.start, tuple):
        wrong = list(_stretch_faults(f"{key}.start", target.start, network))
        if wrong:
            found += wrong
            return None
    try:
        return stretches_of(target.start, network, folder)
    except InputError as error:
        found.append(Fault(f"{key}.start", str(error)))
        return None


def _stretch_faults(
    key: str, stretches: tuple[StretchStart, ...], network: RoadNetwork
) -> Iterator[Fault]:
    for i, stretch in enumerate(stretches):
        if stretch.edge not in network.edge_index:
            yield Fault(f"{key}[{i}].edge", no_edge(stretch.edge, network))
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


def no_edge(name: str, network: RoadNetwork) -> str:
    """Return what is wrong with a name that is none of an edge for cars, and the remedy."""
    if name in network.closed_edges:
        return f"{name} is not for cars; name an edge that a car may use"
    return f"{name} is not an edge of the network; {suggestion(name, network.edge_ids)}"
