"""Edges that files name, as edges of a network."""

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planner.arrays import Ints
from planner.errors import InputError
from planner.futures.edges_driven import NO_EDGE, EdgesDriven
from planner.network.road_network import RoadNetwork
from planner.parquet import Coded, read_table, seconds_column, texts

log = logging.getLogger(__name__)

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


def edge_column(path: Path, table: Any, network: RoadNetwork) -> Ints:
    """Return the edges in a table's column ``edge``, (K,), NO_EDGE where it holds none.

    Edges that are not for cars are none, with a line in the log.

    Raises
    ------
    InputError
        If there is no such column, or it names an edge that is not in the network.
    """
    names = texts(path, table, "edge")
    index = np.append(edges_of(path, names, network), NO_EDGE)
    for_others = np.flatnonzero(index == NOT_FOR_CARS)
    if len(for_others):
        log.warning(
            "%s: edge %r is not for cars (nor are %d others); taken as unknown",
            path,
            names.values[for_others[0]],
            len(for_others) - 1,
        )
        index[for_others] = NO_EDGE
    return np.asarray(index[names.code])


def read_edges_driven(path: Path, names: Sequence[str], network: RoadNetwork) -> EdgesDriven:
    """Return the table of changes in a file, for the particles of these names.

    Rows come in any order; those of other particles are left out.

    Raises
    ------
    InputError
        If the table is broken, does not belong to the network, or has a particle on two edges at
        one time.
    """
    table = read_table(path)
    number = {name: k for k, name in enumerate(names)}
    said = texts(path, table, "particle")
    particle = np.array([*(number.get(name, -1) for name in said.values), -1])[said.code]
    time_s, edge = seconds_column(path, table, "time_s"), edge_column(path, table, network)
    refuse_nobody(path, said)
    own = np.flatnonzero(particle >= 0)
    try:
        return EdgesDriven.of_rows(len(names), particle[own], time_s[own], edge[own])
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def refuse_nobody(path: Path, names: Coded) -> None:
    """Refuse a column of particles in which one has no name.

    Raises
    ------
    InputError
        With its row.
    """
    nobody = names.code < 0
    if nobody.any():
        row = int(np.argmax(nobody))
        raise InputError(f"{path}: column 'particle' holds no name (null) in row {row}; name it")


def _refuse_unknown(path: Path, names: Sequence[str], network: RoadNetwork) -> None:
    unknown = sorted(set(names).difference(network.closed_edges))
    if unknown:
        more = f" (nor are {len(unknown) - 1} others)" if len(unknown) > 1 else ""
        raise InputError(
            f"{path}: edge {unknown[0]!r} is not in the scenario's net{more}; give the net that "
            "the file was recorded on"
        )
