"""Two flights of one mission that an autopilot flew in its simulator."""

import gzip
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pyproj import Proj

from planner.arrays import Floats

FOLDER = Path(__file__).parents[1] / "flight" / "recordings"
HEIGHT_M = 98.0  # from here on it flies to the first waypoint
NEAR_M = 12.0  # of a waypoint; where it begins to go away again, it has been there


class Mission(NamedTuple):
    """The waypoints in order."""

    xy_m: Floats  # (W, 2) metres
    reached_s: Floats  # (W,) seconds, as the autopilot told at 15 m/s


def mission() -> Mission:
    """Return the mission that both flights flew."""
    lat, lon, reached_s = np.loadtxt(FOLDER / "waypoints.csv", delimiter=",", skiprows=1).T
    return Mission(_metres(lat, lon), reached_s)


def reached_s(flight: str, xy_m: Floats) -> Floats:
    """Return when a recorded flight was nearest to each waypoint, in order, (W,) seconds."""
    with gzip.open(FOLDER / f"{flight}.csv.gz", "rt") as file:
        time_s, lat, lon, height_m, *_ = np.loadtxt(file, delimiter=",", skiprows=1).T
    flown, now, found = _metres(lat, lon), int(np.argmax(height_m > HEIGHT_M)), []
    for place in xy_m:
        away_m = np.hypot(*(flown[now:] - place).T)
        at = int(np.argmax(away_m < NEAR_M))
        while at + 1 < len(away_m) and away_m[at + 1] <= away_m[at]:
            at += 1
        now += at
        found.append(float(time_s[now]))
    return np.array(found)


def _metres(lat: Floats, lon: Floats) -> Floats:
    return np.stack(Proj(proj="tmerc", lat_0=52.43, lon_0=13.52)(lon, lat), axis=1)
