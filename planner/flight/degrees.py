"""From the net's plane to longitude and latitude (WGS 84) and back."""

import gzip
import re
from contextlib import suppress

import numpy as np

from planner.arrays import Floats
from planner.network.road_network import RoadNetwork

OFFSET, HEAD = re.compile(r'netOffset="([^",]+),([^"]+)"'), 1 << 16  # characters in which it is


def lonlat(network: RoadNetwork, xy_m: Floats) -> Floats:
    """Return degrees of places in the plane of a net with a projection, both (k, 2)."""
    from pyproj import Proj

    assert network.projection is not None
    x_m, y_m = (xy_m - net_offset_m(network)).T
    return np.stack(Proj(network.projection)(x_m, y_m, inverse=True), axis=1)


def plane_m(network: RoadNetwork, degrees: Floats) -> Floats:
    """Return where longitudes and latitudes are in the plane of a net with a projection, (k, 2)."""
    from pyproj import Proj

    assert network.projection is not None
    lon, lat = degrees.T
    return np.stack(Proj(network.projection)(lon, lat), axis=1) + net_offset_m(network)


def net_offset_m(network: RoadNetwork) -> tuple[float, float]:
    """Return what stands in the net's file as its offset; (0, 0) if there is none."""
    opened = gzip.open if network.path.suffix == ".gz" else open
    with suppress(OSError, EOFError), opened(network.path, "rt", encoding="utf-8") as file:
        found = OFFSET.search(file.read(HEAD))
        return (float(found[1]), float(found[2])) if found else (0.0, 0.0)
    return 0.0, 0.0
