"""Polylines as columns, one after the other, and what is measured along and beside them."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Frozen, Ints, Offsets, first_rows, freeze

AT_ONCE = 1 << 18  # pairs of parts whose distance is worked out in one go


class Nearest(NamedTuple):
    """The place on lines that is nearest to another one."""

    line: int
    xy_m: Floats  # (2,) metres
    away_m: float


class Parts(NamedTuple):
    """Straight parts of lines."""

    start_m: Floats  # (S, 2) metres
    end_m: Floats  # (S, 2) metres
    line: Ints  # (S,) the line that a part is of


@dataclass(frozen=True, eq=False)
class Lines(Frozen):
    """L polylines, each of two points or more."""

    first_point: Offsets  # (L + 1,) where a line's points start
    xy_m: Floats  # (P, 2) metres

    def __post_init__(self) -> None:
        freeze(self, first_point=np.int64, xy_m=np.float64)

    def __len__(self) -> int:
        return len(self.first_point) - 1

    def __getitem__(self, line: int) -> Floats:
        """Return the points of one line, (k, 2) metres."""
        return self.xy_m[self.first_point[line] : self.first_point[line + 1]]

    @cached_property
    def length_m(self) -> Floats:
        """Length of each line, (L,) metres."""
        ends = self._travelled_m[self.first_point[1:] - 1]
        return np.asarray(ends - self._travelled_m[self.first_point[:-1]])

    @cached_property
    def _travelled_m(self) -> Floats:
        """Length of all lines up to each point, (P,) metres, one after the other."""
        steps = np.linalg.norm(np.diff(self.xy_m, axis=0), axis=1)
        steps[self.first_point[1:-1] - 1] = 0.0
        return np.concatenate(([0.0], np.cumsum(steps)))

    def at(self, line: Ints | int, distance_m: Floats | float) -> Floats:
        """Return the points at given distances along lines, (..., 2) metres.

        Distances below zero or beyond a line's length give its ends.
        """
        first, last = self.first_point[line], self.first_point[np.asarray(line) + 1] - 1
        start_m = self._travelled_m[first]
        along_m = start_m + np.clip(distance_m, 0.0, self._travelled_m[last] - start_m)
        point = np.searchsorted(self._travelled_m, along_m, side="right") - 1
        point = np.clip(point, first, last - 1)
        step_m = self._travelled_m[point + 1] - self._travelled_m[point]
        share = np.divide(
            along_m - self._travelled_m[point], step_m, out=np.zeros_like(step_m), where=step_m > 0
        )
        a, b = self.xy_m[point], self.xy_m[point + 1]
        return np.asarray(a + (b - a) * share[..., None])

    def nearest(self, xy_m: Floats) -> Nearest:
        """Return the place on any of the lines that is nearest to one, (2,) metres."""
        start_m, end_m, line = self.parts()
        step_m, offset_m = end_m - start_m, xy_m - start_m
        share = _share(offset_m, step_m)
        away_m = np.hypot(*(offset_m - step_m * share[:, None]).T)
        k = int(np.argmin(away_m))
        return Nearest(int(line[k]), start_m[k] + share[k] * step_m[k], float(away_m[k]))

    def parts(self, longest_m: float = np.inf) -> Parts:
        """Return the straight parts of all lines in order, cut into equal ones where too long."""
        start = np.delete(np.arange(len(self.xy_m)), self.first_point[1:] - 1)
        line = np.repeat(np.arange(len(self)), np.diff(self.first_point) - 1)
        step = self.xy_m[start + 1] - self.xy_m[start]
        cuts = np.maximum(1, np.ceil(np.hypot(*step.T) / longest_m)).astype(np.int64)
        whole = np.repeat(np.arange(len(start)), cuts)
        nth = np.arange(len(whole)) - np.repeat(np.cumsum(cuts) - cuts, cuts)
        shares = np.stack([nth, nth + 1])[..., None] / cuts[whole][:, None]
        ends = self.xy_m[start][whole] + step[whole] * shares
        return Parts(ends[0], ends[1], line[whole])

    def off(self, line: Ints, start_m: Floats, end_m: Floats) -> Floats:
        """Return how far off their own lines straight parts lie at most, (S,) metres.

        The distance from one straight part of a line is greatest at an end of what lies beside it.
        So the greater of both ends' is the most for each of them, and the least of these a bound,
        which is exact where the same part of the line is nearest all the way.

        Parameters
        ----------
        line
            (S,) the line to which each part is held.
        start_m, end_m
            (S, 2) metres; the same for a place alone.
        """
        count = np.diff(self.first_point)[line] - 1
        chunks = np.flatnonzero(np.diff(np.cumsum(count) // AT_ONCE, prepend=0))
        rows = np.split(np.arange(len(line)), chunks)
        return np.concatenate(
            [self._off(line[part], start_m[part], end_m[part]) for part in rows if len(part)]
            or [np.empty(0)]
        )

    def _off(self, line: Ints, start_m: Floats, end_m: Floats) -> Floats:
        count = np.diff(self.first_point)[line] - 1
        first = first_rows(count)
        row = np.repeat(np.arange(len(line)), count)
        point = self.first_point[line][row] + np.arange(first[-1]) - first[row]
        from_m, step_m = self.xy_m[point], self.xy_m[point + 1] - self.xy_m[point]
        off_m = _away(start_m[row] - from_m, step_m)
        if end_m is not start_m:
            off_m = np.maximum(off_m, _away(end_m[row] - from_m, step_m))
        return np.asarray(np.minimum.reduceat(off_m, first[:-1]))


def _away(offset_m: Floats, step_m: Floats) -> Floats:
    """Return the distances of places from straight parts, all seen from the parts' starts."""
    share = _share(offset_m, step_m)
    return np.asarray(np.hypot(*(offset_m - step_m * share[:, None]).T))


def _share(offset_m: Floats, step_m: Floats) -> Floats:
    """Return how far along straight parts they are nearest to places, (S,) from 0 to 1."""
    long2 = np.maximum((step_m * step_m).sum(axis=1), np.finfo(float).tiny)
    return np.asarray(np.clip((offset_m * step_m).sum(axis=1) / long2, 0.0, 1.0))
