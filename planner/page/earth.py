"""A page's places on the Earth: degrees, true north, and the UTM grid with its MGRS squares."""

from typing import Any, NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.errors import InputError
from planner.network.georeference import (
    grid_convergence_deg,
    is_georeferenced,
    lonlat,
    xy_of_lonlat,
)
from planner.network.road_network import RoadNetwork

DEGREE = 3  # of the polynomials by which a page turns metres into degrees
GOOD_DEG = 2e-6  # by which these may be off: 0.2 m
LINES = 8  # of the grid, at most, each way
POINTS = 9  # of a line, which is bent where the net's projection is not the grid's
SOUTHMOST, NORTHMOST = -80.0, 84.0  # of UTM, degrees
BANDS = "CDEFGHJKLMNPQRSTUVWX"
COLUMNS = ("ABCDEFGH", "JKLMNPQR", "STUVWXYZ")
ROWS = "ABCDEFGHJKLMNPQRSTUV"
SQUARE_M = 100_000.0


class Box(NamedTuple):
    """A part of the plane, metres."""

    west_m: float
    south_m: float
    east_m: float
    north_m: float

    @property
    def middle(self) -> Floats:
        """Its middle, (2,) metres."""
        return np.array([self.west_m + self.east_m, self.south_m + self.north_m]) / 2.0

    def lattice(self, many: int) -> Floats:
        """Return places all over it, (many**2, 2) metres."""
        x_m = np.linspace(self.west_m, self.east_m, many)
        y_m = np.linspace(self.south_m, self.north_m, many)
        return np.stack(np.meshgrid(x_m, y_m), axis=-1).reshape(-1, 2)


def earth_content(network: RoadNetwork, whole: Box, view: Box) -> dict[str, Any] | None:
    """Return how the page's script finds degrees, north and the grid; None without a projection.

    Parameters
    ----------
    whole
        Where degrees may be asked for.
    view
        Where the grid is drawn.
    """
    if not is_georeferenced(network):
        return None
    try:
        degrees = _polynomials(network, whole)
        north_deg = -float(grid_convergence_deg(network, view.middle))
        grid = _grid(network, view)
    except InputError:  # part of it lies where the projection makes no sense
        return None
    return None if degrees is None else {**degrees, "north": round(north_deg, 3), "grid": grid}


def _polynomials(network: RoadNetwork, box: Box) -> dict[str, Any] | None:
    """Return longitude and latitude as polynomials of x and y; None if they are not that good."""
    half_m = max(box.east_m - box.west_m, box.north_m - box.south_m, 1.0) / 2.0
    places_m = box.lattice(12)
    terms = _terms((places_m - box.middle) / half_m)
    degrees = lonlat(network, places_m)
    found = np.round(np.linalg.lstsq(terms, degrees, rcond=None)[0], 9)
    if np.abs(terms @ found - degrees).max() > GOOD_DEG:
        return None
    middle = [round(metres, 3) for metres in box.middle.tolist()]
    return {
        "middle": middle,
        "half": round(half_m, 3),
        "lon": _list(found[:, 0]),
        "lat": _list(found[:, 1]),
    }


def _list(column: Floats) -> list[float]:
    return [float(number) for number in column]


def _terms(uv: Floats) -> Floats:
    """Return the products u**i v**j of up to `DEGREE` factors, (n, terms), i rising, then j."""
    u, v = uv.T
    powers = [(i, j) for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)]
    return np.stack([u**i * v**j for i, j in powers], axis=1)


def _grid(network: RoadNetwork, view: Box) -> dict[str, Any] | None:
    """Return the lines of the UTM grid that cross a view; None beyond UTM."""
    lon_deg, lat_deg = lonlat(network, view.middle).tolist()
    if not SOUTHMOST <= lat_deg < NORTHMOST:
        return None
    zone, south = utm_zone(lon_deg, lat_deg), lat_deg < 0.0
    utm = _Utm(zone, south)
    corners_m = utm.metres(lonlat(network, view.lattice(POINTS)))
    low_m, high_m = corners_m.min(axis=0), corners_m.max(axis=0)
    size_m = float((high_m - low_m).max())
    step_m = _round_step(size_m / LINES)
    low_m, high_m = low_m - size_m, high_m + size_m  # paper shows more than the view
    lines = []
    for axis in (0, 1):  # of one easting, then of one northing
        along_m = np.linspace(low_m[1 - axis], high_m[1 - axis], POINTS)
        first = np.ceil(low_m[axis] / step_m)
        for metres in np.arange(first, high_m[axis] / step_m) * step_m:
            places_m = np.empty((POINTS, 2))
            places_m[:, axis], places_m[:, 1 - axis] = metres, along_m
            xy_m = xy_of_lonlat(network, utm.degrees(places_m))
            lines.append(
                {"axis": axis, "km": f"{metres / 1000:.10g}", "xy": xy_m.round(1).tolist()}
            )
    return {
        "zone": f"{zone}{band(lat_deg)}",
        "squares": "/".join(dict.fromkeys(mgrs_square(zone, *m) for m in corners_m.tolist())),
        "step_m": step_m,
        "lines": lines,
    }


class _Utm:
    """The projection of one zone."""

    def __init__(self, zone: int, south: bool) -> None:
        from pyproj import Proj

        self._proj = Proj(proj="utm", zone=zone, south=south, datum="WGS84", units="m")

    def metres(self, degrees: Floats) -> Floats:
        """Return easting and northing of longitudes and latitudes, (n, 2)."""
        return np.stack(self._proj(degrees[:, 0], degrees[:, 1]), axis=-1)

    def degrees(self, metres: Floats) -> Floats:
        """Return longitude and latitude of eastings and northings, (n, 2)."""
        return np.stack(self._proj(metres[:, 0], metres[:, 1], inverse=True), axis=-1)


def utm_zone(lon_deg: float, lat_deg: float) -> int:
    """Return the UTM zone of a place, those of Norway and Svalbard as they are."""
    if 56.0 <= lat_deg < 64.0 and 3.0 <= lon_deg < 12.0:
        return 32
    if 72.0 <= lat_deg < NORTHMOST and 0.0 <= lon_deg < 42.0:
        return 31 + 2 * int((lon_deg + 3.0) // 12.0)
    return int((lon_deg + 180.0) // 6.0) % 60 + 1


def band(lat_deg: float) -> str:
    """Return the letter of a latitude from -80 to 84 degrees."""
    return BANDS[min(int((lat_deg - SOUTHMOST) // 8.0), len(BANDS) - 1)]


def mgrs_square(zone: int, easting_m: float, northing_m: float) -> str:
    """Return the two letters of the square of 100 km in which a place of a zone lies."""
    column = COLUMNS[(zone - 1) % 3][int(easting_m // SQUARE_M) - 1]
    row = ROWS[(int(northing_m // SQUARE_M) + (5 if zone % 2 == 0 else 0)) % len(ROWS)]
    return column + row


def _round_step(metres: float) -> float:
    """Return the least of 1, 2, 5, 10, 20, ... that is not less."""
    unit = 10.0 ** np.floor(np.log10(max(metres, 1.0)))
    return next(float(k * unit) for k in (1, 2, 5, 10) if k * unit >= metres)
