"""What is recorded so far, particle by particle, so that an interrupted recording goes on."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from planner.arrays import Offsets
from planner.errors import InputError
from planner.files import written_whole
from planner.futures.edges_driven import EdgesDriven
from planner.futures.futures import Futures

KNOTS = ("time_s", "x_m", "y_m", "first_knot")
CHANGES = ("first_change", "time_s", "edge")


class Kept:
    """Recorded particles out of a number of them, in memory and, if a folder is given, in files.

    Parameters
    ----------
    count
        How many there will be.
    folder
        Where parts are kept; what lies there from before is taken up.
    """

    def __init__(self, count: int, folder: Path | None = None) -> None:
        self.count, self._folder = count, folder
        self._parts: list[tuple[Offsets, Futures]] = []
        self._there = np.zeros(count, dtype=bool)
        for particles, part in _found(folder) if folder else ():
            if particles.max() < count and not self._there[particles].any():
                self._add(particles, part)

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
            columns |= {f"edges_{name}": getattr(part.edges, name) for name in CHANGES}
            path = self._folder / f"{particles.min()}.npz"
            with written_whole(path) as new, new.open("wb") as file:
                np.savez(file, particles=particles, **columns)

    def first(self, count: int) -> Futures:
        """Return the futures of the first so many particles; all weigh the same and stay."""
        order = np.argsort(np.concatenate([particles for particles, _ in self._parts]))
        return joined([part for _, part in self._parts]).take(order[:count])

    def _add(self, particles: Offsets, part: Futures) -> None:
        self._there[particles] = True
        self._parts.append((particles, part))


def joined(parts: Sequence[Futures]) -> Futures:
    """Return the particles of several futures as one; all weigh the same and stay."""
    counts = np.concatenate([np.diff(part.first_knot) for part in parts])
    return Futures(
        time_s=np.concatenate([part.time_s for part in parts]),
        x_m=np.concatenate([part.x_m for part in parts]),
        y_m=np.concatenate([part.y_m for part in parts]),
        first_knot=np.concatenate(([0], np.cumsum(counts))),
        weight=np.full(len(counts), 1.0 / len(counts)),
        gone=np.zeros(len(counts), dtype=bool),
        edges=EdgesDriven.joined([part.edges for part in parts]),
    )


def _found(folder: Path) -> Iterator[tuple[Offsets, Futures]]:
    for path in sorted(folder.glob("[0-9]*.npz")):
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as columns:
                yield _part(columns)
        except (OSError, ValueError, KeyError, EOFError, BadZipFile, InputError):
            path.unlink(missing_ok=True)


def _part(columns: Any) -> tuple[Offsets, Futures]:
    particles = columns["particles"]
    changes = [columns[f"edges_{name}"] for name in CHANGES]
    return particles, Futures(
        **{name: columns[name] for name in KNOTS},
        weight=np.full(len(particles), 1.0 / len(particles)),
        gone=np.zeros(len(particles), dtype=bool),
        edges=EdgesDriven(*changes),
    )
