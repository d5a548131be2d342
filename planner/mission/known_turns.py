"""The probabilities of turns that a target's section or its turn file gives, on a network."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from planner.belief.prior import TurnTable
from planner.belief.turn_file import read_turns
from planner.errors import Fault, InputError
from planner.messages import counted
from planner.network.road_network import RoadNetwork
from planner.network.street_names import no_edge
from planner.scenario.draft import Draft
from planner.scenario.target import TargetSection

LEAVES = "is an exit: a target that reaches its end has left the map (network.exits)"


def known_turns(
    key: str,
    target: TargetSection,
    network: RoadNetwork,
    draft: Draft,
    *,
    note: Callable[[str], None],
) -> tuple[TurnTable, list[Fault]]:
    """Return the probabilities given for turns, and what is wrong with them on this network.

    Parameters
    ----------
    note
        Is told what of a file is left out.
    """
    if isinstance(target.turning, str):
        return {}, []
    if isinstance(target.turning, dict):
        found = _turn_faults(target.turning, network)
        return target.turning, [Fault(f"{key}.turning.{turn}", text) for turn, text in found]
    path = draft.folder / target.turning.file
    key, named = f"{key}.turning.file", target.turning.file
    try:
        turns = read_turns(path, draft.search.horizon_s if draft.search else math.inf, note=note)
    except InputError as error:
        # A file that is not there has been reported already.
        there = "\0" not in named and path.is_file()
        return {}, [Fault(key, f"{named}: {error}")] if there else []
    turns = _for_cars(path, turns, network, note)
    wrong = _turn_faults(turns, network)
    return turns, [Fault(key, f"{named}: {turn}: {text}") for turn, text in wrong]


def _for_cars(
    path: Path, turns: TurnTable, network: RoadNetwork, note: Callable[[str], None]
) -> TurnTable:
    """Return the turns of a file without those of edges that are not for cars, as SUMO does."""
    closed = network.closed_edges
    exits = {network.edge_ids[edge] for edge in np.flatnonzero(network.edge_exit)}
    kept = {
        start: {end: share for end, share in ways.items() if end not in closed}
        for start, ways in turns.items()
        if start not in closed | exits
    }
    beyond = sum(len(ways) for start, ways in turns.items() if start in exits)
    left_out = sum(map(len, turns.values())) - sum(map(len, kept.values())) - beyond
    if left_out:
        note(f"{path}: left out: {counted(left_out, 'turn')} from or to edges not for cars")
    if beyond:
        note(f"{path}: left out: {counted(beyond, 'turn')} from exits of the map")
    # What led only to such edges is no sink, but an edge of which nothing is known.
    return {
        start: ways for start, ways in kept.items() if not turns[start] or sum(ways.values()) > 0
    }


def _turn_faults(turns: TurnTable, network: RoadNetwork) -> Iterator[tuple[str, str]]:
    """Yield each turn that the network does not have, as an edge or a pair, and what is wrong."""
    for start, ways in turns.items():
        if start not in network.edge_index:
            yield start, no_edge(start, network)
            continue
        edge = network.edge_index[start]
        possible = [network.edge_ids[end] for end in network.turns(edge, back=True)]
        for end in ways:
            if network.edge_exit[edge]:
                yield f"{start}.{end}", f"{start} {LEAVES}; leave its turns out"
            elif end not in network.edge_index:
                yield f"{start}.{end}", no_edge(end, network)
            elif end not in possible and ways[end] > 0:
                leads = f"it leads to {', '.join(possible)}" if possible else "it has no way on"
                yield f"{start}.{end}", f"{start} does not lead to {end}; {leads}"
