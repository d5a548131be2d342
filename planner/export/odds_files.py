"""Where the target is before, during and after a flight: for maps, and for SUMO's own viewer."""

import re
from collections.abc import Iterator
from math import ceil
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from planner.arrays import Floats
from planner.export.odds import Odds
from planner.messages import plain
from planner.network.georeference import lonlat
from planner.network.street_names import street_names

DEGREES = 7
DIGITS = 6  # of a probability
INTERVAL_S = 60.0  # for which odds per edge are told


def odds_features(odds: Odds) -> Iterator[dict[str, Any]]:
    """Yield features of GeoJSON: roads with what a flight does for them, and clouds of targets.

    Roads have the words of search theory: the probability of containment (POC) before and after,
    of detection (POD), and of success (POS).
    """
    columns: dict[str, Floats] = odds.roads._asdict()
    columns = {key: np.round(column, DIGITS) for key, column in columns.items()}
    streets = street_names(odds.network).road
    for road in np.flatnonzero(columns["poc_before"] + columns["poc_after"]).tolist():
        said: dict[str, Any] = {
            "kind": "road",
            "road": odds.network.road_ids[road],
            "street": streets[road],
        }
        figures = {key: float(column[road]) for key, column in columns.items()}
        yield _feature(
            f"road{road}",
            said | figures,
            "LineString",
            _degrees(odds, odds.network.shape(road)),
        )
    for name, time_s in (("before", odds.from_s), ("after", odds.to_s)):
        cloud = odds.cloud(time_s)
        said = {
            "kind": "targets not found",
            "when": name,
            "time_s": round(time_s, 2),
            "weight": np.round(cloud.weight, DIGITS).tolist(),
        }
        yield _feature(f"targets_{name}", said, "MultiPoint", _degrees(odds, cloud.xy_m))


def edgedata(odds: Odds) -> str:
    """Return the odds as SUMO's data of edges, for ``sumo-gui --edgedata-files``.

    ``sampledSeconds`` are the seconds in an interval that the target is expected to be on an edge
    and not found, ``occupancy`` is the probability of that, in percent.
    """
    root = ET.Element("meandata")
    if odds.network.attribution:
        # Two hyphens would end the comment.
        root.append(ET.Comment(f" {re.sub('-(?=-)', '- ', plain(odds.network.attribution))} "))
    for number in range(max(1, ceil(odds.to_s / INTERVAL_S))):
        begin_s = number * INTERVAL_S
        end_s = begin_s + INTERVAL_S
        times = {"begin": f"{begin_s:.2f}", "end": f"{end_s:.2f}", "id": "not found"}
        interval = ET.SubElement(root, "interval", times)
        seconds = odds.on_edges(begin_s, end_s)
        for edge in np.flatnonzero(np.round(seconds, DIGITS)).tolist():
            told = {
                "sampledSeconds": f"{seconds[edge]:.{DIGITS}f}",
                "occupancy": f"{100.0 * seconds[edge] / INTERVAL_S:.{DIGITS}f}",
            }
            ET.SubElement(interval, "edge", {"id": odds.network.edge_ids[edge]} | told)
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _degrees(odds: Odds, xy_m: Floats) -> list[list[float]]:
    return [[round(one, DEGREES) for one in place] for place in lonlat(odds.network, xy_m).tolist()]


def _feature(name: str, said: dict[str, Any], shape: str, places: list[Any]) -> dict[str, Any]:
    geometry = {"type": shape, "coordinates": places}
    return {"type": "Feature", "id": name, "properties": said, "geometry": geometry}
