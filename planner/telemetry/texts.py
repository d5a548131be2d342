"""Recordings as text: GPX, and tables as CSV."""

import csv
import io
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from planner.clock import moment, seconds
from planner.errors import InputError
from planner.guard import read_text, unpacked
from planner.messages import as_written
from planner.parquet import refuse_twice
from planner.telemetry.log import LARGEST, TrackLog, log_of
from planner.xml_guard import xml_elements

# What columns are called, in small letters, by what they are. The first one that is there is taken.
NAMES = {
    "utc_s": ("utc", "datetime", "timestamp", "time"),
    "time_s": ("time_s", "t", "seconds"),
    "lat_deg": ("lat", "latitude", "lat_deg"),
    "lon_deg": ("lon", "longitude", "lng", "long", "lon_deg"),
    "x_m": ("x_m", "x"),
    "y_m": ("y_m", "y"),
    "height_m": ("height_m", "height", "alt", "alt_m", "altitude", "altitude_m", "ele"),
    "hold_s": ("hold_s",),
}
LONGEST_LINE = 10_000  # characters of a header
COLUMNS = "a table has columns such as utc (or time_s), lat, lon and height_m"
GPX_COLUMNS = {"lat": "lat_deg", "lon": "lon_deg", "ele": "height_m", "time": "utc_s"}
GPX = "a GPX track has <trkpt lat= lon=> with a <time> in each"


def read_gpx(path: Path) -> TrackLog:
    """Return the tracks of a GPX file as one; how it came to the first point of each is unknown.

    Routes and single waypoints have not been flown; they are passed over.

    Raises
    ------
    InputError
        If it is no GPX, or a point of a track is without a place.
    """
    return log_of(path, "trkpt", _gpx_points(path))


def _gpx_points(path: Path) -> Iterator[dict[str, float]]:
    number, begins = 0, True
    try:
        for element in xml_elements(path, LARGEST):
            kind = _local(element)
            if kind == "trkseg":
                begins = True
            elif kind == "trkpt":
                number += 1
                yield {
                    "number": number,
                    "begins": begins,
                    **_gpx_point(f"{path}: trkpt {number}", element),
                }
                begins = False
            if kind in ("trkpt", "trkseg", "rtept", "wpt"):
                element.clear()
    except InputError as error:
        known = str(error).startswith(f"{path}: trkpt")
        raise error if known else InputError(f"{error}; {GPX}") from error


def _gpx_point(where: str, element: Any) -> dict[str, float]:
    said = {_local(child): child.text or "" for child in element}
    said |= {key: element.get(key, "") for key in ("lat", "lon")}
    return {
        column: _value(f"{where}: {key}", said[key], _utc if key == "time" else float)
        for key, column in GPX_COLUMNS.items()
        if said.get(key, "").strip()
    }


def _local(element: Any) -> str:
    """Return the name of an element without its namespace; the root's version decides nothing."""
    return str(element.tag).rpartition("}")[2]


def read_csv(path: Path) -> TrackLog:
    """Return a table of points; with a column ``hold_s``, of waypoints.

    Columns are found by what they are called, in any order, between commas, semicolons or tabs.

    Raises
    ------
    InputError
        If it is no such table; the message names the line.
    """
    lines = csv.reader(
        io.StringIO(text := read_text(path, LARGEST), newline=""), delimiter=_separator(text)
    )
    try:
        header = [name.strip().lower() for name in next(lines, [])]
        refuse_twice(path, [name for name in header if name])
        column = _columns(path, header)
        rows = [*_csv_points(path, lines, header, column)]
    except csv.Error as error:
        raise InputError(
            f"{path}: line {lines.line_num}: is no CSV ({error}); {COLUMNS}"
        ) from error
    return log_of(path, "line", rows, is_sampled="hold_s" not in column)


def first_line(path: Path) -> str:
    """Return how a text begins.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    with unpacked(path, LARGEST) as file:
        return file.readline(LONGEST_LINE).decode("utf-8", "replace")


def _separator(text: str) -> str:
    first = text[:LONGEST_LINE].partition("\n")[0]
    return max(",;\t", key=first.count)


def _columns(path: Path, header: Sequence[str]) -> dict[str, int]:
    """Return where each column is that is known; time and place are needed."""
    found = {
        name: header.index(next(one for one in called if one in header))
        for name, called in NAMES.items()
        if any(one in header for one in called)
    }
    placed = {"lat_deg", "lon_deg"} <= set(found) or {"x_m", "y_m"} <= set(found)
    if not placed or not {"utc_s", "time_s"} & set(found):
        lacks = "place" if not placed else "time"
        raise InputError(f"{path}: line 1: names no column with the {lacks}; {COLUMNS}")
    return found


def _csv_points(
    path: Path, lines: Any, header: Sequence[str], column: dict[str, int]
) -> Iterator[dict[str, float]]:
    begins = True
    for cells in lines:
        if not any(cell.strip() for cell in cells):
            continue
        where = f"{path}: line {lines.line_num}"
        point: dict[str, float] = {"number": lines.line_num, "begins": begins}
        for name, k in column.items():
            text = cells[k] if k < len(cells) else ""
            if text.strip():
                # "time" may be either of the two.
                kind = "time_s" if name == "utc_s" and _is_number(text) else name
                point[kind] = _value(f"{where}: {header[k]}", text, READS.get(kind, float))
        yield point
        begins = False


def _value(where: str, text: str, read: Callable[[str], float]) -> float:
    try:
        value = read(text)
    except (InputError, ValueError) as error:
        said = str(error) if isinstance(error, InputError) else _no_number(text)
        raise InputError(f"{where}: {said}") from error
    if not abs(value) < float("inf"):
        raise InputError(f"{where}: {_no_number(text)}")
    return value


def _no_number(text: str) -> str:
    return f"{as_written(text.strip())} is no finite number; correct it, or leave the point out"


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _utc(text: str) -> float:
    return moment(text).timestamp()


READS: dict[str, Callable[[str], float]] = {"utc_s": _utc, "time_s": seconds}
