"""All formats of a flight: the names of their files, and who writes them."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.arrays import Floats
from planner.errors import InputError
from planner.export.flight_file import Fix, FlightFile
from planner.export.from_run import RunFlight
from planner.export.mavlink import Autopilot, Frame, Ring, plan_file, waypoints_file
from planner.export.tables import csv_table, fcd, geojson
from planner.export.xml_maps import gpx, kml
from planner.messages import suggestion
from planner.network.georeference import lonlat

FILES = {
    "plan": "flight.plan",
    "waypoints": "flight.waypoints",
    "kml": "flight.kml",
    "gpx": "flight.gpx",
    "geojson": "flight.geojson",
    "csv": "flight.csv",
    "fcd": "flight.fcd.xml",
}
ABOUT = "flight.txt"
ARDUPILOT_ONLY = "waypoints"  # PX4 would take its first line for a waypoint at sea level
MAPS: dict[str, Callable[[FlightFile], str]] = {
    "kml": kml,
    "geojson": geojson,
    "csv": csv_table,
}


@dataclass(frozen=True)
class Wanted:
    """Which files, and for whom."""

    formats: tuple[str, ...]  # of `FILES`
    autopilot: Autopilot = "ardupilot"
    frame: Frame = "relative"

    @classmethod
    def of(cls, names: str | None, autopilot: Autopilot, frame: Frame) -> "Wanted":
        """Return what a list with commas names; None: all that the autopilot takes.

        Raises
        ------
        InputError
            If there is no such format, or the autopilot does not take it.
        """
        if names is None:
            unfit = {ARDUPILOT_ONLY} if autopilot == "px4" else set()
            return cls(tuple(name for name in FILES if name not in unfit), autopilot, frame)
        given = [name.strip() for name in names.split(",")]
        for name in given:
            if name not in FILES:
                raise InputError(f"--format {name}: is not a format; {suggestion(name, FILES)}")
        if ARDUPILOT_ONLY in given and autopilot == "px4":
            raise InputError(
                "--format waypoints: is for ArduPilot only; PX4 would fly to sea level; leave it "
                "out, and give it the .plan"
            )
        return cls(tuple(name for name in FILES if name in given), autopilot, frame)


def texts(run: RunFlight, wanted: Wanted) -> dict[str, str]:
    """Return the text of each file that is wanted, by its name."""
    return {FILES[name]: _text(name, run, wanted) for name in wanted.formats}


def _text(name: str, run: RunFlight, wanted: Wanted) -> str:
    if name == "plan":
        fence, no_fly = rings(run)
        return plan_file(
            run.flight, autopilot=wanted.autopilot, frame=wanted.frame, fence=fence, no_fly=no_fly
        )
    if name == "waypoints":
        return waypoints_file(run.flight, frame=wanted.frame)
    if name == "gpx":
        return gpx(run.flight, fixes(run))
    if name == "fcd":
        return fcd(run.flight, run.track)
    return MAPS[name](run.flight)


def fixes(run: RunFlight, *, step_s: float = 1.0) -> list[Fix]:
    """Return where the aircraft is at every step, from lift-off to the end of its flight."""
    track, height_m = run.track, run.flight.height_m
    first_s, last_s = float(track.time_s[0]), track.end_s
    up_s, down_s = float(track.sensor_on[0, 0]), float(track.sensor_on[-1, 1])
    times_s = np.unique([*np.arange(first_s, last_s, step_s), up_s, down_s, last_s])
    lon_deg, lat_deg = lonlat(run.network, track.xy(times_s)).T
    # It climbs above the first place and comes down at the last one, unless it does so at once.
    profile = {first_s: 0.0, last_s: 0.0, up_s: height_m, down_s: height_m}
    heights_m = np.interp(times_s, sorted(profile), [profile[one] for one in sorted(profile)])
    columns = (times_s.tolist(), lat_deg.tolist(), lon_deg.tolist(), heights_m.tolist())
    return [Fix(*row) for row in zip(*columns, strict=True)]


def rings(run: RunFlight) -> tuple[list[Ring], list[Ring]]:
    """Return what to stay within and what to stay out of, as rings of latitude and longitude.

    Autopilots stay within all areas at once, so of a fence in parts there is only the part that is
    flown; a hole in it is to stay out of. Holes of no-fly areas are flown around as well.
    """
    import shapely

    if run.airspace is None:
        return [], []
    home = shapely.Point(run.flight.waypoints[0].x_m, run.flight.waypoints[0].y_m)
    parts: Collection[Any] = shapely.get_parts(run.airspace.fence)
    around = [part for part in parts if part.covers(home)]
    out = [*(hole for part in around for hole in part.interiors)]
    if run.airspace.no_fly is not None:
        out += [part.exterior for part in shapely.get_parts(run.airspace.no_fly)]
    return [_ring(run, part.exterior) for part in around], [_ring(run, line) for line in out]


def _ring(run: RunFlight, line: Any) -> Ring:
    corners: Floats = np.array(line.coords, dtype=np.float64)[:-1, :2]
    return [(lat, lon) for lon, lat in lonlat(run.network, corners).tolist()]
