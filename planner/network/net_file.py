"""The net behind a file: a ``.net.xml``, a SUMO configuration or an extract of OpenStreetMap."""

import re
from pathlib import Path

from planner.errors import InputError
from planner.guard import BLOCK
from planner.network.build import import_osm
from planner.scenario.sections import OF_OSM
from planner.xml_guard import kind_of_xml, opened_xml, xml_elements

NET, OSM, CONFIGURATION = "net", "osm", "configuration"  # root elements; of the last the end
NET_OPTIONS = ("net-file", "net", "n")  # by which a configuration names its net
LARGEST_CONFIGURATION = 16 << 20  # bytes
# netconvert tells at the head of a net what it was made from; `import_osm` leaves its own line.
FROM_OSM = re.compile(rb"<osm(-files)?\s+v(alue)?=|" + re.escape(OF_OSM.encode()))


def net_behind(path: Path) -> Path:
    """Return the ``.net.xml`` (perhaps packed, ``.gz``) that SUMO loads for a file.

    Parameters
    ----------
    path
        A net is its own; of a configuration (``.sumocfg``) it is the one that it names; of an
        extract of OpenStreetMap the one that netconvert makes, on first use only.

    Raises
    ------
    InputError
        If the file cannot be read, or a configuration names no net.
    """
    kind = kind_of_xml(path) or ""
    if kind == OSM:
        return import_osm(path)
    return _configured(path) if kind.lower().endswith(CONFIGURATION) else path


def is_net_file(path: Path) -> bool:
    """Return whether a file is one that `net_behind` takes, by its root element."""
    kind = (kind_of_xml(path) or "").lower() if path.is_file() else ""
    return kind in (NET, OSM) or kind.endswith(CONFIGURATION)


def _configured(path: Path) -> Path:
    names = [
        name.strip()
        for element in xml_elements(path, LARGEST_CONFIGURATION)
        if element.tag in NET_OPTIONS
        for name in element.get("value", element.get("v", "")).split(",")
    ]
    if not names:
        raise InputError(f"{path}: names no net; give it a <net-file value=...>, or give the net")
    if len(names) > 1:
        raise InputError(f"{path}: names {len(names)} nets ({', '.join(names)}); leave one of them")
    net: Path = path.parent / names[0]
    if not names[0] or "\0" in names[0] or not net.is_file():
        raise InputError(f"{path}: there is no file {net}; correct its net-file")
    return net


def credit_in(path: Path) -> str:
    """Return whose data a net is, as far as its head says: OpenStreetMap's, or ""."""
    with opened_xml(path) as file:
        head = file.read(BLOCK).partition(b"<net")[0]
    return OF_OSM if FROM_OSM.search(head) else ""
