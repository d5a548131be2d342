"""Polygons in a net's plane, held against what a polygon is."""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from planner.arrays import Floats
from planner.errors import InputError

Polygon: TypeAlias = Any  # of shapely, metres in the net's plane

LEAST_M2 = 0.1  # less is a line that was rounded


def sound_polygon(edge: Floats, holes: Sequence[Floats] = ()) -> Polygon:
    """Return a polygon of its corners, (k, 2) metres.

    Raises
    ------
    InputError
        If it crosses itself or encloses nothing.
    """
    import shapely

    polygon = shapely.Polygon(np.asarray(edge, dtype=np.float64), holes)
    if not polygon.is_valid or polygon.area < LEAST_M2:
        raise InputError(
            f"a polygon crosses itself, or encloses nothing ({_why(polygon)}); correct its points"
        )
    return polygon


def _why(polygon: Polygon) -> str:
    """Return what is wrong with a polygon, and where."""
    import shapely

    if polygon.is_valid:
        return "no area"
    fault, _, place = shapely.is_valid_reason(polygon).lower().rstrip("]").partition("[")
    x_m, y_m = map(float, place.split())
    return f"{fault} at {x_m:,.0f} m east, {y_m:,.0f} m north in the net"
