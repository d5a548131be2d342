"""Traffic assignment zones from SUMO's additional files."""

import math
from dataclasses import dataclass, field
from pathlib import Path

from planner.errors import InputError
from planner.guard import xml_elements
from planner.messages import as_written, suggestion


@dataclass
class Zone:
    """What a file says of a zone."""

    starts: dict[str, float] = field(default_factory=dict)  # edges and their weights
    goals: dict[str, float] = field(default_factory=dict)
    corners: tuple[tuple[float, float], ...] = ()  # metres; of a zone that names no edges


def read_zone(path: Path, name: str) -> Zone:
    """Return a zone; edges weigh 1 each where the file gives no weights, as SUMO has it.

    Raises
    ------
    InputError
        If there is no such file or zone, or it holds neither edges nor a shape.
    """
    zones: dict[str, Zone] = {}
    starts: dict[str, float] = {}
    goals: dict[str, float] = {}
    for element in xml_elements(path):
        tag, said = element.tag.rpartition("}")[2], element.attrib
        if tag in ("tazSource", "tazSink"):
            ends = starts if tag == "tazSource" else goals
            ends[said.get("id", "")] = _weight(path, said)
        elif tag == "taz":
            named = dict.fromkeys(said.get("edges", "").split(), 1.0)
            shape = _corners(path, said.get("shape", ""))
            zone = Zone(starts or named or goals, goals or named or starts, shape)
            zones[said.get("id", "")] = zone
            starts, goals = {}, {}
    if name not in zones:
        if not zones:
            raise InputError(f"{path}: holds no taz; give a SUMO additional file")
        raise InputError(f"{path}: holds no taz {name}; {suggestion(name, list(zones))}")
    zone = zones[name]
    if not zone.starts and not zone.corners:
        raise InputError(f"{path}: the taz {name} holds neither edges nor a shape; add edges to it")
    return zone


def _weight(path: Path, said: dict[str, str]) -> float:
    text = said.get("weight", "1")
    try:
        weight = float(text)
    except ValueError:
        weight = math.nan
    if not 0 <= weight < 1e15:
        raise InputError(
            f"{path}: the weight {as_written(text)} of edge {said.get('id', '')} is none; "
            "give a number from 0 on"
        )
    return weight


def _corners(path: Path, text: str) -> tuple[tuple[float, float], ...]:
    corners = []
    for point in text.split():
        try:
            x_m, y_m = map(float, point.split(",")[:2])
        except ValueError:
            x_m = y_m = math.nan
        if not (math.isfinite(x_m) and math.isfinite(y_m)):
            raise InputError(f"{path}: {as_written(point)} is no point of a shape; give x,y")
        corners.append((x_m, y_m))
    return tuple(corners) if len(corners) > 2 else ()
