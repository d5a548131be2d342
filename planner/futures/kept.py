"""What is recorded so far, particle by particle, so that an interrupted recording goes on."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planner.arrays import Offsets
from planner.errors import InputError
from planner.futures.edges_driven import EdgesDriven
from planner.futures.fates import COLUMNS as FATE_COLUMNS
from planner.futures.fates import Fates
from planner.futures.futures import Futures
from planner.futures.pooled import pooled
from planner.npz import read_columns, write_columns

KNOTS = ("time_s", "x_m", "y_m", "first_knot")
CHANGES = ("first_change", "time_s", "edge")
EDGES = "edges_"  # begins the names of the columns of changes
FATES = "fates_"  # and of those of fates, where particles rode in traffic
COLUMNS = ("particles", *KNOTS, *(EDGES + name for name in CHANGES))


class Kept:
    """Recorded particles out of a number of them, in memory and, if a folder is given, in files.

    Parameters
    ----------
    count
        How many there will be.
    folder
        Where parts are kept; what lies there from before is taken up.
    begun
        The first particles, if they are recorded elsewhere.
    """

    def __init__(
        self, count: int, folder: Path | None = None, begun: Futures | None = None
    ) -> None:
        self.count, self._folder = count, folder
        self._parts: list[tuple[Offsets, Futures]] = []
        self._there = np.zeros(count, dtype=bool)
        for particles, part in _found(folder) if folder else ():
            if particles.max() < count and not self._there[particles].any():
                self._add(particles, part)
        if begun is not None:
            some = self.missing[self.missing < len(begun)]
            if len(some):
                self._add(some, begun.take(some))

    @property
    def missing(self) -> Offsets:
        """Which particles are not recorded yet, (n,)."""
        return np.flatnonzero(~self._there)

    @property
    def ready(self) -> int:
        """How many of the first particles are all recorded."""
        return self.count if self._there.all() else int(np.argmin(self._there))

    def keep(self, particles: Offsets, part: Futures) -> None:
        """Keep the futures of some particles, in their order."""
        self._add(particles, part)
        if self._folder is not None:
            columns = {name: getattr(part, name) for name in KNOTS}
            columns |= {EDGES + name: getattr(part.edges, name) for name in CHANGES}
            if part.fates is not None:
                columns |= {FATES + name: column for name, column in part.fates.columns.items()}
            path = self._folder / f"{particles.min()}.npz"
            write_columns(path, {"particles": particles, **columns})

    def first(self, count: int) -> Futures:
        """Return the futures of the first so many particles; all weigh the same and stay."""
        order = np.argsort(np.concatenate([particles for particles, _ in self._parts]))
        first = pooled([part for _, part in self._parts]).take(order[:count])
        return first.reweighted(np.full(len(first), 1.0 / max(1, len(first))))

    def _add(self, particles: Offsets, part: Futures) -> None:
        self._there[particles] = True
        self._parts.append((particles, part))


def recorded_of(several: Sequence[Kept]) -> tuple[int, int]:
    """Return how many particles are recorded, and how many there will be."""
    total = sum(one.count for one in several)
    return total - sum(len(one.missing) for one in several), total


def _found(folder: Path) -> Iterator[tuple[Offsets, Futures]]:
    for path in sorted(folder.glob("[0-9]*.npz")):
        part = _read_part(path)
        if part is None:
            path.unlink(missing_ok=True)
        else:
            yield part


def _read_part(path: Path) -> tuple[Offsets, Futures] | None:
    """Return some particles and their futures; None where the file is damaged."""
    columns = read_columns(path, COLUMNS)
    try:
        return None if columns is None else _part(columns, _fates(path))
    except (ValueError, InputError):
        return None


def _fates(path: Path) -> Fates | None:
    columns = read_columns(path, [FATES + name for name in FATE_COLUMNS])
    if columns is None:
        return None
    return Fates(**{name: columns[FATES + name] for name in FATE_COLUMNS})


def _part(columns: Mapping[str, Any], fates: Fates | None) -> tuple[Offsets, Futures]:
    particles = columns["particles"]
    changes = [columns[EDGES + name] for name in CHANGES]
    return particles, Futures(
        **{name: columns[name] for name in KNOTS},
        weight=np.full(len(particles), 1.0 / len(particles)),
        gone=np.zeros(len(particles), dtype=bool),
        edges=EdgesDriven(*changes),
        fates=fates,
    )
