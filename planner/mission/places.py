"""Places of a plan as other programs need them: the net's plane, and degrees where it has any."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planner.arrays import Floats
from planner.flight.track import Track
from planner.network.georeference import is_georeferenced, lonlat
from planner.network.road_network import RoadNetwork

DIGITS = 8  # of a degree: a millimetre on the ground


def frame(network: RoadNetwork) -> dict[str, Any]:
    """Return which net a plan is for, and how its plane lies on the Earth, as plain data."""
    return {
        "sha256": network.sha256,
        "projection": network.projection if is_georeferenced(network) else None,
        "net_offset_m": list(network.net_offset_m),
    }


def place(xy_m: ArrayLike, network: RoadNetwork) -> dict[str, float]:
    """Return a place as plain data: metres, and degrees on a net with a projection."""
    ((x_m, y_m, *degrees),) = _rows(np.array([xy_m], dtype=np.float64), network)
    return {"x_m": x_m, "y_m": y_m, **dict(zip(("lon", "lat"), degrees, strict=False))}


def waypoints(track: Track, network: RoadNetwork) -> list[list[float]]:
    """Return time, x and y of each waypoint, and on a net with a projection lon and lat."""
    rows = _rows(np.stack([track.x_m, track.y_m], axis=1), network)
    return [[time_s, *row] for time_s, row in zip(track.time_s.tolist(), rows, strict=True)]


def _rows(xy_m: Floats, network: RoadNetwork) -> list[list[float]]:
    """Return places, (n, 2) metres, as rows of x, y, and where there are any lon and lat."""
    columns = [xy_m]
    if is_georeferenced(network):
        columns += [np.round(lonlat(network, xy_m), DIGITS)]
    rows: list[list[float]] = np.concatenate(columns, axis=1).tolist()
    return rows
