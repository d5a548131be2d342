"""Traffic assignment zones from SUMO's additional files."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from planner.errors import InputError
from planner.messages import as_written, suggestion
from planner.xml_guard import xml_elements

Attributes = Mapping[str, str]


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
        If there is no such file or zone, or it holds neither edges nor a shape. What is wrong with
        other zones does not matter.
    """
    zones: list[str] = []
    found: Zone | None = None
    ends: list[tuple[str, Attributes]] = []  # sources and sinks come before the zone that has them
    for element in xml_elements(path):
        tag, said = element.tag.rpartition("}")[2], element.attrib
        if tag in ("tazSource", "tazSink"):
            ends.append((tag, said))
        elif tag == "taz":
            zones.append(said.get("id", ""))
            if zones[-1] == name:
                found = _zone(f"{path}: the taz {name}", said, ends)
            ends = []
    if not zones:
        raise InputError(f"{path}: holds no taz; give a SUMO additional file")
    if found is None:
        raise InputError(f"{path}: holds no taz {name}; {suggestion(name, zones)}")
    return found


def _zone(where: str, said: Attributes, ends: Sequence[tuple[str, Attributes]]) -> Zone:
    named = dict.fromkeys(said.get("edges", "").split(), 1.0)
    starts, goals = (
        {end.get("id", ""): _weight(where, end) for tag, end in ends if tag == kind}
        for kind in ("tazSource", "tazSink")
    )
    shape = _corners(where, said.get("shape", ""))
    zone = Zone(starts or named or goals, goals or named or starts, shape)
    if not zone.starts and not zone.corners:
        raise InputError(f"{where} holds neither edges nor a shape; add edges to it")
    return zone


def _weight(where: str, said: Attributes) -> float:
    text = said.get("weight", "1")
    try:
        weight = float(text)
    except ValueError:
        weight = math.nan
    if not 0 <= weight < 1e15:
        raise InputError(
            f"{where} gives edge {said.get('id', '')} the weight {as_written(text)}; give a number "
            "from 0 on"
        )
    return weight


def _corners(where: str, text: str) -> tuple[tuple[float, float], ...]:
    corners = []
    for point in text.split():
        try:
            x_m, y_m = map(float, point.split(",")[:2])
        except ValueError:
            x_m = y_m = math.nan
        if not (math.isfinite(x_m) and math.isfinite(y_m)):
            raise InputError(f"{where}: {as_written(point)} is no point of a shape; give x,y")
        corners.append((x_m, y_m))
    return tuple(corners) if len(corners) > 2 else ()
