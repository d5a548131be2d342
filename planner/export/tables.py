"""Flights for everybody else: GeoJSON, CSV, and SUMO's floating car data."""

import csv
import io
import json
import re
from collections.abc import Iterable
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from planner.export.flight_file import FlightFile, Waypoint
from planner.flight.track import Track
from planner.messages import plain

DEGREES = 7
COLUMNS = ("number", "time_s", "utc", "lat", "lon", "x_m", "y_m", "height_m", "hold_s", "leg_m")
FORMULA = ("=", "+", "-", "@", "\t", "\r")  # a cell that begins so is one to spreadsheets


def geojson(flight: FlightFile, more: Iterable[dict[str, Any]] = ()) -> str:
    """Return a flight as GeoJSON: its line, and its waypoints with their times.

    Parameters
    ----------
    more
        Features that are written after these.
    """
    features = [
        {
            "type": "Feature",
            "id": "flight",
            "properties": {"kind": "flight", "name": flight.name},
            "geometry": {
                "type": "LineString",
                "coordinates": [_position(flight, one) for one in flight.waypoints],
            },
        },
        *(_point(flight, number, one) for number, one in enumerate(flight.waypoints)),
        *more,
    ]
    content: dict[str, Any] = {"type": "FeatureCollection", "features": features}
    if flight.attribution:
        content["attribution"] = flight.attribution
    return json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def csv_table(flight: FlightFile) -> str:
    """Return a flight as a table, one row for each waypoint."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow([*COLUMNS, "street"])
    lengths_m = [0.0, *flight.lengths_m]
    for number, (one, leg_m) in enumerate(zip(flight.waypoints, lengths_m, strict=True)):
        rows.writerow(
            [
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
    return text.getvalue()


def fcd(flight: FlightFile, track: Track | None = None, *, step_s: float = 1.0) -> str:
    """Return a flight as SUMO's floating car data: where the aircraft is at every step.

    Parameters
    ----------
    track
        How it flies; None: evenly from waypoint to waypoint.
    """
    if track is None:
        times_s = np.array([time_s for _, time_s in flight.stays])
        places = np.array([(one.x_m, one.y_m) for one, _ in flight.stays])
    else:
        times_s, places = track.time_s, np.stack([track.x_m, track.y_m], axis=1)
    first, last = np.ceil(times_s[0] / step_s), np.floor(times_s[-1] / step_s)
    steps_s = np.arange(first, last + 1) * step_s
    x_m, y_m = (np.interp(steps_s, times_s, column) for column in places.T)
    east, north = (np.diff(column, append=column[-1]) / step_s for column in (x_m, y_m))
    angle = np.degrees(np.arctan2(east, north)) % 360.0  # from north, clockwise
    root = ET.Element("fcd-export")
    if flight.attribution:
        # Two hyphens would end the comment.
        root.append(ET.Comment(f" {re.sub('-(?=-)', '- ', plain(flight.attribution))} "))
    for row in zip(steps_s, x_m, y_m, np.hypot(east, north), angle, strict=True):
        time_s, x, y, mps, degrees = (f"{value:.2f}" for value in row)
        step = ET.SubElement(root, "timestep", time=time_s)
        seen = {"id": "uav", "x": x, "y": y, "angle": degrees, "type": "uav", "speed": mps}
        ET.SubElement(step, "vehicle", seen | {"pos": "0.00", "lane": "", "slope": "0.00"})
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


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
