"""Shortest ways through a free space: by the corners of what is in the way.

They are shortest paths in the visibility graph (Lozano-Perez and Wesley 1979, "An algorithm for
planning collision-free paths among polyhedral obstacles"), of which only those edges count that
are tangent to a corner at each end: no others lie on a shortest way.
"""

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from planner.arrays import Flags, Floats

Area: TypeAlias = Any  # of shapely: one polygon or several, metres in the net's plane
Point: TypeAlias = tuple[float, float]  # metres

TANGENT = 1e-9  # product of two sines; less is rounding


@dataclass(frozen=True, eq=False)
class Ways:
    """The ways through a free space; what is found once is kept."""

    free: Area  # prepared
    outside_m: float  # corners with coordinates of that size only close the free space off
    _found: dict[tuple[Point, Point], list[Point] | None] = field(default_factory=dict, repr=False)
    _seen: dict[int, list[int]] = field(default_factory=dict, repr=False)  # corner to corners

    @cached_property
    def corners(self) -> Floats:
        """Each corner with those before and after it, (K, 3, 2) metres."""
        import shapely

        rings = [shapely.get_coordinates(ring)[:-1] for ring in shapely.get_rings(self.free)]
        parts = [np.stack([np.roll(r, 1, 0), r, np.roll(r, -1, 0)], axis=1) for r in rings]
        corners = np.concatenate([np.zeros((0, 3, 2)), *parts])
        return np.asarray(corners[np.abs(corners[:, 1]).max(axis=1, initial=0.0) < self.outside_m])

    def shortest(self, a: Point, b: Point) -> list[Point] | None:
        """Return the points of the shortest way with both ends; None if there is no way."""
        if (a, b) not in self._found:
            straight = bool(self._sees(a, np.array([b]))[0])
            self._found[a, b] = [a, b] if straight else self._around(a, b)
        return self._found[a, b]

    def _around(self, a: Point, b: Point) -> list[Point] | None:
        """Return the shortest way by corners, by A*; ties go to the corner that comes first."""
        at = [(float(x), float(y)) for x, y in self.corners[:, 1]]
        ends = {*self._seen_from(b)}
        least, before = [math.inf] * len(at), [-1] * len(at)
        reached: list[tuple[float, float, int]] = []

        def reach(k: int, length_m: float, from_: int) -> None:
            if length_m < least[k]:
                least[k], before[k] = length_m, from_
                heapq.heappush(reached, (length_m + math.dist(at[k], b), length_m, k))

        for k in self._seen_from(a):
            reach(k, math.dist(a, at[k]), -1)
        while reached:
            _, length_m, k = heapq.heappop(reached)
            if k in ends:
                return [a, *_back(k, before, at), b]
            if length_m > least[k]:
                continue
            for other in self._seen_from_corner(k):
                reach(other, length_m + math.dist(at[k], at[other]), k)
        return None

    def _seen_from(self, place: Point) -> list[int]:
        """Return the corners to which ways from a place may lead straight."""
        found = np.flatnonzero(_tangent(self.corners, np.array(place)))
        return [int(k) for k in found[self._sees(place, self.corners[found, 1])]]

    def _seen_from_corner(self, corner: int) -> list[int]:
        if corner not in self._seen:
            here = self.corners[corner]
            place = (float(here[1, 0]), float(here[1, 1]))
            seen = np.array(self._seen_from(place), dtype=np.int64)
            leaves = _tangent(np.broadcast_to(here, (len(seen), 3, 2)), self.corners[seen, 1])
            self._seen[corner] = seen[leaves].tolist()
        return self._seen[corner]

    def _sees(self, place: Point, others: Floats) -> Flags:
        """Return to which other places one may fly straight, (k,)."""
        import shapely

        ways = np.stack([np.broadcast_to(np.array(place), others.shape), others], axis=1)
        return np.asarray(shapely.covers(self.free, shapely.linestrings(ways)), dtype=np.bool_)


def _back(last: int, before: Sequence[int], at: Sequence[Point]) -> list[Point]:
    way = []
    while last >= 0:
        way.append(at[last])
        last = before[last]
    return way[::-1]


def _tangent(corners: Floats, place: Floats) -> Flags:
    """Return at which corners a line from a place leaves both edges on one side, (K,)."""
    before, here, after = np.moveaxis(corners, 1, 0)
    sides = [_sine(here - place, other - here) for other in (before, after)]
    return np.asarray(sides[0] * sides[1] >= -TANGENT, dtype=np.bool_)


def _sine(a: Floats, b: Floats) -> Floats:
    """Return the sine of the turn from one direction to another, (k,); 0 where there is none."""
    cross = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    size = np.hypot(a[..., 0], a[..., 1]) * np.hypot(b[..., 0], b[..., 1])
    return np.asarray(np.divide(cross, size, out=np.zeros_like(cross), where=size > 0.0))
