"""A plan as something to look at in sumo-gui: an additional file of lines, arrows and numbers."""

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from planner.arrays import Floats
from planner.clock import clock
from planner.files import written_whole
from planner.flight.airspace import Airspace
from planner.flight.pieces import Piece, along, pieces, segments
from planner.flight.plan import Plan
from planner.network.road_network import RoadNetwork

SCHEMA = "http://sumo.dlr.de/xsd/additional_file.xsd"
INSTANCE = "http://www.w3.org/2001/XMLSchema-instance"
ROAD_COLOUR = "213,94,0"
WAY_COLOUR = "0,114,178"
AREA_COLOUR = "142,42,142"
ARROW, ARROW_AT = 6.0, 0.8  # its length in widths of a line, and where on a piece its tip is
ROOM = 12.0  # clocks along a flight are so many parts of the net apart
LABEL = "label"  # the parameter of a point that sumo-gui is told to write beside it
ABOVE_THE_ROADS = 100.0  # sumo-gui's layers: roads 0, vehicles 200


def write_overlay(
    path: Path, plan: Plan, network: RoadNetwork, airspace: Airspace | None = None
) -> None:
    """Write a plan's flights as ``.add.xml``, to be loaded beside the net (``sumo-gui -a``).

    Roads that the plan flies are thick lines with their order number, the ways between them
    thin ones; a flight off the roads is told by the clock, where there is room. Arrows show where
    each leads. The times stand in each element's parameters. The areas of an airspace are outlines.

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
    for number, (key, rings) in enumerate(airspace.outlines() if airspace else (), 1):
        for ring, xy_m in enumerate(rings):
            _outline(root, key, f"airspace{number}.{ring}", xy_m, size_m)
    for uav, track in enumerate(plan.tracks):
        if len(track.time_s):
            _take_off(root, f"uav{uav}", track.xy(float(track.time_s[0])).tolist())
    flown = pieces(plan) if plan.follows_roads else segments(plan)
    labels = _orders(flown) if plan.follows_roads else _clocks(plan, flown, size_m / ROOM)
    for number, piece in enumerate(flown, 1):
        _line(root, piece, f"uav{piece.uav}.piece{number}", network, size_m)
        if plan.follows_roads or piece in labels:
            _arrow(root, piece, f"uav{piece.uav}.arrow{number}", size_m)
        if piece in labels:
            _label(root, piece, labels[piece], number)
    write_xml(path, root)


def _orders(flown: list[Piece]) -> dict[Piece, str]:
    return {piece: str(piece.order) for piece in flown if piece.order}


def _clocks(plan: Plan, flown: list[Piece], apart_m: float) -> dict[Piece, str]:
    """Return when pieces are flown, for as many of them as lie apart, the first ones first."""
    places = [track.xy(float(track.time_s[0])) for track in plan.tracks if len(track.time_s)]
    labels = {}
    for piece in flown:
        middle, _ = along(piece.xy_m, 0.5)
        if np.linalg.norm(np.stack(places) - middle, axis=1).min() >= apart_m:
            places.append(middle)
            labels[piece] = clock((piece.start_s + piece.end_s) / 2)
    return labels


def write_xml(path: Path, root: ElementTree.Element) -> None:
    """Write an element and what it holds, indented."""
    ElementTree.indent(root, "    ")
    with written_whole(path) as new:
        ElementTree.ElementTree(root).write(new, encoding="UTF-8", xml_declaration=True)


def _take_off(root: ElementTree.Element, uav: str, xy_m: list[float]) -> None:
    x_m, y_m = (f"{metres:.2f}" for metres in xy_m)
    point = ElementTree.SubElement(
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
    _note(point, LABEL, "take-off")


def _outline(root: ElementTree.Element, key: str, name: str, xy_m: Floats, size_m: float) -> None:
    ElementTree.SubElement(
        root,
        "poly",
        id=name,
        type=key,
        color=AREA_COLOUR,
        fill="false",
        layer=f"{ABOVE_THE_ROADS - 1:.0f}",
        lineWidth=f"{max(2.0, size_m / 500):.2f}",
        shape=_shape(xy_m),
    )


def _shape(xy_m: Floats) -> str:
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in xy_m.tolist())


def _line(
    root: ElementTree.Element, piece: Piece, name: str, network: RoadNetwork, size_m: float
) -> None:
    on_road = piece.road is not None
    width_m = _width_m(size_m)
    line = ElementTree.SubElement(
        root,
        "poly",
        id=name,
        type="road" if on_road else "way",
        color=ROAD_COLOUR if on_road else WAY_COLOUR,
        fill="false",
        layer=f"{ABOVE_THE_ROADS + on_road:.0f}",
        lineWidth=f"{width_m if on_road else width_m / 2:.2f}",
        shape=_shape(piece.xy_m),
    )
    if piece.road is not None:
        _note(line, "road", network.road_ids[piece.road])
    _note(line, "start_s", f"{piece.start_s:.2f}")
    _note(line, "end_s", f"{piece.end_s:.2f}")


def _arrow(root: ElementTree.Element, piece: Piece, name: str, size_m: float) -> None:
    """Add a triangle that points where a piece leads."""
    flown_m = float(np.linalg.norm(np.diff(piece.xy_m, axis=0), axis=1).sum())
    length_m = min(ARROW * _width_m(size_m), flown_m / 3)
    tip, ahead = along(piece.xy_m, ARROW_AT)
    tail = tip - length_m * ahead
    aside = length_m / 3 * np.array([-ahead[1], ahead[0]])
    ElementTree.SubElement(
        root,
        "poly",
        id=name,
        type="direction",
        color=WAY_COLOUR if piece.road is None else ROAD_COLOUR,
        fill="true",
        layer=f"{ABOVE_THE_ROADS + 1:.0f}",
        shape=_shape(np.stack([tip, tail + aside, tail - aside])),
    )


def _width_m(size_m: float) -> float:
    """Return how thick a road's line is on a net of a size."""
    return max(2.0, size_m / 250)


def _label(root: ElementTree.Element, piece: Piece, label: str, number: int) -> None:
    (x_m, y_m), _ = along(piece.xy_m, 0.5)
    kind, number = ("order", piece.order) if piece.order else ("time", number)
    point = ElementTree.SubElement(
        root,
        "poi",
        id=f"uav{piece.uav}.{kind}{number}",
        type=kind,
        name=label,
        color=ROAD_COLOUR if piece.order else WAY_COLOUR,
        layer=f"{ABOVE_THE_ROADS + 2:.0f}",
        x=f"{x_m:.2f}",
        y=f"{y_m:.2f}",
    )
    _note(point, LABEL, label)


def _note(element: ElementTree.Element, key: str, value: str) -> None:
    ElementTree.SubElement(element, "param", key=key, value=value)
