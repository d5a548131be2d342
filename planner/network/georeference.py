"""Places on the Earth: a net's metres as longitude and latitude, and the other way.

netconvert projects longitude and latitude to metres, as the net's ``projParameter`` says, and adds
its ``netOffset``. North of the net is north of the projection's grid, which is true north only on
its central meridian.
"""

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.arrays import Flags, Floats
from planner.errors import InputError
from planner.messages import as_written
from planner.network.road_network import RoadNetwork

if TYPE_CHECKING:
    from pyproj import Proj

AGREES_DEG = 1e-6  # a place that is not found again that near lies beyond the projection's sense
FARTHEST_M = 1e6  # from the net: farther, longitude and latitude are most likely exchanged


def is_georeferenced(network: RoadNetwork) -> bool:
    """Return whether a net says where on the Earth it lies, in a way that PROJ understands."""
    try:
        _projection(network)
    except InputError:
        return False
    return True


def lonlat(network: RoadNetwork, xy_m: Floats) -> Floats:
    """Return the longitude and latitude (WGS 84) of places, (..., 2) degrees.

    Parameters
    ----------
    xy_m
        (..., 2) metres in the net's frame.

    Raises
    ------
    InputError
        If the net has no projection, or a place lies where it makes no sense.
    """
    given = np.asarray(xy_m, dtype=np.float64)
    grid_m = given - network.net_offset_m
    found = np.stack(
        _projection(network)(grid_m[..., 0], grid_m[..., 1], inverse=True, errcheck=False), axis=-1
    )
    sound = np.asarray(np.isfinite(found).all(axis=-1))
    text = f"x {{}} m, y {{}} m: no place on the Earth by {_of(network)}; give one near the net"
    _refuse_senseless(given, sound, text)
    return found


def coordinates(network: RoadNetwork, xy_m: Floats) -> str:
    """Return a point as people write it: latitude and longitude, or metres without a projection."""
    if not is_georeferenced(network):
        return f"x {xy_m[0]:,.0f} m, y {xy_m[1]:,.0f} m"
    lon, lat = lonlat(network, xy_m).tolist()
    return f"{_pointing(lat, 'NS')} {_pointing(lon, 'EW')}"


def _pointing(degrees: float, letters: str) -> str:
    return f"{abs(degrees):.5f} {letters[degrees < 0]}"


def xy_of_lonlat(network: RoadNetwork, lonlat_deg: Floats) -> Floats:
    """Return where places given by longitude and latitude (WGS 84) lie in a net, (..., 2) metres.

    Parameters
    ----------
    lonlat_deg
        (..., 2) degrees: first longitude, then latitude.

    Raises
    ------
    InputError
        If the net has no projection, or a place lies where it makes no sense; longitude and
        latitude in the wrong order often do.
    """
    given = np.asarray(lonlat_deg, dtype=np.float64)
    text = f"longitude {{}}, latitude {{}}: no place near {_of(network)}; give longitude first"
    on_earth = (np.abs(given[..., 0]) <= 180.0) & (np.abs(given[..., 1]) <= 90.0)
    _refuse_senseless(given, on_earth, text)
    projection = _projection(network)
    grid_m = np.stack(projection(given[..., 0], given[..., 1], errcheck=False), axis=-1)
    again = np.stack(
        projection(grid_m[..., 0], grid_m[..., 1], inverse=True, errcheck=False), axis=-1
    )
    xy_m = np.asarray(grid_m + network.net_offset_m)
    # Beyond its zone a projection still gives numbers, but not back from them.
    agrees = np.all(np.abs(again - given) <= AGREES_DEG, axis=-1)
    _refuse_senseless(given, agrees & _near(network, xy_m), text)
    return xy_m


def _near(network: RoadNetwork, xy_m: Floats) -> Flags:
    low_m, high_m = network.shape_xy_m.min(axis=0), network.shape_xy_m.max(axis=0)
    away_m = np.maximum(np.maximum(low_m - xy_m, xy_m - high_m), 0.0)
    return np.asarray(np.hypot(away_m[..., 0], away_m[..., 1]) <= FARTHEST_M)


def grid_convergence_deg(network: RoadNetwork, xy_m: Floats) -> Floats:
    """Return how far the net's north lies east of true north at places, (...) degrees.

    A true bearing is the bearing in the net plus this.

    Parameters
    ----------
    xy_m
        (..., 2) metres in the net's frame.

    Raises
    ------
    InputError
        If the net has no projection, or a place lies where it makes no sense.
    """
    places = lonlat(network, xy_m)
    factors: Any = _projection(network).get_factors(places[..., 0], places[..., 1])
    return np.asarray(factors.meridian_convergence, dtype=np.float64)


def _refuse_senseless(given: Floats, sound: Flags, text: str) -> None:
    """Raise InputError where places are not all sound; the text takes the first that is not."""
    if not np.all(sound):
        first, second = given[~sound].reshape(-1, 2)[0].tolist()
        raise InputError(text.format(as_written(first), as_written(second)))


def _of(network: RoadNetwork) -> str:
    said = f"{network.given_as} ({network.projection})"
    return said.replace("{", "{{").replace("}", "}}")


def _projection(network: RoadNetwork) -> "Proj":
    if network.projection is None:
        raise InputError(
            f"{network.given_as}: it has no projection, so longitude and latitude mean nothing "
            "there; give places in metres, or import the net from OpenStreetMap"
        )
    return _parsed(network.projection, str(network.given_as))


@lru_cache(8)
def _parsed(parameters: str, source: str) -> "Proj":
    from pyproj import Proj
    from pyproj.exceptions import ProjError

    try:
        projection = Proj(parameters)
    except ProjError as error:
        raise InputError(
            f"{source}: PROJ does not know its projection, {parameters}; give places in metres"
        ) from error
    return projection
