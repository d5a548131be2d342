"""Futures: the recorded motion of all particles, as knots of piecewise straight motion."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Frozen, Ints, Offsets, freeze, rows_taken
from planner.checked import instance, offsets, same_length, weights
from planner.errors import InputError
from planner.futures.edges_driven import EdgesDriven
from planner.futures.fates import Fates


class Pieces(NamedTuple):
    """Straight motion, evenly in time, in K pieces: from each point of a path to the next.

    A path's last point is an instant. So is every point with another one at the same time.
    """

    from_s: Floats  # (K,) seconds
    x_m: Floats  # (K,) metres, at the piece's first second
    y_m: Floats  # (K,) metres
    vx_mps: Floats  # (K,) m/s
    vy_mps: Floats  # (K,) m/s
    to_s: Floats  # (K,) seconds, the piece's last one

    @classmethod
    def between(cls, time_s: Floats, x_m: Floats, y_m: Floats, first_point: Offsets) -> "Pieces":
        """Return the pieces of paths, whose points are columns, (K,), of seconds and metres.

        Parameters
        ----------
        first_point
            Where each path's points start, and their number, (paths + 1,).
        """
        goes_on = np.ones(len(time_s), dtype=bool)
        goes_on[first_point[1:][np.diff(first_point) > 0] - 1] = False
        to_s = np.where(goes_on, np.roll(time_s, -1), time_s)
        lasts_s = to_s - time_s
        moves = lasts_s > 0.0
        steps = [np.where(moves, np.roll(column, -1) - column, 0.0) for column in (x_m, y_m)]
        vx_mps, vy_mps = (step / np.where(moves, lasts_s, 1.0) for step in steps)
        return cls(time_s, x_m, y_m, vx_mps, vy_mps, to_s)


@dataclass(frozen=True, eq=False)
class Futures(Frozen):
    """Where each particle is at every time.

    Between two knots a particle moves straight at constant speed. It is nowhere before its first
    knot; after its last one it rests there, or is gone. A particle without knots is never seen.

    Raises
    ------
    InputError
        If a particle's times do not rise, or a time or place is not finite.
    """

    time_s: Floats  # (K,) seconds on the target's clock, rising within a particle
    x_m: Floats  # (K,) metres
    y_m: Floats  # (K,) metres
    first_knot: Offsets  # (N + 1,) where a particle's knots start
    weight: Floats  # (N,) probability; sums to the probability that the target is there at all
    gone: Flags  # (N,) True: vanishes after the last knot, False: rests there
    # (N,) which target the particle may be, 0 for the first; left out: there is one target
    target: Ints = field(default_factory=lambda: np.zeros(0, np.int32))
    # which edge each particle is on; left out: nothing is known of that
    edges: EdgesDriven = field(default_factory=lambda: EdgesDriven.unknown(0))
    fates: Fates | None = None  # what became of each in traffic; None: none was recorded in any

    def __post_init__(self) -> None:
        if len(self.target) == 0:
            object.__setattr__(self, "target", np.zeros(np.size(self.weight)))
        if isinstance(self.edges, EdgesDriven) and len(self.edges) == 0:
            object.__setattr__(self, "edges", EdgesDriven.unknown(np.size(self.weight)))
        freeze(
            self,
            time_s=np.float64,
            x_m=np.float64,
            y_m=np.float64,
            first_knot=np.int64,
            weight=np.float64,
            gone=np.bool_,
            target=np.int32,
        )
        particles = same_length(weight=self.weight, gone=self.gone, target=self.target)
        knots = same_length(time_s=self.time_s, x_m=self.x_m, y_m=self.y_m)
        offsets("first_knot", self.first_knot, particles, knots)
        weights("weight", self.weight)
        instance("edges", self.edges, EdgesDriven)
        if self.fates is not None:
            instance("fates", self.fates, Fates)
            same_length(weight=self.weight, **self.fates.columns)
        changes = len(self.edges.time_s)
        offsets("edges.first_change", self.edges.first_change, particles, changes)
        self._refuse_bad_knots()

    def _refuse_bad_knots(self) -> None:
        """Compiled code relies on this: equal or unknown times would lead it beyond its columns."""
        later = self.time_s[1:] > self.time_s[:-1]
        finite = all(np.isfinite(column).all() for column in (self.time_s, self.x_m, self.y_m))
        starts = self.first_knot[(self.first_knot > 0) & (self.first_knot < len(self.time_s))]
        later[starts - 1] = True
        if not (finite and later.all()):
            raise InputError(self._bad_knot(later))

    def _bad_knot(self, later: Flags) -> str:
        """Return a sentence on the first knot that cannot be."""
        unknown = ~(np.isfinite(self.time_s) & np.isfinite(self.x_m) & np.isfinite(self.y_m))
        bad = unknown | np.append(False, ~later)
        knot = int(np.argmax(bad))
        values = f"{self.time_s[knot]:g} s, ({self.x_m[knot]:g}, {self.y_m[knot]:g}) m"
        if not unknown[knot]:
            values += f", after one at {self.time_s[knot - 1]:g} s"
        return (
            f"time_s, x_m, y_m: particle {self.particle[knot]} has a knot at {values}; "
            "times must rise from knot to knot, and times and places be finite"
        )

    def __len__(self) -> int:
        return len(self.weight)

    @cached_property
    def end_s(self) -> Floats:
        """Time of each particle's last knot, (N,) seconds; -inf for one without knots."""
        ends = np.full(len(self), -np.inf)
        some = np.diff(self.first_knot) > 0
        ends[some] = self.time_s[self.first_knot[1:][some] - 1]
        return ends

    @cached_property
    def particle(self) -> Offsets:
        """Whose each knot is, (K,)."""
        return np.repeat(np.arange(len(self)), np.diff(self.first_knot))

    @cached_property
    def pieces(self) -> Pieces:
        """How particles move from each knot on, (K,); at rest after the last one they stay.

        Made once, and read-only.
        """
        pieces = Pieces.between(self.time_s, self.x_m, self.y_m, self.first_knot)
        rests = (np.diff(self.first_knot) > 0) & ~self.gone
        to_s = pieces.to_s.copy()
        to_s[self.first_knot[1:][rests] - 1] = np.inf
        for column in (pieces.vx_mps, pieces.vy_mps, to_s):
            column.flags.writeable = False
        return pieces._replace(to_s=to_s)

    def take(self, particles: Offsets | Flags) -> "Futures":
        """Return the futures of some particles only, in the order given, weights as they are."""
        index = np.arange(len(self))[particles]
        knots, first = rows_taken(self.first_knot, index)
        return Futures(
            time_s=self.time_s[knots],
            x_m=self.x_m[knots],
            y_m=self.y_m[knots],
            first_knot=first,
            weight=self.weight[index],
            gone=self.gone[index],
            target=self.target[index],
            edges=self.edges.take(index),
            fates=None if self.fates is None else self.fates.take(index),
        )

    def reweighted(self, weight: Floats) -> "Futures":
        """Return the same motion with other weights, (N,)."""
        return replace(self, weight=weight)

    def driven_m(self, time_s: Floats | float) -> Floats:
        """Return how far each particle has come along its way, (N,) metres.

        Parameters
        ----------
        time_s
            As `positions` takes it.
        """
        upto_s = np.minimum(time_s, self.end_s)[self.particle]
        pieces, first = self.pieces, self.first_knot
        lasts_s = np.clip(np.minimum(pieces.to_s, upto_s) - pieces.from_s, 0.0, None)
        metres = np.hypot(pieces.vx_mps, pieces.vy_mps) * lasts_s
        along_m = np.concatenate(([0.0], np.cumsum(metres)))
        return np.asarray(along_m[first[1:]] - along_m[first[:-1]])

    def positions(self, time_s: Floats | float) -> Floats:
        """Return where all particles are, (N, 2) metres, NaN where they are not.

        Parameters
        ----------
        time_s
            Seconds on the target's clock: one time for all, or each particle's own, (N,).
        """
        at_s = np.broadcast_to(np.asarray(time_s, dtype=np.float64), len(self))
        passed = np.bincount(self.particle[self.time_s <= at_s[self.particle]], minlength=len(self))
        there = np.flatnonzero((passed > 0) & ~(self.gone & (at_s > self.end_s)))
        knot = (self.first_knot[:-1] + passed - 1)[there]
        xy_m = np.full((len(self), 2), np.nan)
        since_s = np.minimum(at_s, self.end_s)[there] - self.time_s[knot]
        # The arithmetic of `np.interp`, so that this and `xy` agree to the last bit.
        xy_m[there, 0] = self.pieces.vx_mps[knot] * since_s + self.x_m[knot]
        xy_m[there, 1] = self.pieces.vy_mps[knot] * since_s + self.y_m[knot]
        return xy_m

    def xy(self, particle: int, time_s: Floats | float) -> Floats:
        """Return where one particle is at given times, (..., 2) metres, NaN where it is not."""
        knots = slice(self.first_knot[particle], self.first_knot[particle + 1])
        times = self.time_s[knots]
        after = np.nan if self.gone[particle] else None
        if len(times) == 0:
            return np.full((*np.shape(time_s), 2), np.nan)
        return np.stack(
            [
                np.interp(time_s, times, column[knots], left=np.nan, right=after)
                for column in (self.x_m, self.y_m)
            ],
            axis=-1,
        )
