"""Single polylines, and streets that are made one: the steps by which roads are merged."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats

PLANE = np.array([1, 1j])  # from pairs x, y to complex numbers
STEP_M = 10.0  # between the points of a line that are held against another one
SMOOTH_M = 0.5  # by which the mean of two lines may be simplified


class Street(NamedTuple):
    """A road in the making, between two nodes."""

    start: int
    end: int
    line_m: Floats  # (k, 2) metres, from the start's place to the end's
    edges: tuple[int, ...]  # that it was made of
    against: tuple[bool, ...]  # whether each of them runs from its end to its start
    abreast: int = 1  # how many edges its line is the mean of

    def turned(self) -> "Street":
        """Return the same street, drawn from its end to its start."""
        against = tuple(not one for one in self.against)
        return self._replace(
            start=self.end, end=self.start, line_m=self.line_m[::-1], against=against
        )

    @property
    def is_loop(self) -> bool:
        """Whether it ends where it starts."""
        return self.start == self.end


def travelled_m(line_m: Floats) -> Floats:
    """Return how far along a line its points are, (k,) metres."""
    steps_m = np.abs(np.diff(line_m @ PLANE))
    return np.concatenate(([0.0], np.cumsum(steps_m)))


def length_m(line_m: Floats) -> float:
    """Return the length of a line, metres."""
    return float(np.abs(np.diff(line_m @ PLANE)).sum())


def points_at(line_m: Floats, shares: Floats) -> Floats:
    """Return the points at shares of a line's length, (k, 2) metres."""
    along = travelled_m(line_m)
    along /= along[-1] or 1.0
    return np.stack([np.interp(shares, along, column) for column in line_m.T], axis=1)


def mean_line(lines_m: Sequence[Floats]) -> Floats:
    """Return the line whose point at each share of its length is the mean of theirs there."""
    if len(lines_m) == 1:
        return lines_m[0]
    shares = [travelled_m(line) for line in lines_m]
    every = np.unique(np.concatenate([share / (share[-1] or 1.0) for share in shares]))
    return np.asarray(np.mean([points_at(line, every) for line in lines_m], axis=0))


def simplified(line_m: Floats, tolerance_m: float) -> Floats:
    """Return a line without the points that it passes within a tolerance (Ramer, Douglas, Peucker).

    Its ends stay.
    """
    kept = np.zeros(len(line_m), dtype=bool)
    kept[[0, -1]] = True
    waiting = [(0, len(line_m) - 1)]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        off_m = off_line(line_m[first + 1 : last], line_m[[first, last]])
        most = int(np.argmax(off_m))
        if off_m[most] > tolerance_m:
            kept[first + 1 + most] = True
            waiting += [(first, first + 1 + most), (first + 1 + most, last)]
    return line_m[kept]


def off_line(places_m: Floats, line_m: Floats) -> Floats:
    """Return how far places, (n, 2) metres, are from a line, (n,) metres."""
    line, places = line_m @ PLANE, places_m @ PLANE
    step = line[1:] - line[:-1]
    offset = places[:, None] - line[:-1]
    long2 = np.maximum(step.real**2 + step.imag**2, np.finfo(float).tiny)
    share = np.minimum(np.maximum((offset * step.conj()).real / long2, 0.0), 1.0)
    return np.asarray(np.abs(offset - step * share).min(axis=1))


def apart_m(one_m: Floats, other_m: Floats) -> float:
    """Return the Hausdorff distance of two lines, metres: how far one gets from the other."""
    return float(max(_farthest_m(one_m, other_m), _farthest_m(other_m, one_m)))


def _farthest_m(line_m: Floats, other_m: Floats) -> float:
    count = max(2, int(np.ceil(length_m(line_m) / STEP_M)) + 1)
    return float(off_line(points_at(line_m, np.linspace(0.0, 1.0, count)), other_m).max())


def merged_abreast(streets: Iterable[Street], within_m: float) -> list[Street]:
    """Return streets with those made one that join the same nodes and keep within a distance."""
    alike: dict[tuple[int, int], list[Street]] = {}
    for street in streets:
        drawn = street.turned() if street.start > street.end else street
        alike.setdefault((drawn.start, drawn.end), []).append(drawn)
    return [one for group in alike.values() for one in _merged_group(group, within_m)]


def _merged_group(group: list[Street], within_m: float) -> list[Street]:
    """Return the streets between two nodes, each merged into the first shorter one beside it."""
    kept: list[Street] = []
    for street in sorted(group, key=lambda one: length_m(one.line_m)) if group[1:] else group:
        for k, other in enumerate(kept):
            beside = _beside(street, other, within_m)
            if beside is not None:
                kept[k] = _merged(other, beside)
                break
        else:
            kept.append(street)
    return kept


def _beside(street: Street, other: Street, within_m: float) -> Street | None:
    """Return a street as it runs beside another one, None if it does not."""
    ways = (street, street.turned()) if street.is_loop else (street,)
    near_m, way = min(
        ((apart_m(way.line_m, other.line_m), k) for k, way in enumerate(ways)), default=(0.0, 0)
    )
    return ways[way] if near_m <= within_m else None


def _merged(one: Street, other: Street) -> Street:
    line_m = one.line_m if one.abreast >= other.abreast else other.line_m
    if one.abreast == other.abreast:
        line_m = simplified(mean_line([one.line_m, other.line_m]), SMOOTH_M)
    return one._replace(
        line_m=line_m,
        edges=one.edges + other.edges,
        against=one.against + other.against,
        abreast=one.abreast + other.abreast,
    )


def joined_chains(streets: Sequence[Street], nodes: int) -> list[Street]:
    """Return streets joined at nodes where just two meet, unless that would make a loop."""
    found: dict[int, Street] = dict(enumerate(streets))
    at: list[list[int]] = [[] for _ in range(nodes)]
    for k, street in found.items():
        at[street.start].append(k)
        at[street.end].append(k)
    for node in range(nodes):
        if len(at[node]) != 2 or at[node][0] == at[node][1]:
            continue
        a, b = at[node]
        one = found[a] if found[a].end == node else found[a].turned()
        other = found[b] if found[b].start == node else found[b].turned()
        if one.start != other.end:
            found[a] = _joined(one, other)
            del found[b]
            at[node] = []
            at[other.end] = [a if k == b else k for k in at[other.end]]
    return list(found.values())


def _joined(one: Street, other: Street) -> Street:
    return Street(
        one.start,
        other.end,
        np.concatenate([one.line_m, other.line_m[1:]]),
        one.edges + other.edges,
        one.against + other.against,
        max(one.abreast, other.abreast),
    )
