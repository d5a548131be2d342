"""``futures.parquet`` and ``particles.parquet`` as futures. Ids are names, whatever their type."""

import logging
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.errors import InputError
from planner.futures.edges import edge_column, read_edges_driven, refuse_nobody
from planner.futures.edges_driven import EdgesDriven
from planner.futures.fates import COLUMNS as FATES
from planner.futures.fates import Fates
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork
from planner.parquet import (
    column,
    metadata,
    numbers,
    numbers_or_nan,
    read_table,
    seconds_column,
    texts,
)

log = logging.getLogger(__name__)

TOTAL = 1e-9  # by how much weights may exceed one in all
MOST_TARGETS = 2**31 - 1


class NamedFutures(NamedTuple):
    """Futures with what is known of each particle."""

    futures: Futures
    names: tuple[str, ...]  # (N,)
    speed_mps: tuple[float, ...]  # (N,) on the first road; NaN where unknown
    route: tuple[str, ...]  # (N,) edge names with a space between; empty where unknown


class _Particles(NamedTuple):
    """Rows of ``particles.parquet``, put in the order of the knots."""

    weight: Floats  # (N,)
    gone: Any  # (N,) whether it vanishes at its end
    target: Ints  # (N,)
    speed_mps: tuple[float, ...]
    route: tuple[str, ...]
    fates: Fates | None


def futures_of_table(
    path: Path, table: Any, network: RoadNetwork, *, edges: Path | None, particles: Path | None
) -> NamedFutures:
    """Return the futures of a table of knots.

    Parameters
    ----------
    edges
        The file of the edges driven, for a table that has no column ``edge``; without one they
        are unknown.
    particles
        The file of the particles; without one all weigh the same and rest where they end.

    Raises
    ------
    InputError
        If a table is empty, broken, or does not belong to the other or to the network.
    """
    if table.num_rows == 0:
        raise InputError(f"{path}: holds no row; record at least one particle")
    recorded_on = metadata(path, table, "net_sha256")
    if recorded_on not in (None, network.sha256):
        raise InputError(
            f"{path}: was recorded on another network than {network.path}; record it again"
        )
    names, first_knot = _particles_of_rows(path, table)
    time_s = seconds_column(path, table, "time_s")
    _refuse_falling(path, time_s, first_knot, names)
    known = _equal(len(names)) if particles is None else _read_particles(particles, path, names)
    if "edge" in table.column_names:
        edge = edge_column(path, table, network)
        driven = EdgesDriven.of_knots(edge, time_s, first_knot)
    else:
        unknown = EdgesDriven.unknown(len(names))
        driven = unknown if edges is None else read_edges_driven(edges, names, network)
    futures = Futures(
        time_s=time_s,
        x_m=numbers(path, table, "x_m"),
        y_m=numbers(path, table, "y_m"),
        first_knot=first_knot,
        weight=known.weight,
        gone=known.gone,
        target=known.target,
        edges=driven,
        fates=known.fates,
    )
    return NamedFutures(futures, names, known.speed_mps, known.route)


def _particles_of_rows(path: Path, table: Any) -> tuple[tuple[str, ...], Offsets]:
    """Return the particles' names, and where the rows of each start, (N + 1,)."""
    import pyarrow

    stored = column(path, table, "particle")
    if stored.null_count:
        row = stored.is_null().index(True).as_py()
        raise InputError(f"{path}: column 'particle' holds no name (null) in row {row}; name it")
    whole = pyarrow.types.is_integer(stored.type)
    known = None if whole else texts(path, table, "particle")
    number = np.asarray(np.from_dlpack(stored)) if known is None else known.code
    first = np.flatnonzero(np.concatenate(([True], number[1:] != number[:-1])))
    ids = number[first].tolist()
    falls = whole and any(after < before for before, after in pairwise(ids))
    if falls or len(set(ids)) < len(ids):
        raise InputError(f"{path}: {SORTED}; the rows of each particle must follow each other")
    names = map(str, ids) if known is None else (known.values[k] for k in ids)
    return tuple(names), np.append(first, len(number))


SORTED = "rows must be sorted by particle, then rising time_s"


def _refuse_falling(
    path: Path, time_s: Floats, first_knot: Offsets, names: tuple[str, ...]
) -> None:
    falls = time_s[1:] <= time_s[:-1]
    falls[first_knot[1:-1] - 1] = False
    if falls.any():
        row = int(np.argmax(falls))
        who = names[int(np.searchsorted(first_knot, row, side="right")) - 1]
        raise InputError(
            f"{path}: {SORTED}; particle {who!r} goes from {time_s[row]:g} to {time_s[row + 1]:g} s"
        )


def _equal(count: int) -> _Particles:
    return _Particles(
        weight=np.full(count, 1.0 / count),
        gone=np.zeros(count, dtype=bool),
        target=np.zeros(count, dtype=np.int32),
        speed_mps=(np.nan,) * count,
        route=("",) * count,
        fates=None,
    )


def _read_particles(path: Path, knots: Path, names: tuple[str, ...]) -> _Particles:
    """Return what a file says of the particles of these names, in any order."""
    table = read_table(path)
    weight = numbers(path, table, "weight")
    target = _targets(path, table)
    total = np.bincount(target, np.maximum(weight, 0.0)).max(initial=0.0)
    if (weight < 0).any() or total > 1 + TOTAL:
        raise InputError(
            f"{path}: weights must not be negative nor exceed 1 in all of a target, "
            f"they sum to {total:g}"
        )
    row = _rows_of(path, table, knots, names)
    return _Particles(
        weight=_shared_out(path, knots, weight, row),
        gone=_gone(path, table)[row],
        target=target[row],
        speed_mps=tuple(_speeds(path, table)[row].tolist()),
        route=tuple(_routes(path, table)[row].tolist()),
        fates=_fates(path, table, row),
    )


def _rows_of(path: Path, table: Any, knots: Path, names: tuple[str, ...]) -> Offsets:
    """Return which row of the particles is that of each name, (N,)."""
    ids = texts(path, table, "particle")
    said = ids.code.tolist()
    refuse_nobody(path, ids)
    if len(ids.values) < len(said):
        twice = ids.values[int(np.argmax(np.bincount(ids.code)))]
        raise InputError(f"{path}: particle {twice} has two rows; leave one of them out")
    row = {ids.values[code]: k for k, code in enumerate(said)}
    missing = [name for name in names if name not in row]
    if missing:
        raise InputError(f"{knots}: particle {missing[0]} has no row in {path.name}; add it")
    return np.array([row[name] for name in names])


def _shared_out(path: Path, knots: Path, weight: Floats, row: Offsets) -> Floats:
    """Return the weights of some rows; those left out share their weight out among them."""
    kept = weight[row]
    if len(row) == len(weight):
        return kept
    log.warning(
        "%s: %d of %d particles have no row in %s; left out, the others share their weight",
        path,
        len(weight) - len(row),
        len(weight),
        knots.name,
    )
    return np.asarray(kept * (weight.sum() / kept.sum())) if kept.sum() > 0 else kept


def _gone(path: Path, table: Any) -> Any:
    said = texts(path, table, "at_end")
    known = np.array([word in ("stays", "gone") for word in said.values] + [False])[said.code]
    if not known.all():
        raise InputError(f"{path}: column 'at_end' must hold 'stays' or 'gone'")
    return np.array([word == "gone" for word in said.values])[said.code]


def _targets(path: Path, table: Any) -> Ints:
    if "target" not in table.column_names:
        return np.zeros(len(table), dtype=np.int32)
    target = numbers(path, table, "target")
    if (target % 1 > 0).any() or target.min() < 0 or target.max() > MOST_TARGETS:
        raise InputError(f"{path}: column 'target' must hold whole numbers from 0 on")
    return target.astype(np.int32)


def _fates(path: Path, table: Any, row: Offsets) -> Fates | None:
    """Return what became of particles in traffic; None where the file does not say."""
    if not set(FATES) <= set(table.column_names):
        return None
    columns: dict[str, Any] = {name: numbers_or_nan(path, table, name)[row] for name in FATES}
    try:
        return Fates(**columns)
    except InputError as error:
        raise InputError(f"{path}: {error}; record it again") from error


def _speeds(path: Path, table: Any) -> Floats:
    return numbers_or_nan(path, table, "speed_mps")


def _routes(path: Path, table: Any) -> Any:
    said = texts(path, table, "route")
    return np.array([*said.values, ""], dtype=object)[said.code]
