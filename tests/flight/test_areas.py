"""Areas of GeoJSON and of points: what they say, and every way in which they can be wrong."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from planner.errors import InputError
from planner.flight.areas import MOST_CORNERS, area_of_file, area_of_points
from planner.network.georeference import lonlat
from support.instances import figure3

ON_EARTH = "+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"
NET = replace(figure3(), projection=ON_EARTH, net_offset_m=(-400_000.0, -5_800_000.0))
METRES = np.array([[1.0, 2.0], [5_001.0, 2.0], [5_001.0, 3_002.0], [1.0, 2.0]])
RING = lonlat(NET, METRES).tolist()
CROSSED = lonlat(NET, np.array([[0, 0], [9, 9], [9, 0], [0, 9], [0, 0]])).tolist()
WEST = [[lon - 60.0, lat] for lon, lat in RING]


def polygon(*rings: Any) -> dict[str, Any]:
    return {"type": "Polygon", "coordinates": list(rings)}


def collection(*parts: Any) -> dict[str, Any]:
    features = [{"type": "Feature", "properties": {}, "geometry": part} for part in parts]
    return {"type": "FeatureCollection", "features": features}


def area_in(path: Path, content: Any) -> Any:
    text = content if isinstance(content, str) else json.dumps(content)
    path.write_text(text, encoding="utf-8")
    return area_of_file(path, NET)


@pytest.mark.parametrize(
    "content",
    [
        polygon(RING),
        {"type": "MultiPolygon", "coordinates": [[RING]]},
        collection(polygon(RING), None),
        {"type": "GeometryCollection", "geometries": [polygon([[*p, 80.0] for p in RING])]},
    ],
)
def test_polygons_in_any_form_are_read(tmp_path: Path, content: Any) -> None:
    area = area_in(tmp_path / "a.geojson", content)
    wanted = shapely.Polygon(METRES)
    assert area.symmetric_difference(wanted).area < 1e-3 * wanted.area


FAULTY = {
    "open": (polygon(RING[:-1]), "a ring of 3 points is not closed; give at least four"),
    "crossing": (polygon(CROSSED), "crosses itself"),
    "flat": (polygon([RING[0], RING[1], RING[0], RING[0]]), "or encloses nothing"),
    "lat before lon": (polygon([point[::-1] for point in RING]), "longitude"),
    "metres": (polygon(METRES.tolist()), "longitude 5001"),
    "far away": (polygon(WEST), "longitude"),
    "empty": ("", "is not JSON"),
    "no polygons": (collection(), "holds no polygon; give a Polygon"),
    "no geometry": ({"type": "Feature", "geometry": None}, "holds no polygon"),
    "a point": (collection({"type": "Point", "coordinates": [13.0, 52.0]}), "holds a Point, which"),
    "a list": ([1], "is no GeoJSON; give"),
    "no coordinates": ({"type": "Polygon"}, "Polygon: coordinates should be a list"),
    "a text for a ring": (polygon("abc"), "a ring should be a list of"),
    "texts for points": (polygon([["a", "b"]]), "a ring should be a list of"),
    "a number for a polygon": ({"type": "MultiPolygon", "coordinates": [3]}, "a list of rings"),
    "in another frame": (polygon(RING) | {"crs": {"properties": {"name": "EPSG:25833"}}}, "WGS 84"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTY)
def test_faults_are_one_line(tmp_path: Path, fault: str) -> None:
    content, told = FAULTY[fault]
    with pytest.raises(InputError) as caught:
        area_in(tmp_path / "a.geojson", content)
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


def test_degrees_need_a_net_with_a_projection(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the net has no projection; give points in metres"):
        area_of_file(tmp_path / "a.geojson", figure3())


def test_points_are_metres_of_the_net() -> None:
    square = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)]
    other = [(x + 20.0, y) for x, y in square]
    assert area_of_points([square], NET).equals(shapely.box(0, 0, 10, 10))
    assert area_of_points([square, other], NET).area == 200.0
    with pytest.raises(InputError, match=r"nothing \(no area\)"):
        area_of_points([[(0.0, 0.0), (5000.0, 1e-5), (9000.0, 0.0)]], NET)
    crossing = r"crosses itself, .*\(self-intersection at 5 m east, 5 m north in the net\)"
    with pytest.raises(InputError, match=crossing):
        area_of_points([[square[k] for k in (0, 2, 1, 3)]], NET)
    with pytest.raises(InputError, match=r"lies [0-9.e+]+ km from the net"):
        area_of_points([[(x + 1e7, y) for x, y in square]], NET)


def test_too_many_corners_are_refused() -> None:
    turns = np.linspace(0.0, 2.0 * np.pi, MOST_CORNERS + 2, endpoint=False)
    circle = np.stack([1e3 * np.cos(turns), 1e3 * np.sin(turns)], axis=1)
    with pytest.raises(InputError, match=r"1,002 corners; simplify it"):
        area_of_points([circle.tolist()], NET)
