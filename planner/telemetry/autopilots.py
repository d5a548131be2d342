"""Logs of MAVLink autopilots: a ground station's ``.tlog``, and ``.bin`` of ArduPilot's memory."""

import contextlib
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from planner.errors import InputError
from planner.guard import opened
from planner.telemetry.log import LARGEST, TrackLog, log_of

REMEDY = "pip install pymavlink"
EARLIEST_UTC_S = 1e9  # in 2001; a smaller number counts from when the autopilot was switched on
PLACES = {".tlog": "GLOBAL_POSITION_INT", ".bin": "POS"}
DEGREE, METRE = 1e7, 1e3  # of .tlog; .bin has degrees and metres


def read_autopilot(path: Path) -> TrackLog:
    """Return where the first autopilot of a log was; heights are above where it was armed.

    Raises
    ------
    InputError
        If pymavlink is not installed, or the file is no such log.
    """
    try:
        from pymavlink import mavutil
    except ImportError as error:
        raise InputError(
            f"{path}: pymavlink reads such logs, and it is not installed; {REMEDY}"
        ) from error
    with opened(path) as file:
        if file.seek(0, io.SEEK_END) > LARGEST:
            raise InputError(
                f"{path}: holds more than {LARGEST >> 20} MB; cut the flight out of it"
            )
    try:
        # It prints what it cannot make sense of.
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            rows = [*_points(mavutil, path)]
    except MemoryError:
        raise
    except Exception as error:  # whatever strange bytes make of it
        raise InputError(
            f"{path}: is no log of an autopilot ({type(error).__name__}); copy it again, or give "
            "the flight as GPX or CSV"
        ) from error
    return log_of(path, "position", rows)


def _points(mavutil: Any, path: Path) -> Iterator[dict[str, float]]:
    kind = PLACES[path.suffix.lower()]
    log = mavutil.mavlink_connection(str(path), dialect="ardupilotmega", notimestamps=False)
    try:
        number, who = 0, None
        while (message := log.recv_match(type=kind)) is not None:
            sender = message.get_srcSystem() if kind != "POS" else 0
            who = sender if who is None else who
            lon, lat, height_m = _place(message)
            if sender != who or (lon == 0.0 and lat == 0.0):  # another one, or no fix yet
                continue
            number += 1
            clock = "utc_s" if message._timestamp >= EARLIEST_UTC_S else "time_s"
            yield {
                "number": number,
                "begins": number == 1,
                clock: float(message._timestamp),
                "lon_deg": lon,
                "lat_deg": lat,
                "height_m": height_m,
            }
    finally:
        log.close()


def _place(message: Any) -> tuple[float, float, float]:
    """Return longitude and latitude, degrees, and the height above home, metres."""
    if message.get_type() == "POS":
        return message.Lng, message.Lat, message.RelHomeAlt
    return message.lon / DEGREE, message.lat / DEGREE, message.relative_alt / METRE
