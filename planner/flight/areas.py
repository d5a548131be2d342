"""Areas as scenarios give them, as polygons in the net's plane: points, or a GeoJSON file.

GeoJSON (RFC 7946) has longitude and latitude, WGS 84, longitude first.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planner.arrays import Floats
from planner.errors import InputError
from planner.flight.ways import Area
from planner.guard import read_json
from planner.network.georeference import is_georeferenced, xy_of_lonlat
from planner.network.polygons import sound_polygon
from planner.network.road_network import RoadNetwork

Rings = Sequence[Any]  # of a polygon: its edge, then its holes, each a list of points
ToPlane = Callable[[Floats], Floats]  # from what a file has, (k, 2), to metres, (k, 2)

MOST_CORNERS = 1000  # of an airspace's area: ways around it are found corner by corner
FAR = 5.0  # widths of a net; an area beyond is in another frame
WGS84 = ("urn:ogc:def:crs:OGC:1.3:CRS84", "urn:ogc:def:crs:OGC::CRS84", "EPSG:4326")
COLLECTED = {"FeatureCollection": "features", "GeometryCollection": "geometries"}


def area_of_points(polygons: Sequence[Sequence[Sequence[float]]], network: RoadNetwork) -> Area:
    """Return the area of polygons whose points are in the net's plane, metres.

    Raises
    ------
    InputError
        If one crosses itself, or they lie far from the net.
    """
    return _area([[polygon] for polygon in polygons], network, lambda points: points)


def area_of_file(path: Path, network: RoadNetwork) -> Area:
    """Return the area of all polygons in a GeoJSON file.

    Raises
    ------
    InputError
        If it is no GeoJSON of polygons, one of them is open or crosses itself, they lie far from
        the net, or the net has no projection.
    """
    if not is_georeferenced(network):
        raise InputError(
            "GeoJSON has degrees, and the net has no projection; give points in metres instead, "
            "as [[0, 0], [500, 0], [500, 500]]"
        )
    content = read_json(path)
    _refuse_other_frames(content)
    polygons = [_closed(rings) for rings in _polygons(content)]
    if not polygons:
        raise InputError("holds no polygon; give a Polygon or a MultiPolygon")
    return _area(polygons, network, lambda degrees: xy_of_lonlat(network, degrees))


def _polygons(content: Any) -> Iterator[Rings]:
    """Yield the rings of each polygon in what may be any GeoJSON object."""
    kind = content.get("type") if isinstance(content, dict) else None
    if kind in COLLECTED:
        for part in _items(content, COLLECTED[kind]):
            yield from _polygons(part)
    elif kind == "Feature":
        yield from () if content.get("geometry") is None else _polygons(content["geometry"])
    elif kind == "Polygon":
        yield _items(content, "coordinates")
    elif kind == "MultiPolygon":
        yield from _items(content, "coordinates")
    elif isinstance(kind, str) and isinstance(content.get("coordinates"), list):
        raise InputError(f"holds a {kind}, which is no area; give polygons only")
    else:
        raise InputError("is no GeoJSON; give a FeatureCollection, a Feature or a Polygon")


def _items(content: Any, key: str) -> list[Any]:
    found = content.get(key)
    if not isinstance(found, list):
        raise InputError(f"{content['type']}: {key} should be a list; correct the GeoJSON")
    return found


def _refuse_other_frames(content: Any) -> None:
    """Refuse what the GeoJSON of 2008 could say: that its numbers are no degrees."""
    crs = content.get("crs") if isinstance(content, dict) else None
    if crs is None:
        return
    properties = crs.get("properties") if isinstance(crs, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    if name not in WGS84:
        raise InputError(f"crs: {str(name)[:60]} is not WGS 84; convert it to longitude, latitude")


def _closed(rings: Any) -> list[Floats]:
    """Return the rings of a polygon, each (k, 2) degrees."""
    if not isinstance(rings, list) or not rings:
        raise InputError("a polygon should be a list of rings; correct the GeoJSON")
    return [_ring(ring) for ring in rings]


def _ring(ring: Any) -> Floats:
    numbers = isinstance(ring, list) and all(
        isinstance(point, list)
        and len(point) >= 2
        and all(type(one) in (int, float) for one in point[:2])
        for point in ring
    )
    if not numbers:
        raise InputError("a ring should be a list of [lon, lat]; correct the GeoJSON")
    points = np.array([point[:2] for point in ring], dtype=np.float64).reshape(-1, 2)
    if len(points) < 4 or np.any(points[0] != points[-1]):
        raise InputError(
            f"a ring of {len(points)} points is not closed; give at least four, the last one "
            "equal to the first"
        )
    return points


def _area(polygons: Sequence[Rings], network: RoadNetwork, to_plane: ToPlane) -> Area:
    import shapely

    many = sum(len(ring) for rings in polygons for ring in rings)
    if many > MOST_CORNERS:
        raise InputError(f"has {many:,} corners; simplify it to {MOST_CORNERS:,} at most")
    found = []
    for rings in polygons:
        edge, *holes = [to_plane(np.asarray(ring, dtype=np.float64)) for ring in rings]
        found.append(sound_polygon(edge, holes))
    area = shapely.union_all(found)
    _refuse_far(area, network)
    return area


def _refuse_far(area: Area, network: RoadNetwork) -> None:
    low, high = network.shape_xy_m.min(axis=0), network.shape_xy_m.max(axis=0)
    west, south, east, north = area.bounds
    beyond = np.maximum(low - (east, north), (west, south) - high)
    away_m = float(np.hypot(*np.maximum(beyond, 0.0)))
    if away_m > FAR * float((high - low).max()):
        raise InputError(
            f"lies {away_m / 1000:.6g} km from the net (x {low[0]:.8g} to {high[0]:.8g}, y "
            f"{low[1]:.8g} to {high[1]:.8g} m); give the net's metres, or in GeoJSON "
            "longitude and then latitude"
        )
