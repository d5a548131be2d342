"""True vehicles in files of a user's: SUMO's FCD, recorded futures, or the track of a GPS."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from planner.arrays import Floats
from planner.clock import clock
from planner.errors import InputError
from planner.futures.futures import Futures
from planner.futures.plausible import SearchTime, check_motion, motion_of_futures
from planner.futures.store import read_recording
from planner.futures.truncate import begun_at
from planner.mission.opening import OpenScenario
from planner.telemetry.log import TrackLog
from planner.telemetry.places import xy_of_log
from planner.telemetry.read import read_log
from planner.telemetry.texts import first_line

DAY_S = 86_400.0
OF_FCD = "timestep_time"  # the column that SUMO's CSV has

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Days:
    """When time 0 of the search is in each file, and when it ends."""

    begin_s: float | None  # on the files' clocks, for times of day since midnight; None: as below
    sighted_at: datetime | None  # whose time of day counts, on each day; None: nobody said
    horizon_s: float


def read_truths(
    paths: Sequence[Path], opened: OpenScenario, *, begin_s: float | None = None
) -> list[Futures]:
    """Return the true vehicles of files, a day each; a GPS's file holds one.

    Parameters
    ----------
    begin_s
        Time 0 of the search on the files' clocks, seconds; of times of day, since midnight in the
        offset of ``target.sighted_at``, or else in UTC. None: time 0 of the file, or the time of
        day of ``target.sighted_at``.

    Raises
    ------
    InputError
        If a file cannot be read, or what it holds cannot be.
    """
    scenario, network = opened.scenario, opened.network
    days = Days(begin_s, scenario.target.sighted_at, scenario.search.horizon_s)
    found = []
    for path in paths:
        if is_gps(path):
            found.append(_of_gps(read_log(path), opened, days))
        else:
            given = {"begin_s": begin_s, "horizon_s": days.horizon_s}
            found.append(read_recording(path, network, **given).futures)
    return found


def is_gps(path: Path) -> bool:
    """Return whether a file is the track of one vehicle: GPX, or CSV that is not SUMO's."""
    suffixes = [suffix.lower() for suffix in path.suffixes if suffix.lower() != ".gz"]
    if suffixes[-1:] == [".csv"]:
        return path.is_file() and OF_FCD not in first_line(path)
    return suffixes[-1:] == [".gpx"]


def _of_gps(track: TrackLog, opened: OpenScenario, days: Days) -> Futures:
    """Return the one vehicle of a recording; between two points it drives straight and evenly."""
    xy_m = xy_of_log(track, opened.network, opened.network.node_xy_m)
    time_s = _since_zero_s(track, days)
    falls = np.diff(time_s) <= 0.0
    if falls.any():
        raise InputError(
            f"{track.at(int(np.argmax(falls)) + 1)}: is not later than the point before; give "
            "each vehicle a file of its own, its points in order"
        )
    if time_s[-1] <= 0.0 or time_s[0] >= days.horizon_s:
        raise InputError(
            f"{track.path}: is from {clock(time_s[0])} to {clock(time_s[-1])} of the search, which "
            f"is from 0:00:00 to {clock(days.horizon_s)}; say when its time 0 was: --begin"
        )
    if time_s[0] > 0.0:
        log.warning("%s: begins at %s; before, it is nowhere", track.path, clock(time_s[0]))
    if time_s[-1] < days.horizon_s:
        log.warning(
            "%s: ends at %s, before the search; the vehicle is taken to stand there",
            track.path,
            clock(time_s[-1]),
        )
    rows = np.array([0, len(time_s)])
    x_m, y_m = xy_m.T
    futures = Futures(time_s, x_m, y_m, rows, np.ones(1), np.zeros(1, bool))
    search = SearchTime(0.0, days.horizon_s)
    motion = motion_of_futures(futures, (track.path.name,))
    check_motion(track.path, motion, opened.network, search)
    return begun_at(futures, 0.0)


def _since_zero_s(track: TrackLog, days: Days) -> Floats:
    """Return the times of points in seconds from time 0 of the search."""
    times_s, of_day = track.times(of_day=days.begin_s is not None or days.sighted_at is not None)
    if not of_day:
        return times_s - (days.begin_s or 0.0)
    seen, offset_s = days.sighted_at, 0.0
    if seen is not None:
        offset = seen.utcoffset()
        offset_s = 0.0 if offset is None else offset.total_seconds()
    if days.begin_s is not None:
        after_s = days.begin_s
    elif seen is not None:
        after_s = (seen.timestamp() + offset_s) % DAY_S
    else:
        raise InputError(
            f"{track.path}: has times of day, and nobody says at which the target was last seen; "
            "give --begin H:M:S, in UTC, or target.sighted_at"
        )
    midnight_s = DAY_S * np.floor((times_s[0] + offset_s) / DAY_S) - offset_s
    return np.asarray(times_s - (midnight_s + after_s))
