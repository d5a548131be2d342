"""Flights for everybody else: GeoJSON, CSV, and SUMO's floating car data."""

import csv
import io
import json
import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from operator import itemgetter
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from planner.arrays import Floats
from planner.export.flight_file import FlightFile, Waypoint
from planner.flight.track import Track
from planner.messages import plain

DEGREES = 7
COLUMNS = ("number", "time_s", "utc", "lat", "lon", "x_m", "y_m", "height_m", "hold_s", "leg_m")
FORMULA = ("=", "+", "-", "@", "\t", "\r")  # a cell that begins so is one to spreadsheets


def geojson(flights: Sequence[FlightFile], more: Iterable[dict[str, Any]] = ()) -> str:
    """Return flights as GeoJSON: their lines, and their waypoints with their times.

    Parameters
    ----------
    more
        Features that are written after these.
    """
    whose = [""] if len(flights) == 1 else [f"uav{number}." for number in range(len(flights))]
    each = [feature for one in zip(flights, whose, strict=True) for feature in _features(*one)]
    content: dict[str, Any] = {"type": "FeatureCollection", "features": [*each, *more]}
    if flights[0].attribution:
        content["attribution"] = flights[0].attribution
    return json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def _features(flight: FlightFile, whose: str) -> Iterator[dict[str, Any]]:
    """Yield the line of a flight and its waypoints, whose ids begin with its own."""
    yield {
        "type": "Feature",
        "id": f"{whose}flight",
        "properties": {"kind": "flight", "name": flight.name},
        "geometry": {
            "type": "LineString",
            "coordinates": [_position(flight, one) for one in flight.waypoints],
        },
    }
    for number, one in enumerate(flight.waypoints):
        point = _point(flight, number, one)
        yield {**point, "id": f"{whose}{point['id']}"}


def csv_table(flights: Sequence[FlightFile]) -> str:
    """Return flights as a table, one row for each waypoint; of several, first the flight's name."""
    text, several = io.StringIO(), len(flights) > 1
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow([*["flight"] * several, *COLUMNS, "street"])
    for flight in flights:
        _csv_rows(rows, flight, [cell(flight.name)] * several)
    return text.getvalue()


def _csv_rows(rows: Any, flight: FlightFile, first: list[str]) -> None:
    lengths_m = [0.0, *flight.lengths_m]
    for number, (one, leg_m) in enumerate(zip(flight.waypoints, lengths_m, strict=True)):
        rows.writerow(
            [
                *first,
                number,
                f"{one.arrives_s:.2f}",
                flight.utc(one.arrives_s) or "",
                f"{one.lat_deg:.{DEGREES}f}",
                f"{one.lon_deg:.{DEGREES}f}",
                f"{one.x_m:.2f}",
                f"{one.y_m:.2f}",
                f"{flight.height_m:.1f}",
                f"{one.hold_s:.1f}",
                f"{leg_m:.1f}",
                cell(one.street),
            ]
        )


def fcd(
    flights: Sequence[FlightFile], tracks: Sequence[Track] | None = None, *, step_s: float = 1.0
) -> str:
    """Return flights as SUMO's floating car data: where each aircraft is at every step.

    Parameters
    ----------
    tracks
        How they fly; None: evenly from waypoint to waypoint.
    """
    root = ET.Element("fcd-export")
    if flights[0].attribution:
        # Two hyphens would end the comment.
        root.append(ET.Comment(f" {re.sub('-(?=-)', '- ', plain(flights[0].attribution))} "))
    ways = [_even(flight) for flight in flights]
    if tracks is not None:
        ways = [(one.time_s, np.stack([one.x_m, one.y_m], axis=1)) for one in tracks]
    whose = ["uav"] if len(ways) == 1 else [f"uav{number}" for number in range(len(ways))]
    seen = [row for one in zip(whose, ways, strict=True) for row in _seen(*one, step_s=step_s)]
    for time_s, some in groupby(sorted(seen, key=itemgetter(0)), key=itemgetter(0)):
        step = ET.SubElement(root, "timestep", time=f"{time_s:.2f}")
        for _, vehicle in some:
            ET.SubElement(step, "vehicle", vehicle | {"pos": "0.00", "lane": "", "slope": "0.00"})
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _even(flight: FlightFile) -> tuple[Floats, Floats]:
    """Return when an aircraft that flies evenly is where, (T,) seconds and (T, 2) metres."""
    times_s = np.array([time_s for _, time_s in flight.stays])
    return times_s, np.array([(one.x_m, one.y_m) for one, _ in flight.stays])


def _seen(
    whose: str, way: tuple[Floats, Floats], *, step_s: float
) -> Iterator[tuple[float, dict[str, str]]]:
    """Yield each time at which an aircraft is seen, and as what."""
    times_s, places = way
    first, last = np.ceil(times_s[0] / step_s), np.floor(times_s[-1] / step_s)
    steps_s = np.arange(first, last + 1) * step_s
    x_m, y_m = (np.interp(steps_s, times_s, column) for column in places.T)
    east, north = (np.diff(column, append=column[-1]) / step_s for column in (x_m, y_m))
    angle = np.degrees(np.arctan2(east, north)) % 360.0  # from north, clockwise
    for time_s, *row in zip(steps_s, x_m, y_m, np.hypot(east, north), angle, strict=True):
        x, y, mps, degrees = (f"{value:.2f}" for value in row)
        vehicle = {"id": whose, "x": x, "y": y, "angle": degrees, "type": "uav", "speed": mps}
        yield float(time_s), vehicle


def cell(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula."""
    return f"'{text}" if text.startswith(FORMULA) else text


def _position(flight: FlightFile, one: Waypoint) -> list[float]:
    return [round(one.lon_deg, DEGREES), round(one.lat_deg, DEGREES), flight.height_m]


def _point(flight: FlightFile, number: int, one: Waypoint) -> dict[str, Any]:
    said = {
        "kind": "waypoint",
        "number": number,
        "time_s": round(one.arrives_s, 2),
        "hold_s": round(one.hold_s, 1),
        "street": one.street,
    }
    moment = flight.utc(one.arrives_s)
    return {
        "type": "Feature",
        "id": f"waypoint{number}",
        "properties": said if moment is None else said | {"utc": moment},
        "geometry": {"type": "Point", "coordinates": _position(flight, one)},
    }
