"""Where a scenario says that a target starts, as stretches of edges."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planner.belief.places import in_area, in_circle
from planner.belief.stretches import Stretches
from planner.belief.zone_file import read_zone
from planner.errors import InputError
from planner.messages import as_written
from planner.network.georeference import grid_convergence_deg, is_georeferenced, xy_of_lonlat
from planner.network.polygons import sound_polygon
from planner.network.road_network import RoadNetwork
from planner.scenario.target_values import (
    AreaStart,
    CircleStart,
    LonLatStart,
    StretchStart,
    TazStart,
)


def stretches_of(start: Any, network: RoadNetwork, folder: Path = Path()) -> Stretches | None:
    """Return the stretches on which a target may start; None where whole edges are meant.

    Only edges count from which it can go on.

    Parameters
    ----------
    start
        As a scenario has it; edges that it names are in the network.
    folder
        Where the paths in it start.

    Raises
    ------
    InputError
        If there is no road, or a file does not hold what it should.
    """
    if isinstance(start, CircleStart | LonLatStart):
        return _in_circle(network, start)
    if isinstance(start, AreaStart):
        sound_polygon(np.array(start.area))
        return in_area(network, start.area, leads_on=True)
    if isinstance(start, TazStart):
        zone = read_zone(folder / start.file, start.taz)
        if not zone.starts:
            return in_area(network, zone.corners, leads_on=True)
        return _of_zone(network, zone.starts, start)
    return None if isinstance(start, str | dict) else _listed(network, start)


def _in_circle(network: RoadNetwork, start: CircleStart | LonLatStart) -> Stretches:
    if isinstance(start, LonLatStart):
        xy_m = xy_of_lonlat(network, np.array([start.lon, start.lat]))
    else:
        xy_m = np.array([start.x_m, start.y_m])
    heading_deg = start.heading_deg
    if heading_deg is not None and is_georeferenced(network):  # a compass knows true north
        heading_deg -= float(grid_convergence_deg(network, xy_m))
    x_m, y_m = map(float, xy_m)
    return in_circle(network, x_m, y_m, start.radius_m, heading_deg=heading_deg, leads_on=True)


def _listed(network: RoadNetwork, listed: Sequence[StretchStart]) -> Stretches:
    edge = np.array([network.edge_index[one.edge] for one in listed])
    length_m = network.edge_length_m[edge]
    ends_m = [np.inf if one.to_m is None else one.to_m for one in listed]
    from_m, to_m = np.array([one.from_m for one in listed]), np.minimum(ends_m, length_m)
    given = [one.p for one in listed if one.p is not None]
    if not given:
        return Stretches.by_length(edge, from_m, to_m)
    p = np.array(given)
    return Stretches(edge, from_m, to_m, p / p.sum())


def _of_zone(network: RoadNetwork, weights: Mapping[str, float], start: TazStart) -> Stretches:
    """Return the edges of a zone that lead on, as probable as they weigh."""
    index = {name: network.edge_index[name] for name in weights if name in network.edge_index}
    edges = [e for name, e in index.items() if weights[name] > 0 and len(network.turns(e))]
    if not edges:
        named = ", ".join(list(weights)[:3])
        raise InputError(
            f"the taz {as_written(start.taz)} has no edge of this net that a car may use, that "
            f"leads on and that weighs more than 0 ({named}); give a taz of this net"
        )
    edge = np.array(edges)
    weight = np.array([weights[network.edge_ids[e]] for e in edges])
    length_m = network.edge_length_m[edge]
    return Stretches(edge, np.zeros(len(edge)), length_m, weight / weight.sum())
