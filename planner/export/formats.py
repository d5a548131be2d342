"""All formats of a flight: the names of their files, and who writes them."""

import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner.arrays import Floats
from planner.errors import InputError
from planner.export.flight_file import FlightFile
from planner.export.from_run import RunFlight
from planner.export.mavlink import Autopilot, Frame, Ring, plan_file, waypoints_file
from planner.export.odds import Odds
from planner.export.odds_files import edgedata, odds_features
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
    "edgedata": "flight.edgedata.xml",
}
SPLIT = ("plan", "waypoints")  # what autopilots load, and may be in parts: flight-1.plan and so on
ABOUT = "flight.txt"
FOLDER = "flight"  # in the run's
ARDUPILOT_ONLY = "waypoints"  # PX4 would take its first line for a waypoint at sea level
PART = re.compile(r"flight(-uav\d+(\.\d+)?)?(-\d+)?\.\w+")
MAPS: dict[str, Callable[[Sequence[FlightFile]], str]] = {"kml": kml, "gpx": gpx, "csv": csv_table}


@dataclass(frozen=True)
class Wanted:
    """Which files, and for whom."""

    formats: tuple[str, ...]  # of `FILES`
    autopilot: Autopilot = "ardupilot"
    frame: Frame = "relative"
    part: int | None = None  # most waypoints of a file for autopilots; None: all in one

    @classmethod
    def of(
        cls, names: str | None, autopilot: Autopilot, frame: Frame, part: int | None = None
    ) -> "Wanted":
        """Return what a list with commas names; None: all that the autopilot takes.

        Raises
        ------
        InputError
            If there is no such format, or the autopilot does not take it.
        """
        if part is not None and part < 2:
            raise InputError("--max-waypoints: a part has two at least; give 2 or more")
        if names is None:
            unfit = {ARDUPILOT_ONLY} if autopilot == "px4" else set()
            return cls(tuple(name for name in FILES if name not in unfit), autopilot, frame, part)
        given = [name.strip() for name in names.split(",")]
        for name in given:
            if name not in FILES:
                raise InputError(f"--format {name}: is not a format; {suggestion(name, FILES)}")
        if ARDUPILOT_ONLY in given and autopilot == "px4":
            raise InputError(
                "--format waypoints: is for ArduPilot only; PX4 would fly to sea level; leave it "
                "out, and give it the .plan"
            )
        return cls(tuple(name for name in FILES if name in given), autopilot, frame, part)

    def parts(self, flight: FlightFile) -> list[FlightFile]:
        """Return a flight in the parts that autopilots load."""
        return [flight] if self.part is None else flight.parts(self.part)

    def files(self, flight: FlightFile) -> list[str]:
        """Return the names of the files that are written, `ABOUT` the last of them."""
        many = len(self.parts(flight))
        written = [_named(name, many) for name in self.formats]
        return [*(file for files in written for file in files), ABOUT]


def names_in(folder: Path) -> list[str]:
    """Return the names of all files that a flight may leave in a folder."""
    return [*FILES.values(), ABOUT, *_earlier_parts(folder)]


def names_in_run(run_folder: Path) -> list[str]:
    """Return the names of a flight's files in a run's folder: they are of no other plan."""
    return [f"{FOLDER}/{name}" for name in names_in(run_folder / FOLDER)]


def _earlier_parts(folder: Path) -> list[str]:
    """Return the names of parts that an earlier flight has left in a folder."""
    suffixes = [Path(FILES[name]).suffix for name in SPLIT]
    found = [path.name for suffix in suffixes for path in folder.glob(f"flight-*{suffix}")]
    return sorted(name for name in found if PART.fullmatch(name))


def _named(name: str, many: int, whose: str = "") -> list[str]:
    file = FILES[name]
    if name not in SPLIT:
        return [file]
    file = file.replace(".", f"{whose}.", 1)
    if many == 1:
        return [file]
    stem, _, suffix = file.rpartition(".")
    return [f"{stem}-{number}.{suffix}" for number in range(1, many + 1)]


def texts(runs: Sequence[RunFlight], wanted: Wanted, odds: Odds) -> dict[str, str]:
    """Return the text of each file that is wanted, by its name.

    What an autopilot loads holds one flight; of several, each has files of its own. All others
    hold all flights.

    Parameters
    ----------
    odds
        What the flights make of fresh targets.
    """
    flights, found = [run.flight for run in runs], dict[str, str]()
    for name in wanted.formats:
        if name in SPLIT:
            for run in runs:
                whose, parts = "" if len(runs) == 1 else run.whose, wanted.parts(run.flight)
                mission = [_mission(name, part, run, wanted) for part in parts]
                found |= zip(_named(name, len(parts), whose), mission, strict=True)
        elif name == "geojson":
            found[FILES[name]] = geojson(flights, odds_features(odds))
        elif name == "fcd":
            found[FILES[name]] = fcd(flights, [run.track for run in runs])
        elif name == "edgedata":
            found[FILES[name]] = edgedata(odds)
        else:
            found[FILES[name]] = MAPS[name](flights)
    return found


def _mission(name: str, flight: FlightFile, run: RunFlight, wanted: Wanted) -> str:
    if name == "waypoints":
        return waypoints_file(flight, frame=wanted.frame)
    fence, no_fly = rings(run)
    return plan_file(
        flight, autopilot=wanted.autopilot, frame=wanted.frame, fence=fence, no_fly=no_fly
    )


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
