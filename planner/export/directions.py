"""A flight by hand in the words of a pilot: along which street, from where to where, how far."""

from math import atan2, degrees
from typing import NamedTuple

import numpy as np

from planner import compass
from planner.arrays import Floats
from planner.clock import clock
from planner.export.way import Way
from planner.network.georeference import grid_convergence_deg
from planner.network.road_network import RoadNetwork
from planner.network.street_names import crossed

AT_M = 60.0  # from a place is the crossing that names it

HEADING = f"{'begins':>8}{'length':>9}  bearing"


class Direction(NamedTuple):
    """One leg, along a street or straight across country."""

    phrase: str
    length_m: float
    bearing_deg: float  # from its beginning to its end, clockwise from true north
    begins_s: float  # seconds on the target's clock

    @property
    def line(self) -> str:
        """It in one line, below `HEADING`."""
        bearing = round(self.bearing_deg) % 360
        wind = compass.letters(bearing, 8)
        far = f"{self.length_m:>7,.0f} m  {bearing:03d} {wind:<2}"
        return f"{clock(self.begins_s):>8}{far}  {self.phrase}"


def directions(network: RoadNetwork, way: Way, leaves_s: Floats) -> list[Direction]:
    """Return a flight in words; one leg ends where the aircraft rests or leaves its street.

    Parameters
    ----------
    network
        With a projection: bearings are those of the Earth.
    leaves_s
        (W,) seconds on the target's clock.
    """
    at_home = np.flatnonzero(np.all(way.xy_m == way.xy_m[0], axis=1)).tolist()
    found = []
    for a, b in way.legs:
        east_m, north_m = (way.xy_m[b] - way.xy_m[a]).tolist()
        north_deg = float(grid_convergence_deg(network, way.xy_m[a]))
        street = way.streets[b - 1]
        names = [crossed(network, place, street, AT_M) for place in way.xy_m[[a, b]]]
        length_m = float(np.hypot(*np.diff(way.xy_m[a : b + 1], axis=0).T).sum())
        bearing_deg = (degrees(atan2(east_m, north_m)) + north_deg) % 360.0
        phrase = _phrase(street, *names, home=not street and b in at_home)
        found.append(Direction(phrase, length_m, bearing_deg, float(leaves_s[a])))
    return found


def _phrase(street: str, start: str, end: str, *, home: bool) -> str:
    if home:
        return "straight home"
    if not street:
        return f"straight to {end}" if end else "straight on"
    begins = f", from {start}" if start else ""
    return f"{street}{begins}{f' towards {end}' if end and end != start else ''}"
