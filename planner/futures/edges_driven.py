"""Which edge each particle is on, as a table of changes beside the knots."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.arrays import Flags, Floats, Frozen, Ints, Offsets, first_rows, freeze, rows_taken
from planner.checked import finite, offsets, same_length
from planner.errors import InputError

NO_EDGE = -1


@dataclass(frozen=True, eq=False)
class EdgesDriven(Frozen):
    """When each of N particles comes onto an edge; it is on that one until it changes again.

    Before its first change its edge is unknown. A particle of which nothing is known has none.

    Raises
    ------
    InputError
        If a particle's times do not rise.
    """

    first_change: Offsets  # (N + 1,) where a particle's changes start
    time_s: Floats  # (C,) seconds on the target's clock, rising within a particle
    edge: Ints  # (C,) the edge driven from then on, NO_EDGE where it is unknown

    def __post_init__(self) -> None:
        freeze(self, first_change=np.int64, time_s=np.float64, edge=np.int32)
        changes = same_length(time_s=self.time_s, edge=self.edge)
        offsets("first_change", self.first_change, max(0, self.first_change.size - 1), changes)
        finite(time_s=self.time_s)
        falls = (np.diff(self.time_s) <= 0) & (np.diff(self.particle) == 0)
        if falls.any():
            k = int(np.argmax(falls))
            raise InputError(
                f"time_s: particle {self.particle[k]} comes onto edges at {self.time_s[k]:g} and "
                f"{self.time_s[k + 1]:g} s; times must rise from change to change"
            )

    def __len__(self) -> int:
        return len(self.first_change) - 1

    @classmethod
    def unknown(cls, particles: int) -> "EdgesDriven":
        """Return that nothing is known of so many particles."""
        return cls(np.zeros(particles + 1, np.int64), np.zeros(0), np.zeros(0, np.int32))

    @classmethod
    def of_knots(cls, edge: Ints, time_s: Floats, first_knot: Offsets) -> "EdgesDriven":
        """Return the changes among the edges driven from each knot to the next, (K,)."""
        particles = len(first_knot) - 1
        particle = np.repeat(np.arange(particles), np.diff(first_knot))
        return cls.of_rows(particles, particle, time_s, edge)

    @classmethod
    def of_rows(
        cls, particles: int, particle: Offsets, time_s: Floats, edge: Ints
    ) -> "EdgesDriven":
        """Return the changes among rows that say from when on a particle is on an edge, (K,).

        Rows come in any order; those that repeat the edge before them are left out.
        """
        order = np.lexsort((time_s, particle))
        who, on = np.asarray(particle)[order], np.asarray(edge)[order]
        before = np.where(np.diff(who, prepend=-1) != 0, NO_EDGE, np.roll(on, 1))
        kept = order[on != before]
        count = np.bincount(np.asarray(particle)[kept], minlength=particles)
        first = first_rows(count)
        return cls(first, np.asarray(time_s)[kept], np.asarray(edge)[kept])

    @classmethod
    def joined(cls, parts: Sequence["EdgesDriven"]) -> "EdgesDriven":
        """Return what is known of several sets of particles, one after the other."""
        counts = np.concatenate([np.diff(part.first_change) for part in parts])
        return cls(
            first_rows(counts),
            np.concatenate([part.time_s for part in parts]),
            np.concatenate([part.edge for part in parts]),
        )

    @cached_property
    def particle(self) -> Offsets:
        """Whose each change is, (C,)."""
        return np.repeat(np.arange(len(self)), np.diff(self.first_change))

    def at(self, time_s: Floats | float) -> Ints:
        """Return the edge of each particle, (N,), NO_EDGE where unknown.

        Parameters
        ----------
        time_s
            Seconds on the target's clock: one time for all, or each particle's own, (N,).
        """
        at_s = np.broadcast_to(np.asarray(time_s, dtype=np.float64), len(self))
        passed = np.bincount(self.particle[self.time_s <= at_s[self.particle]], minlength=len(self))
        edge = np.append(self.edge, NO_EDGE)
        return edge[np.where(passed > 0, self.first_change[:-1] + passed - 1, -1)]

    def of_times(self, time_s: Floats, first: Offsets) -> Ints:
        """Return the edges at many times, (K,), of which each particle's start at ``first``."""
        particle = np.repeat(np.arange(len(self)), np.diff(first))
        # Changes first, where a time is that of a change.
        order = np.lexsort(
            (
                np.repeat([0, 1], [len(self.time_s), len(time_s)]),
                np.concatenate((self.time_s, time_s)),
                np.concatenate((self.particle, particle)),
            )
        )
        asked = order >= len(self.time_s)
        change = np.cumsum(~asked)[asked] - 1
        row = order[asked] - len(self.time_s)
        edge = np.full(len(time_s), NO_EDGE, np.int32)
        own = change >= self.first_change[:-1][particle[row]]
        edge[row[own]] = self.edge[change[own]]
        return edge

    def take(self, particles: Offsets | Flags) -> "EdgesDriven":
        """Return what is known of some particles only, in the order given."""
        index = np.arange(len(self))[particles]
        changes, first = rows_taken(self.first_change, index)
        return EdgesDriven(first, self.time_s[changes], self.edge[changes])

    def since(self, from_s: Floats) -> "EdgesDriven":
        """Return what is known of each particle from its own time on, (N,) seconds.

        The edge that it is on then counts as entered then. From infinity on nothing is known.
        """
        now = np.flatnonzero(np.isfinite(from_s))
        return self._changed(self.time_s > from_s[self.particle], now, from_s, self.at(from_s))

    def until(self, to_s: Floats) -> "EdgesDriven":
        """Return the same, but from each particle's own time on its edge is unknown, (N,) seconds.

        For infinity it stays known.
        """
        ends = np.flatnonzero(np.isfinite(to_s))
        unknown = np.full(len(self), NO_EDGE)
        return self._changed(self.time_s < to_s[self.particle], ends, to_s, unknown)

    def _changed(
        self, kept: Flags, particles: Offsets, time_s: Floats, edge: Ints
    ) -> "EdgesDriven":
        """Return some changes, and one more for each of some particles, from (N,) columns."""
        return EdgesDriven.of_rows(
            len(self),
            np.concatenate((self.particle[kept], particles)),
            np.concatenate((self.time_s[kept], time_s[particles])),
            np.concatenate((self.edge[kept], edge[particles])),
        )
