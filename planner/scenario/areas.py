"""What a key of [airspace] may hold: the path of a file, or polygons."""

from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator

from planner.messages import as_written
from planner.scenario.values import FARTHEST_M


def _area(value: Any) -> Any:
    """Return a path, or polygons as tuples of points; one polygon may stand without its list."""
    if isinstance(value, str) and value:
        return value
    polygons = [value] if _is_polygon(value) else value
    if isinstance(polygons, list | tuple) and polygons and all(map(_is_polygon, polygons)):
        return tuple(tuple((float(x), float(y)) for x, y in polygon) for polygon in polygons)
    raise ValueError(
        f"should be the path of a GeoJSON file, or at least three points, not "
        f"{as_written(value)}; write [[0, 0], [500, 0], [500, 500]], in metres as the net has them"
    )


def _is_polygon(value: Any) -> bool:
    return isinstance(value, list | tuple) and len(value) > 2 and all(map(_is_point, value))


def _is_point(value: Any) -> bool:
    numbers = isinstance(value, list | tuple) and len(value) == 2
    return numbers and all(type(one) in (int, float) and abs(one) <= FARTHEST_M for one in value)


Polygon: TypeAlias = tuple[tuple[float, float], ...]  # metres
Area = Annotated[str | tuple[Polygon, ...], BeforeValidator(_area)]
