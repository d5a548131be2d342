"""Where roads are: the stretches of edges near a place, along a heading or within an area."""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Ints
from planner.belief.stretches import Stretches
from planner.errors import InputError
from planner.network.road_network import RoadNetwork
from planner.network.signals import signals_of

IN_MEMORY = 8  # networks whose lines a process keeps
ALONG_DEG = 45.0  # by which a road may differ from a heading
FAR_M = 2000.0  # from any road: a place there is not meant
SAME_M = 1e-6  # pieces that end and begin so near each other are one stretch


class Lines(NamedTuple):
    """Straight pieces of the lines that cars drive on, of all edges one after the other."""

    edge: Ints  # (P,)
    a_m: Floats  # (P, 2) where it begins, metres
    b_m: Floats  # (P, 2) where it ends
    at_m: Floats  # (P,) how far along the edge it begins, as SUMO measures edges
    long_m: Floats  # (P,) how long it is, likewise


class Piece(NamedTuple):
    """A part of an edge."""

    edge: int
    from_m: float
    to_m: float


@lru_cache(IN_MEMORY)
def lines_of(network: RoadNetwork) -> Lines:
    """Return the lines of a network's edges: the lane that a car uses, or the drawn road."""
    edges = len(network.edge_ids)
    if network.is_abstract:
        shapes = [network.shape(int(road)) for road in network.edge_road]
    else:
        signals = signals_of(network)
        first = signals.first_point[: edges + 1]
        shapes = [signals.xy_m[first[e] : first[e + 1]] for e in range(edges)]
    parts = []
    for edge, shape in enumerate(shapes):
        step_m = np.linalg.norm(np.diff(shape, axis=0), axis=1)
        drawn_m = float(step_m.sum())
        scale = float(network.edge_length_m[edge]) / drawn_m if drawn_m > 0 else 0.0
        long_m = step_m * scale
        parts.append((np.full(len(step_m), edge), shape[:-1], shape[1:], long_m))
    edge_of, a_m, b_m, long_m = (np.concatenate(column) for column in zip(*parts, strict=True))
    ends_m = np.cumsum(long_m)
    first_of = np.flatnonzero(np.diff(edge_of, prepend=-1))
    begins_m = ends_m - long_m
    at_m = begins_m - np.repeat(begins_m[first_of], np.diff(np.append(first_of, len(edge_of))))
    return Lines(edge_of, a_m, b_m, at_m, long_m)


def away_m(lines: Lines, x_m: float, y_m: float) -> Floats:
    """Return how far a point is from each piece, (P,) metres."""
    step, to = lines.b_m - lines.a_m, np.array([x_m, y_m]) - lines.a_m
    squared = np.einsum("ij,ij->i", step, step)
    share = np.einsum("ij,ij->i", step, to)
    share = np.divide(share, squared, out=np.zeros(len(share)), where=squared > 0)
    return np.asarray(np.linalg.norm(to - step * np.clip(share, 0.0, 1.0)[:, None], axis=1))


def along(lines: Lines, heading_deg: float | None) -> Flags:
    """Return which pieces run within `ALONG_DEG` of a compass heading, (P,); None: all."""
    step = lines.b_m - lines.a_m
    if heading_deg is None:
        return np.ones(len(step), bool)
    bearing = np.degrees(np.arctan2(step[:, 0], step[:, 1]))
    apart = np.abs((bearing - heading_deg + 180.0) % 360.0 - 180.0)
    return np.asarray(apart <= ALONG_DEG)


def in_circle(
    network: RoadNetwork,
    x_m: float,
    y_m: float,
    radius_m: float,
    *,
    heading_deg: float | None = None,
    leads_on: bool = False,
) -> Stretches:
    """Return all stretches within a circle, as probable as they are long.

    Parameters
    ----------
    heading_deg
        Compass heading; only roads that run within `ALONG_DEG` of it count.
    leads_on
        Whether only edges count from which a target can go on.

    Raises
    ------
    InputError
        If there is none; the text says how far the nearest one is.
    """
    lines = lines_of(network)
    fits = along(lines, heading_deg)
    if leads_on:
        fits &= (np.diff(network.first_turn) > 0)[lines.edge]
    away = np.where(fits, away_m(lines, x_m, y_m), np.inf)
    near = np.flatnonzero(away < radius_m)
    if len(near) == 0:
        raise InputError(_too_far(network, lines, away, heading_deg))
    step, to = (lines.b_m - lines.a_m)[near], lines.a_m[near] - (x_m, y_m)
    a = np.einsum("ij,ij->i", step, step)
    b = np.einsum("ij,ij->i", step, to)
    c = np.einsum("ij,ij->i", to, to) - radius_m**2
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    scale = np.divide(1.0, a, out=np.zeros(len(a)), where=a > 0)
    low, high = np.clip((-b - root) * scale, 0, 1), np.clip((-b + root) * scale, 0, 1)
    at_m, long_m = lines.at_m[near], lines.long_m[near]
    return _joined(lines.edge[near], at_m + low * long_m, at_m + high * long_m)


def _too_far(network: RoadNetwork, lines: Lines, away: Floats, heading_deg: float | None) -> str:
    roads = (
        "any road" if heading_deg is None else f"any road within {ALONG_DEG:g} deg of heading_deg"
    )
    if not np.isfinite(away).any():
        return f"there is not {roads}; leave heading_deg out"
    nearest = int(np.argmin(away))
    name, far_m = network.edge_ids[lines.edge[nearest]], float(away[nearest])
    larger = f", or radius_m = {np.ceil(far_m) + 1:.0f}" if far_m < FAR_M else ""
    return (
        f"lies {far_m:,.0f} m from {roads} ({name} is the nearest); give a place nearby, in metres "
        f"as the net has them{larger}"
    )


def nearest_to(network: RoadNetwork, x_m: float, y_m: float) -> tuple[int, float]:
    """Return the nearest edge and how far it is, metres."""
    lines = lines_of(network)
    away = away_m(lines, x_m, y_m)
    nearest = int(np.argmin(away))
    return int(lines.edge[nearest]), float(away[nearest])


def place_nearest_to(network: RoadNetwork, x_m: float, y_m: float) -> Stretches:
    """Return the place on a road that is nearest to a point, as a stretch without length.

    Raises
    ------
    InputError
        If it lies farther than `FAR_M` from any road.
    """
    lines = lines_of(network)
    away = away_m(lines, x_m, y_m)
    k = int(np.argmin(away))
    if away[k] > FAR_M:
        raise InputError(_too_far(network, lines, away, None))
    step, to = lines.b_m[k] - lines.a_m[k], np.array([x_m, y_m]) - lines.a_m[k]
    share = float(np.clip(np.dot(step, to) / max(float(np.dot(step, step)), SAME_M), 0.0, 1.0))
    at_m = np.array([lines.at_m[k] + share * lines.long_m[k]])
    return Stretches(lines.edge[[k]], at_m, at_m, np.ones(1))


def in_area(
    network: RoadNetwork, corners: Sequence[tuple[float, float]], *, leads_on: bool = False
) -> Stretches:
    """Return all stretches within a polygon, as probable as they are long.

    Parameters
    ----------
    leads_on
        Whether only edges count from which a target can go on.

    Raises
    ------
    InputError
        If there is none.
    """
    lines, polygon = lines_of(network), np.array(corners, dtype=np.float64)
    low = np.maximum(np.minimum(lines.a_m, lines.b_m), polygon.min(axis=0))
    high = np.minimum(np.maximum(lines.a_m, lines.b_m), polygon.max(axis=0))
    near = np.all(low <= high, axis=1)
    if leads_on:
        near &= (np.diff(network.first_turn) > 0)[lines.edge]
    pieces = [piece for k in np.flatnonzero(near).tolist() for piece in _inside(lines, k, polygon)]
    if not pieces:
        x_m, y_m = polygon.mean(axis=0)
        edge, away = nearest_to(network, float(x_m), float(y_m))
        raise InputError(
            f"there is no road within the polygon ({network.edge_ids[edge]} is the nearest, "
            f"{away:,.0f} m from its middle); give corners in metres as the net has them"
        )
    edges, from_m, to_m = (np.array(column) for column in zip(*pieces, strict=True))
    return _joined(edges, from_m, to_m)


def _inside(lines: Lines, k: int, polygon: Floats) -> Iterator[Piece]:
    """Yield the parts of a piece that lie within a polygon."""
    p, step = lines.a_m[k], lines.b_m[k] - lines.a_m[k]
    q, side = polygon, np.roll(polygon, -1, axis=0) - polygon
    cross = step[0] * side[:, 1] - step[1] * side[:, 0]
    to = q - p
    some = cross != 0
    t = (to[some, 0] * side[some, 1] - to[some, 1] * side[some, 0]) / cross[some]
    u = (to[some, 0] * step[1] - to[some, 1] * step[0]) / cross[some]
    cuts = np.unique(np.concatenate(([0.0, 1.0], t[(t > 0) & (t < 1) & (u >= 0) & (u <= 1)])))
    for begin, end in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
        if holds(polygon, p + step * (begin + end) / 2):
            at_m, long_m = float(lines.at_m[k]), float(lines.long_m[k])
            yield Piece(int(lines.edge[k]), at_m + begin * long_m, at_m + end * long_m)


def holds(polygon: Floats, point: Floats) -> bool:
    """Return whether a point lies within a polygon: a ray from it crosses the sides an odd time."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    between = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
    a, b = a[between], b[between]
    x_m = a[:, 0] + (point[1] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool(np.count_nonzero(point[0] < x_m) % 2)


def _joined(edge: Ints, from_m: Floats, to_m: Floats) -> Stretches:
    """Return pieces, in the order of the edges, as stretches: those that meet are one."""
    some = to_m > from_m
    edge, from_m, to_m = edge[some], from_m[some], to_m[some]
    meets = (np.diff(edge) == 0) & (np.abs(from_m[1:] - to_m[:-1]) < SAME_M)
    begins, ends = np.concatenate(([True], ~meets)), np.concatenate((~meets, [True]))
    return Stretches.by_length(edge[begins], from_m[begins], to_m[ends])
