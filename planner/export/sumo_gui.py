"""A plan as sumo-gui shows it: lines, arrows and numbers, how they look, and what to open."""

import gzip
import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from planner.arrays import Floats
from planner.files import cache_root, written_whole
from planner.flight.airspace import Airspace
from planner.flight.pieces import Piece, along, pieces, segments
from planner.flight.plan import Plan
from planner.network.road_network import RoadNetwork

SCHEMA = "http://sumo.dlr.de/xsd/additional_file.xsd"
INSTANCE = "http://www.w3.org/2001/XMLSchema-instance"
ROAD_COLOUR = "213,94,0"
WAY_COLOUR = "0,114,178"
AREA_COLOUR = "142,42,142"
ARROW = 3.0  # widths of its line that an arrow is long, to each side of its middle
LOOK = {
    "background": {"backgroundColor": "white", "showGrid": "0"},
    "edges": {"laneShowBorders": "0", "showLinkDecals": "0", "hideConnectors": "1"},
}
# Numbers are seen from wherever one looks; dots without them are as large as they are said to be.
NUMBERED = {
    "poi_minSize": "6",
    "poi_constantSize": "1",
    "poiType_show": "1",
    "poiType_size": "60",
    "poiType_constantSize": "1",
    "poiType_color": "black",
    "poiName_show": "0",
}
PLAIN = {"poi_minSize": "0", "poi_constantSize": "0", "poiType_show": "0", "poiName_show": "0"}
ABOVE_THE_ROADS = 100.0  # sumo-gui's layers: roads 0, vehicles 200


def write_overlay(
    path: Path, plan: Plan, network: RoadNetwork, airspace: Airspace | None = None
) -> None:
    """Write a plan's flights as ``.add.xml``, to be loaded beside the net (``sumo-gui -a``).

    Roads that the plan flies are thick lines with their order number, the ways between them
    thin ones; a flight off the roads has a number for each straight piece. Arrows show where
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
    for number, piece in enumerate(pieces(plan) if plan.follows_roads else segments(plan), 1):
        name = f"uav{piece.uav}.piece{number}"
        _line(root, piece, name, network, size_m)
        _arrow(root, piece, name, size_m)
        order = piece.order if plan.follows_roads else number
        if order:
            _number(root, piece, order)
    _write(path, root)


def write_look(
    path: Path, *, numbered: bool = True, snapshot: tuple[Path, float] | None = None
) -> None:
    """Write how sumo-gui shows a plan, as its view settings.

    Parameters
    ----------
    numbered
        Whether the order of the roads is shown.
    snapshot
        A picture to be made, and at which second; None: none.
    """
    root = ElementTree.Element("viewsettings")
    scheme = ElementTree.SubElement(root, "scheme", name="plan")
    for kind, said in (LOOK | {"pois": NUMBERED if numbered else PLAIN}).items():
        ElementTree.SubElement(scheme, kind, said)
    if snapshot is not None:
        file, time_s = snapshot
        ElementTree.SubElement(root, "snapshot", file=str(file), time=f"{time_s:g}")
    _write(path, root)


def net_to_open(net: Path, copy: Path) -> str:
    """Return how a file beside a copy names a net: by its whole path on this machine.

    What is in the cache may go at any time: of such a net the copy is written, and named.
    """
    if not net.resolve().is_relative_to(cache_root().resolve()):
        return str(net.resolve())
    with (
        written_whole(copy) as new,
        net.open("rb") as whole,
        new.open("wb") as file,
        gzip.GzipFile("", "wb", fileobj=file, mtime=0) as packed,  # the same bytes at any time
    ):
        shutil.copyfileobj(whole, packed)
    return copy.name


def write_configuration(path: Path, net: str, *, overlay: str, look: str, until_s: float) -> None:
    """Write what sumo-gui opens: a net with a plan on it.

    Parameters
    ----------
    net
        As `net_to_open` names it.
    overlay, look
        Names of the files that `write_overlay` and `write_look` write beside it.
    """
    root = ElementTree.Element("sumoConfiguration")
    for section, key, value in (
        ("input", "net-file", net),
        ("input", "additional-files", overlay),
        ("time", "end", f"{until_s:g}"),
        ("gui_only", "gui-settings-file", look),
    ):
        parent = root.find(section)
        if parent is None:
            parent = ElementTree.SubElement(root, section)
        ElementTree.SubElement(parent, key, value=value)
    _write(path, root)


def _write(path: Path, root: ElementTree.Element) -> None:
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
    line = ElementTree.SubElement(
        root,
        "poly",
        id=name,
        type="road" if on_road else "way",
        color=ROAD_COLOUR if on_road else WAY_COLOUR,
        fill="false",
        layer=f"{ABOVE_THE_ROADS + on_road:.0f}",
        lineWidth=f"{_width_m(piece, size_m):.2f}",
        shape=_shape(piece.xy_m),
    )
    if piece.road is not None:
        _note(line, "road", network.road_ids[piece.road])
    _note(line, "start_s", f"{piece.start_s:.2f}")
    _note(line, "end_s", f"{piece.end_s:.2f}")


def _arrow(root: ElementTree.Element, piece: Piece, name: str, size_m: float) -> None:
    """Add a triangle that points where a piece leads, behind its middle."""
    middle_m, ahead = along(piece.xy_m, 0.6)
    aside, long_m = np.array([-ahead[1], ahead[0]]), ARROW * _width_m(piece, size_m)
    shape_m = middle_m + long_m * np.array([ahead, aside - ahead, -aside - ahead])
    ElementTree.SubElement(
        root,
        "poly",
        id=f"{name}.arrow",
        type="direction",
        color=ROAD_COLOUR if piece.road is not None else WAY_COLOUR,
        fill="true",
        layer=f"{ABOVE_THE_ROADS + 1:.0f}",
        shape=" ".join(f"{x:.2f},{y:.2f}" for x, y in shape_m.tolist()),
    )


def _width_m(piece: Piece, size_m: float) -> float:
    width_m = max(2.0, size_m / 250)
    return width_m if piece.road is not None else width_m / 2


def _number(root: ElementTree.Element, piece: Piece, order: int) -> None:
    (x_m, y_m), _ = along(piece.xy_m, 0.5)
    ElementTree.SubElement(
        root,
        "poi",
        id=f"uav{piece.uav}.order{order}",
        type=str(order),
        name=str(order),
        color=ROAD_COLOUR,
        layer=f"{ABOVE_THE_ROADS + 2:.0f}",
        x=f"{x_m:.2f}",
        y=f"{y_m:.2f}",
    )


def _note(element: ElementTree.Element, key: str, value: str) -> None:
    ElementTree.SubElement(element, "param", key=key, value=value)
