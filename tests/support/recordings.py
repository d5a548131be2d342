"""Recorded flights, made up: the same points in each format that is read."""

import struct
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import NamedTuple

from pymavlink.dialects.v20 import ardupilotmega

SEEN = datetime(2026, 5, 1, 12, 5, tzinfo=UTC)


class Point(NamedTuple):
    """Where an aircraft was."""

    time_s: float  # after it was seen
    lat: float
    lon: float
    height_m: float

    @property
    def utc(self) -> str:
        moment = SEEN + timedelta(seconds=self.time_s)
        return moment.isoformat(timespec="milliseconds").replace("+00:00", "Z")

    @property
    def since_1970_s(self) -> float:
        return (SEEN + timedelta(seconds=self.time_s)).timestamp()


FLIGHT = tuple(
    Point(100.0 + 2.0 * k, 52.43 + 1e-4 * k, 13.52 + 2e-4 * k, 34.0 + min(20.0 * k, 100.0))
    for k in range(9)
)


def gpx(segments: Sequence[Sequence[Point]], *, namespace: str = "GPX/1/1") -> str:
    lines = [f'<gpx xmlns="http://www.topografix.com/{namespace}" version="1.1" creator="phone">']
    lines += ['<wpt lat="0" lon="0"><name>car park</name></wpt><rte><rtept lat="1" lon="1"/></rte>']
    lines.append("<trk><name>&lt;b&gt;</name>")
    for points in segments:
        lines.append("<trkseg>")
        lines += [
            f'<trkpt lat="{p.lat}" lon="{p.lon}"><ele>{p.height_m}</ele><time>{p.utc}</time>'
            "</trkpt>"
            for p in points
        ]
        lines.append("</trkseg>")
    return "\n".join([*lines, "</trk></gpx>", ""])


def table(points: Sequence[Point], separator: str = ",") -> str:
    rows = [("UTC", "Latitude", "Longitude", "altitude", "battery")]
    rows += [(p.utc, str(p.lat), str(p.lon), str(p.height_m), "full") for p in points]
    return "\n".join(separator.join(row) for row in rows) + "\n"


def fcd(points: Sequence[tuple[float, float, float]], name: str = "uav") -> str:
    """Of seconds, x and y."""
    steps = [
        f'<timestep time="{t}"><vehicle id="{name}" x="{x}" y="{y}" speed="1" pos="0" lane=""/>'
        "</timestep>"
        for t, x, y in points
    ]
    return "\n".join(["<fcd-export>", *steps, "</fcd-export>", ""])


def write_tlog(path: Path, points: Sequence[Point]) -> None:
    """Of two aircraft, the first of which has no fix at first."""
    first, other = (ardupilotmega.MAVLink(None, srcSystem=number) for number in (1, 2))
    parts = [_position(first, points[0]._replace(lat=0.0, lon=0.0))]
    for point in points:
        parts += [_position(first, point), _position(other, point._replace(lat=-33.0))]
    path.write_bytes(b"".join(parts))


def _position(link: ardupilotmega.MAVLink, point: Point) -> bytes:
    lat, lon = round(1e7 * point.lat), round(1e7 * point.lon)
    height_mm = round(1000 * point.height_m)
    message = link.global_position_int_encode(0, lat, lon, height_mm, height_mm, 0, 0, 0, 0)
    return struct.pack(">Q", round(1e6 * point.since_1970_s)) + bytes(message.pack(link))


def write_bin(path: Path, points: Sequence[Point]) -> None:
    """ArduPilot's memory: its formats, a fix with the time of day, and positions."""
    formats = {
        128: ("FMT", "BBnNZ", "Type,Length,Name,Format,Columns", "<BB4s16s64s"),
        130: ("GPS", "QBIHLLe", "TimeUS,Status,GMS,GWk,Lat,Lng,Alt", "<QBIHiii"),
        131: ("POS", "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt", "<Qiifff"),
    }

    def message(kind: int, *values: object) -> bytes:
        return bytes((0xA3, 0x95, kind)) + struct.pack(formats[kind][3], *values)

    parts = [
        message(128, kind, 3 + struct.calcsize(code), name.encode(), kinds.encode(), names.encode())
        for kind, (name, kinds, names, code) in formats.items()
    ]
    since_1980_s = points[0].since_1970_s - datetime(1980, 1, 6, tzinfo=UTC).timestamp() + 18
    week, second = divmod(since_1980_s, 7 * 86400)
    start_us = 5_000_000
    parts.append(message(130, start_us, 3, round(1000 * second), int(week), 1, 1, 0))
    for point in points:
        us = start_us + round(1e6 * (point.time_s - points[0].time_s))
        lat, lon, height_m = round(1e7 * point.lat), round(1e7 * point.lon), point.height_m
        parts.append(message(131, us, lat, lon, height_m, height_m, height_m))
    path.write_bytes(b"".join(parts))
