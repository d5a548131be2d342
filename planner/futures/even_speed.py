"""Futures from physics alone: particles that keep their speeds along their routes, without SUMO."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, first_of_parts
from planner.futures.edges_driven import EdgesDriven
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork


@dataclass(frozen=True)
class Drive:
    """How one particle drives its route."""

    start_m: float  # along its first road, where it departs
    speed_mps: float
    depart_s: float = 0.0
    stop_m: float = np.inf  # from the start of the first road, where it stops for good


def at_even_speed(
    network: RoadNetwork,
    routes: Sequence[Sequence[str]],
    drives: Sequence[Drive],
    *,
    horizon_s: float = np.inf,
    gone: Sequence[bool] | bool = False,
    weight: Floats | None = None,
) -> Futures:
    """Return particles that drive along roads, each with a knot at every point of their lines.

    Parameters
    ----------
    routes, drives
        Names of roads in the order driven, and how; N of each.
    horizon_s
        Motion after it is cut: the last knot then lies at the horizon.
    gone
        Whether a particle vanishes at the end of its route, for each or for all.
    weight
        (N,) probabilities; alike if not given.
    """
    n = len(routes)
    parts = [
        _knots(network, route, drive, horizon_s)
        for route, drive in zip(routes, drives, strict=True)
    ]
    knots = np.concatenate(parts) if parts else np.empty((0, 4))
    first_knot = first_of_parts(parts)
    edge = knots[:, 3].astype(int)
    return Futures(
        time_s=knots[:, 0],
        x_m=knots[:, 1],
        y_m=knots[:, 2],
        first_knot=first_knot,
        weight=np.full(n, 1 / max(n, 1)) if weight is None else weight,
        gone=np.broadcast_to(np.asarray(gone), n),
        edges=EdgesDriven.of_knots(edge, knots[:, 0], first_knot),
    )


def _knots(network: RoadNetwork, route: Sequence[str], drive: Drive, horizon_s: float) -> Floats:
    """Return the knots (time, x, y, edge) of one particle, (k, 4)."""
    roads = [network.road_ids.index(name) for name in route]
    points = [network.shape(roads[0])[:1]] + [network.shape(road)[1:] for road in roads]
    edges = np.repeat(roads, [len(part) for part in points[1:]])
    xy = np.concatenate(points)
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(xy, axis=0), axis=1))))
    start_m, speed_mps = drive.start_m, drive.speed_mps
    reach_m = start_m + speed_mps * (horizon_s - drive.depart_s)
    end_m = min(along[-1], max(start_m, drive.stop_m), reach_m)
    if end_m < start_m:
        return np.empty((0, 4))
    inner = along[(along > start_m) & (along < end_m)]
    at = np.unique(np.concatenate(([start_m], inner, [end_m])))
    piece = np.minimum(np.searchsorted(along, at, side="right") - 1, len(edges) - 1)
    return np.column_stack(
        [
            drive.depart_s + (at - start_m) / speed_mps,
            np.interp(at, along, xy[:, 0]),
            np.interp(at, along, xy[:, 1]),
            edges[piece],
        ]
    )
