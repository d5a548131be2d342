"""Edges that files name, as edges of a network."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from planner.arrays import Ints
from planner.errors import InputError
from planner.futures.futures import NO_EDGE
from planner.network.road_network import RoadNetwork
from planner.parquet import Coded

NOT_FOR_CARS = -2  # in the place of an edge, while a file is read


def edges_of(path: Path, names: Coded, network: RoadNetwork) -> Ints:
    """Return the edge of each name, (values,): its index, or NOT_FOR_CARS; NO_EDGE if not used.

    The inside of a junction, whose name begins with a colon, is NO_EDGE.

    Raises
    ------
    InputError
        If a name is not that of an edge in the network's file.
    """
    index = np.array([network.edge_index.get(name, NO_EDGE) for name in names.values], np.int32)
    others = [k for k in np.flatnonzero(index == NO_EDGE) if not names.values[k].startswith(":")]
    if others:
        used = np.bincount(names.code[names.code >= 0], minlength=len(index)) > 0
        others = [k for k in others if used[k]]
        _refuse_unknown(path, [names.values[k] for k in others], network)
        index[others] = NOT_FOR_CARS
    return index


def _refuse_unknown(path: Path, names: Sequence[str], network: RoadNetwork) -> None:
    unknown = sorted(set(names).difference(network.closed_edges))
    if unknown:
        more = f" (nor are {len(unknown) - 1} others)" if len(unknown) > 1 else ""
        raise InputError(
            f"{path}: edge {unknown[0]!r} is not in the scenario's net{more}; give the net that "
            "the file was recorded on"
        )
