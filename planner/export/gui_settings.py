"""What makes a run's overlay a picture: how sumo-gui is to draw it, and what it has to open.

sumo-gui's own settings hide the names of points, and draw them too small to be seen in a town.
"""

import gzip
import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from planner.arrays import Floats
from planner.export.sumo_gui import LABEL, write_overlay, write_xml
from planner.files import cache_root, written_whole
from planner.flight.airspace import Airspace
from planner.flight.plan import Plan
from planner.guard import BLOCK
from planner.mission.run_folder import CONFIG, NET, OVERLAY, SETTINGS
from planner.network.road_network import RoadNetwork
from planner.xml_guard import opened_xml

ROAD_GREY = "205,205,205"
BLACK, WHITE = "0,0,0", "255,255,255"
MARGIN = 0.9  # how much of the window the roads fill
WIDE = 1.5  # how much wider than high the window is, about
BOUNDARY = re.compile(rb'convBoundary="([-+.,e0-9]+)"')  # of all that a net draws, at its head

# Sections of a scheme of sumo-gui, which is what its window of settings shows.
SCHEME = {
    "background": {"backgroundColor": WHITE, "showGrid": "0"},
    "edges": {"laneEdgeMode": "0", "laneShowBorders": "0", "showRails": "0", "hideConnectors": "1"},
    "junctions": {"drawShape": "0", "drawCrossingsAndWalkingareas": "0"},
    "pois": {
        "poi_minSize": "0",
        "poi_constantSize": "0",
        "poiDetail": "12",
        "poiTextParam": LABEL,
        "poiText_show": "1",
        "poiText_size": "50",
        "poiText_color": BLACK,
        "poiText_bgColor": f"{WHITE},200",
        "poiText_constantSize": "1",
    },
    "legend": {"showSizeLegend": "1"},
}


def write_for_gui(
    folder: Path,
    plan: Plan,
    network: RoadNetwork,
    airspace: Airspace | None = None,
    *,
    net: Path | None = None,
) -> None:
    """Write a plan as ``sumo-gui -c`` shows it: an overlay, how it is drawn, and what opens both.

    Parameters
    ----------
    net
        By which name SUMO opens the network's file. If not given, its full path, or that of a
        copy in the folder: a net of the cache may go at any time, and is on this machine only.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    write_overlay(folder / OVERLAY, plan, network, airspace)
    _write_settings(folder / SETTINGS, network)
    root = ElementTree.Element("sumoConfiguration")
    given = ElementTree.SubElement(root, "input")
    ElementTree.SubElement(given, "net-file", value=str(net or _net_to_open(network.path, folder)))
    ElementTree.SubElement(given, "additional-files", value=OVERLAY)
    gui = ElementTree.SubElement(root, "gui_only")
    ElementTree.SubElement(gui, "gui-settings-file", value=SETTINGS)
    write_xml(folder / CONFIG, root)


def _net_to_open(net: Path, folder: Path) -> Path:
    """Return how a file in a folder names a net, which is copied there if it is of the cache."""
    if not net.resolve().is_relative_to(cache_root().resolve()):
        return net.resolve()
    with (
        written_whole(folder / NET) as new,
        net.open("rb") as whole,
        new.open("wb") as file,
        gzip.GzipFile("", "wb", fileobj=file, mtime=0) as packed,  # the same bytes at any time
    ):
        shutil.copyfileobj(whole, packed)
    return Path(NET)


def _write_settings(path: Path, network: RoadNetwork) -> None:
    """Write how sumo-gui draws an overlay: the roads fill the window, pale, the numbers show."""
    root = ElementTree.Element("viewsettings")
    scheme = ElementTree.SubElement(root, "scheme", name="planner")
    sections = {name: ElementTree.SubElement(scheme, name, said) for name, said in SCHEME.items()}
    colours = ElementTree.SubElement(sections["edges"], "colorScheme", name="uniform")
    ElementTree.SubElement(colours, "entry", color=ROAD_GREY, name="road")
    low_m, high_m = network.shape_xy_m.min(axis=0), network.shape_xy_m.max(axis=0)
    x_m, y_m = ((low_m + high_m) / 2).tolist()
    drawn_m = _drawn_m(network.path)
    zoom = 1.0 if drawn_m is None else _height_m(drawn_m) / _height_m(high_m - low_m)
    percent = f"{100 * MARGIN * zoom:.2f}"
    ElementTree.SubElement(root, "viewport", x=f"{x_m:.2f}", y=f"{y_m:.2f}", zoom=percent)
    write_xml(path, root)


def _drawn_m(net: Path) -> Floats | None:
    """Return the size, (2,) metres, of all that sumo-gui draws of a net, railways too.

    Zoom is a share of that. None where the net does not tell it.
    """
    with opened_xml(net) as file:
        found = BOUNDARY.search(file.read(BLOCK))
    if found is None:
        return None
    west_m, south_m, east_m, north_m = map(float, found[1].split(b","))
    return np.array([east_m - west_m, north_m - south_m])


def _height_m(size_m: Floats) -> float:
    """Return how high a window is in which all of a size, (2,) metres, is seen."""
    return max(float(size_m[1]), float(size_m[0]) / WIDE, 1.0)
