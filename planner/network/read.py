"""A SUMO network file as columns, read once and kept."""

import hashlib
import html
import json
from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from planner.arrays import Flags, Floats, Ints, first_of_parts
from planner.cache import cache_folder, is_whole, seal
from planner.errors import InputError
from planner.network.build import build_net, import_osm
from planner.network.exits import found_exits, named_exits, with_exits
from planner.network.net_file import credit_in, net_behind
from planner.network.road_network import RoadNetwork
from planner.network.sumo import CAR, STUMBLES, parse_net, sumo_file
from planner.npz import read_columns, write_columns
from planner.scenario.sections import OF_SUMO, NetworkSection

# Goes into the name of kept columns: raise it when their meaning changes.
COLUMNS_VERSION = 6
# A net that measures less, or most of whose roads do, is in degrees; one that measures more, in mm.
SMALLEST_M, SHORTEST_M, LARGEST_M = 1.0, 0.1, 4e7
IN_MEMORY = 8  # networks that a process keeps, by content: a batch opens the same one many times
TEXTS = (
    "node_ids",
    "road_ids",
    "edge_ids",
    "closed_edge_ids",
    "edge_street",
    "projection",
    "net_offset_m",
)
ARRAYS = (
    "node_xy_m",
    "road_from",
    "road_to",
    "first_point",
    "shape_xy_m",
    "edge_road",
    "edge_length_m",
    "edge_limit_mps",
    "edge_lanes",
    "first_turn",
    "turn_edge",
    "turn_back",
    "half_width_m",
    "edge_exit",
)
NO_PROJECTION = "!"  # what SUMO writes where coordinates are those of no map


def open_network(section: NetworkSection, folder: Path) -> RoadNetwork:
    """Return the network that a scenario names, built by netconvert if need be.

    Parameters
    ----------
    folder
        Where relative paths start: the scenario's folder.

    Raises
    ------
    InputError
        If a source is missing, broken or without roads for cars.
    """
    files, credit, exits = source_files(section, folder), section.credit, section.exits
    if "net" in files:
        net = net_behind(files["net"])
        return read_net(net, source=files["net"], attribution=credit, exits=exits)
    if "osm" in files:
        net = import_osm(files["osm"])
        return read_net(net, source=files["osm"], attribution=credit, exits=exits)
    if "nodes" not in files or "edges" not in files:
        raise InputError(f"{folder}: the network needs nodes and edges, or net, or osm")
    net = build_net(
        files["nodes"],
        files["edges"],
        connections=files.get("connections"),
        signals=files.get("signals"),
        abstract=section.abstract,
        folder=folder,
    )
    return read_net(net, source=files["edges"], attribution=credit, exits=exits)


def source_files(section: NetworkSection, folder: Path) -> dict[str, Path]:
    """Return where the files lie that a scenario names as its network's, by key.

    Raises
    ------
    InputError
        If one should come with SUMO and does not.
    """
    return {
        key: sumo_file(name.removeprefix(OF_SUMO))
        if key == "net" and name.startswith(OF_SUMO)
        else folder / name
        for key, name in section.files.items()
    }


def read_net(
    path: Path,
    *,
    source: Path | None = None,
    attribution: str = "",
    exits: Sequence[str] | None = None,
) -> RoadNetwork:
    """Return the roads of a ``.net.xml`` that a passenger car may use, in the file's order.

    Every edge is a road; its polyline runs from node to node. What was read is kept
    beside the built networks, by the file's content.

    Parameters
    ----------
    source
        The file that the user gave, if another one, for messages.
    attribution
        Whose data it is, for all that is made from it; "": as the net itself says.
    exits
        Names of the edges that lead off the map. None: those that `found_exits` finds, and none
        where the net is abstract.

    Raises
    ------
    InputError
        If the file is missing, not a SUMO net, or has no edge for cars; or if an exit is none of
        its edges.
    """
    try:
        sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({error.strerror or error}); give a SUMO .net.xml"
        ) from error
    named = None if exits is None else tuple(exits)
    return _network(path, sha256, source or path, attribution, named)


@lru_cache(IN_MEMORY)
def _network(
    path: Path, sha256: str, source: Path, attribution: str, exits: tuple[str, ...] | None
) -> RoadNetwork:
    kept = cache_folder("nets") / f"{sha256[:32]}.roads{COLUMNS_VERSION}.npz"
    columns = _load(kept) if is_whole(kept) else None
    if columns is None:
        columns = _sound_columns(path, source)
        _save(kept, columns)
        seal(kept)
    found = columns.pop("edge_exit")
    credit = attribution or credit_in(path)
    network = RoadNetwork(**columns, path=path, sha256=sha256, source=source, attribution=credit)
    if exits is not None:
        return with_exits(network, named_exits(network, exits))
    return network if network.is_abstract else with_exits(network, found)


@np.errstate(over="ignore", invalid="ignore")  # absurd extents are refused for what they are
def _refuse_other_units(shapes: Sequence[Floats], source: Path) -> None:
    """Refuse a net whose coordinates cannot be metres; to drive and fly it would take for ever."""
    points = np.concatenate(shapes)
    extent_m = float(np.ptp(points, axis=0).max())
    lengths_m = [np.linalg.norm(np.diff(shape, axis=0), axis=1).sum() for shape in shapes]
    road_m = float(np.median(lengths_m))
    seen = f"{source}: the whole net measures {extent_m:.3g} m, and its median road {road_m:.3g} m"
    if extent_m < SMALLEST_M or road_m < SHORTEST_M:
        raise InputError(f"{seen}; are its coordinates degrees? convert them to metres")
    if extent_m > LARGEST_M:
        raise InputError(f"{seen}, more than the Earth; convert its coordinates to metres")


def _sound_columns(path: Path, source: Path) -> dict[str, Any]:
    """Return a network's columns; sumolib looks at some of a file only when it is asked."""
    try:
        return _columns(path, source)
    except InputError:
        raise
    except STUMBLES as error:
        raise InputError(
            f"{source}: not a readable SUMO network ({error!r}); "
            "give a .net.xml that netconvert or netedit wrote"
        ) from error


def _columns(path: Path, source: Path) -> dict[str, Any]:
    """Return the fields of ``RoadNetwork`` that come from the file's content."""
    net = parse_net(path, source)
    edges = [edge for edge in net.getEdges(False) if edge.allows(CAR)]
    if not edges:
        raise InputError(
            f"{source}: no edge for passenger cars; give a file with roads, "
            "or look at their allow and disallow"
        )
    ends = {end for edge in edges for end in (edge.getFromNode(), edge.getToNode())}
    nodes = [node for node in net.getNodes() if node in ends]
    place = {node: i for i, node in enumerate(nodes)}
    shapes = [_shape(edge) for edge in edges]
    turns, back, leads_on = _turns(edges)
    names = tuple(str(edge.getID()) for edge in edges)
    lengths_m = np.array([edge.getLength() for edge in edges], dtype=np.float64)
    points = np.concatenate(shapes)
    if not (np.all(lengths_m > 0) and np.isfinite(lengths_m).all() and np.isfinite(points).all()):
        raise InputError(
            f"{source}: an edge has no length above zero, or a place that is not finite; "
            "build the network again"
        )
    _refuse_other_units(shapes, source)
    return {
        "node_ids": tuple(str(node.getID()) for node in nodes),
        "node_xy_m": np.array([node.getCoord() for node in nodes], dtype=np.float64),
        "road_ids": names,
        "road_from": np.array([place[edge.getFromNode()] for edge in edges], dtype=np.int32),
        "road_to": np.array([place[edge.getToNode()] for edge in edges], dtype=np.int32),
        "first_point": first_of_parts(shapes),
        "shape_xy_m": points,
        "edge_ids": names,
        "closed_edge_ids": tuple(
            str(edge.getID()) for edge in net.getEdges(False) if not edge.allows(CAR)
        ),
        "edge_road": np.arange(len(edges), dtype=np.int32),
        "edge_length_m": lengths_m,
        "edge_limit_mps": np.array([_limit_mps(edge) for edge in edges], dtype=np.float64),
        "edge_lanes": np.array([len(_car_lanes(edge)) for edge in edges], dtype=np.int32),
        "first_turn": first_of_parts(turns),
        "turn_edge": np.concatenate(turns),
        "turn_back": np.concatenate(back),
        "half_width_m": np.zeros(len(edges)),
        "edge_exit": found_exits(shapes, leads_on),
        "edge_street": tuple(_street(edge) for edge in edges),
        "projection": _projection(net),
        "net_offset_m": _offset_m(net, source),
    }


def _projection(net: Any) -> str | None:
    # sumolib's public way to it needs pyproj.
    parameters = net._location.get("projParameter", NO_PROJECTION)
    return None if parameters == NO_PROJECTION else str(parameters)


def _offset_m(net: Any, source: Path) -> tuple[float, float]:
    x_m, y_m = map(float, net._location.get("netOffset", "0,0").split(","))
    if not np.isfinite((x_m, y_m)).all():
        raise InputError(f"{source}: its netOffset is not finite; build the network again")
    return x_m, y_m


def _street(edge: Any) -> str:
    # netconvert escapes what OpenStreetMap had escaped already.
    return " ".join(html.unescape(edge.getName() or "").split())


def _shape(edge: Any) -> Floats:
    """Return an edge's reference line, (k, 2) metres, led to the points of its two nodes."""
    first, last = edge.getFromNode().getCoord(), edge.getToNode().getCoord()
    points = [first, *edge.getRawShape(), last]
    different = [points[0]] + [b for a, b in pairwise(points) if a != b]
    # A loop of no length would be a single point.
    return np.array(different if len(different) > 1 else [first, last], dtype=np.float64)


def _limit_mps(edge: Any) -> float:
    return float(max(lane.getSpeed() for lane in _car_lanes(edge)))


def _car_lanes(edge: Any) -> list[Any]:
    return [lane for lane in edge.getLanes() if lane.allows(CAR)]


def _turns(edges: Sequence[Any]) -> tuple[list[Ints], list[Flags], Flags]:
    """Return the edges that a car may drive after each edge, in the edges' order.

    And which of these ways lead straight back, though there is another way on; and after which
    edges there is any but straight back.
    """
    index = {edge: i for i, edge in enumerate(edges)}
    turns: list[Ints] = []
    back: list[Flags] = []
    leads_on = np.zeros(len(edges), bool)
    for i, edge in enumerate(edges):
        ways = edge.getAllowedOutgoing(CAR).items()
        leads_back = {index[to]: _turns_back(links) for to, links in ways}
        leads_on[i] = some_onward = not all(leads_back.values())
        turns.append(np.array(sorted(leads_back), dtype=np.int32))
        back.append(np.array([some_onward and leads_back[to] for to in sorted(leads_back)], bool))
    return turns, back, leads_on


def _turns_back(links: Sequence[Any]) -> bool:
    return all(link.getDirection() in "tT" for link in links)


def _save(path: Path, columns: Mapping[str, Any]) -> None:
    texts = json.dumps({name: columns[name] for name in TEXTS})
    arrays = {name: columns[name] for name in ARRAYS}
    write_columns(path, {"texts": np.array(texts), **arrays})


def _load(path: Path) -> dict[str, Any] | None:
    """Return kept columns, or None where there are none or they were damaged."""
    kept = read_columns(path, ("texts", *ARRAYS))
    if kept is None:
        return None
    try:
        said = json.loads(str(kept.pop("texts")))
    except ValueError:
        return None
    return {**{k: tuple(v) if isinstance(v, list) else v for k, v in said.items()}, **kept}
