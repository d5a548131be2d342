"""A plan as something to look at in sumo-gui: an additional file of lines and numbers."""

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from planner.files import written_whole
from planner.flight.pieces import Piece, along, pieces
from planner.flight.plan import Plan
from planner.network.road_network import RoadNetwork

SCHEMA = "http://sumo.dlr.de/xsd/additional_file.xsd"
INSTANCE = "http://www.w3.org/2001/XMLSchema-instance"
ROAD_COLOUR = "213,94,0"
WAY_COLOUR = "0,114,178"
ABOVE_THE_ROADS = 100.0  # sumo-gui's layers: roads 0, vehicles 200


def write_overlay(path: Path, plan: Plan, network: RoadNetwork) -> None:
    """Write a plan's flights as ``.add.xml``, to be loaded beside the net (``sumo-gui -a``).

    Roads that the plan flies are thick lines with their order number, the ways between them
    thin ones. The times stand in each element's parameters.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    root = ElementTree.Element("additional")
    root.set("xmlns:xsi", INSTANCE)
    root.set("xsi:noNamespaceSchemaLocation", SCHEMA)
    if network.attribution:
        # Two hyphens would end the comment.
        said = re.sub("-(?=-)", "- ", network.attribution)
        root.append(ElementTree.Comment(f" {said} "))
    size_m = float(np.ptp(network.node_xy_m, axis=0).max())
    for uav, track in enumerate(plan.tracks):
        if len(track.time_s):
            _take_off(root, f"uav{uav}", track.xy(float(track.time_s[0])).tolist())
    for number, piece in enumerate(pieces(plan), 1):
        _line(root, piece, f"uav{piece.uav}.piece{number}", network, size_m)
        if piece.order:
            _number(root, piece)
    ElementTree.indent(root, "    ")
    with written_whole(path) as new:
        ElementTree.ElementTree(root).write(new, encoding="UTF-8", xml_declaration=True)


def _take_off(root: ElementTree.Element, uav: str, xy_m: list[float]) -> None:
    x_m, y_m = (f"{metres:.2f}" for metres in xy_m)
    ElementTree.SubElement(
        root,
        "poi",
        id=f"{uav}.take-off",
        type="take-off",
        name="take-off",
        color=WAY_COLOUR,
        layer=f"{ABOVE_THE_ROADS + 2:.0f}",
        x=x_m,
        y=y_m,
    )


def _line(
    root: ElementTree.Element, piece: Piece, name: str, network: RoadNetwork, size_m: float
) -> None:
    on_road = piece.road is not None
    width_m = max(2.0, size_m / 250)
    line = ElementTree.SubElement(
        root,
        "poly",
        id=name,
        type="road" if on_road else "way",
        color=ROAD_COLOUR if on_road else WAY_COLOUR,
        fill="false",
        layer=f"{ABOVE_THE_ROADS + on_road:.0f}",
        lineWidth=f"{width_m if on_road else width_m / 2:.2f}",
        shape=" ".join(f"{x:.2f},{y:.2f}" for x, y in piece.xy_m.tolist()),
    )
    if piece.road is not None:
        _note(line, "road", network.road_ids[piece.road])
    _note(line, "start_s", f"{piece.start_s:.2f}")
    _note(line, "end_s", f"{piece.end_s:.2f}")


def _number(root: ElementTree.Element, piece: Piece) -> None:
    (x_m, y_m), _ = along(piece.xy_m, 0.5)
    ElementTree.SubElement(
        root,
        "poi",
        id=f"uav{piece.uav}.order{piece.order}",
        type=str(piece.order),
        name=str(piece.order),
        color=ROAD_COLOUR,
        layer=f"{ABOVE_THE_ROADS + 2:.0f}",
        x=f"{x_m:.2f}",
        y=f"{y_m:.2f}",
    )


def _note(element: ElementTree.Element, key: str, value: str) -> None:
    ElementTree.SubElement(element, "param", key=key, value=value)
