"""Which reader a recording takes: by its suffix, or by what it begins with."""

from pathlib import Path

from planner.errors import InputError
from planner.futures.fcd_formats import Rows, read_rows
from planner.telemetry.autopilots import PLACES, read_autopilot
from planner.telemetry.log import TrackLog, log_of
from planner.telemetry.texts import first_line, read_csv, read_gpx
from planner.xml_guard import kind_of_xml

KNOWN = "give GPX, CSV, SUMO's FCD, or an autopilot's .tlog or .bin"


def read_log(path: Path) -> TrackLog:
    """Return a recorded flight: GPX, CSV, FCD (these three gzipped, too), ``.tlog`` or ``.bin``.

    Raises
    ------
    InputError
        If it is missing, or is none of these.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; {KNOWN}")
    suffixes = [suffix.lower() for suffix in path.suffixes if suffix.lower() != ".gz"]
    suffix = suffixes[-1] if suffixes else ""
    if suffix in PLACES:
        return read_autopilot(path)
    if suffix == ".csv":
        is_fcd = "timestep_time" in first_line(path)
        return _of_fcd(path, read_rows(path)) if is_fcd else read_csv(path)
    if suffix == ".parquet":
        return _of_fcd(path, read_rows(path))
    root = "gpx" if suffix == ".gpx" else (kind_of_xml(path) or "").rpartition(":")[2]
    if root == "gpx":
        return read_gpx(path)
    if root == "fcd-export":
        return _of_fcd(path, read_rows(path))
    raise InputError(f"{path}: is no recorded flight that is known here; {KNOWN}")


def _of_fcd(path: Path, rows: Rows) -> TrackLog:
    """Return the one vehicle of floating car data."""
    names = [rows.vehicle.values[code] for code in sorted({*rows.vehicle.code.tolist()})]
    if len(names) > 1:
        raise InputError(
            f"{path}: holds {len(names)} vehicles, {names[0]!r} and {names[1]!r} among them; leave "
            "the aircraft alone in it"
        )
    columns = zip(rows.time_s.tolist(), rows.x_m.tolist(), rows.y_m.tolist(), strict=True)
    points = [
        {"number": k, "begins": k == 1, "time_s": time_s, "x_m": x_m, "y_m": y_m}
        for k, (time_s, x_m, y_m) in enumerate(columns, 1)
    ]
    return log_of(path, "vehicle", points)
