"""Nodes that are one at a tolerance: roundabouts, joined junctions, streets shorter than it."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.network.streets import Street, length_m

WIDEST = 1.6  # tolerances that a contracted node's own nodes may span
WITHIN = 3.0  # tolerances: as short a street within a contracted node is part of it
TRIMMED = 0.8  # of a tolerance around a new node, within which streets' lines are led to it


class Nodes(NamedTuple):
    """V places, and the rectangles of the net's own nodes that were contracted to them."""

    xy_m: Floats  # (V, 2) metres
    low_m: Floats  # (V, 2) metres
    high_m: Floats  # (V, 2) metres


def contracted(
    nodes: Nodes, streets: Sequence[Street], tolerance_m: float
) -> tuple[Nodes, list[Street]]:
    """Return nodes and streets with nodes closer than a tolerance made one.

    A node that others were contracted to is the least of them by number, in their middle; nodes
    that no street leads to any more stay where they were. Where nothing but short streets would be
    lost within one node, they stay.
    """
    used = np.unique([node for street in streets for node in (street.start, street.end)])
    close = _close(nodes, used, streets, tolerance_m)
    into = _clusters(nodes, used, close, WIDEST * tolerance_m)
    moved = _moved(nodes, used, into)
    led = [_led(street, into, moved, tolerance_m) for street in streets]
    reached = np.zeros(len(into), dtype=bool)
    reached[[node for street in led if street for node in (street.start, street.end)]] = True
    into = np.where(reached[into], into, np.arange(len(into)))
    found = [
        street if not reached[into[street.start]] else new
        for street, new in zip(streets, led, strict=True)
    ]
    return _moved(nodes, used, into), [street for street in found if street]


def _close(
    nodes: Nodes, used: Ints, streets: Sequence[Street], tolerance_m: float
) -> list[tuple[float, int, int]]:
    """Return the pairs of nodes that are to be one, the closest first."""
    from scipy.spatial import KDTree

    pairs = used[KDTree(nodes.xy_m[used]).query_pairs(tolerance_m, output_type="ndarray")]
    away_m = np.hypot(*(nodes.xy_m[pairs[:, 0]] - nodes.xy_m[pairs[:, 1]]).T)
    near = list(zip(away_m.tolist(), *pairs.T.tolist(), strict=True))
    short = [
        (long_m, street.start, street.end)
        for street in streets
        if not street.is_loop and (long_m := length_m(street.line_m)) < tolerance_m
    ]
    return sorted((far_m, min(a, b), max(a, b)) for far_m, a, b in near + short)


def _clusters(
    nodes: Nodes, used: Ints, close: list[tuple[float, int, int]], widest_m: float
) -> Ints:
    """Return for each node the least of those that it is one with, (V,)."""
    into = list(range(len(nodes.xy_m)))
    low_m, high_m = nodes.low_m.copy(), nodes.high_m.copy()

    def least(node: int) -> int:
        while into[node] != node:
            node = into[node]
        return node

    for _, one, other in close:
        a, b = sorted((least(one), least(other)))
        low, high = np.minimum(low_m[a], low_m[b]), np.maximum(high_m[a], high_m[b])
        if a != b and np.hypot(*(high - low)) <= widest_m:
            into[b] = a
            low_m[a], high_m[a] = low, high
    found = np.arange(len(into))
    found[used] = [least(node) for node in used.tolist()]
    return found


def _moved(nodes: Nodes, used: Ints, into: Ints) -> Nodes:
    """Return nodes with those contracted in the middle of what they were made of."""
    count = np.maximum(1, np.bincount(into[used], minlength=len(into)))
    sums = [np.bincount(into[used], column, len(into)) for column in nodes.xy_m[used].T]
    xy_m, low_m, high_m = nodes.xy_m.copy(), nodes.low_m.copy(), nodes.high_m.copy()
    many = np.flatnonzero(count > 1)
    xy_m[many] = np.stack(sums, axis=1)[many] / count[many][:, None]
    np.minimum.at(low_m, into[used], nodes.low_m[used])
    np.maximum.at(high_m, into[used], nodes.high_m[used])
    return Nodes(xy_m, low_m, high_m)


def _led(street: Street, into: Ints, nodes: Nodes, tolerance_m: float) -> Street | None:
    """Return a street led to contracted nodes, without its points near them at its ends.

    None if it is lost within one of them.
    """
    start, end = int(into[street.start]), int(into[street.end])
    new = [~np.all(nodes.low_m[node] == nodes.high_m[node]) for node in (start, end)]
    if not any(new):
        return street
    inner, xy_m = street.line_m[1:-1], nodes.xy_m
    away = np.hypot(*(inner - xy_m[start]).T) > TRIMMED * tolerance_m
    away &= np.hypot(*(inner - xy_m[end]).T) > TRIMMED * tolerance_m
    kept = np.flatnonzero(away)
    inner = inner[kept[0] : kept[-1] + 1] if len(kept) else inner[:0]
    line_m = np.concatenate([xy_m[[start]], inner, xy_m[[end]]])
    if start == end:
        short = not street.is_loop and length_m(street.line_m) < WITHIN * tolerance_m
        away_m = np.hypot(*(line_m - xy_m[start]).T).max()
        if short or away_m <= WIDEST * tolerance_m:
            return None
    return street._replace(start=start, end=end, line_m=line_m)
