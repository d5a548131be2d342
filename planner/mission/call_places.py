"""The words of a call that say where: the target's last place and heading, the drone's places."""

import math
from typing import Any, NamedTuple

import numpy as np

from planner import compass
from planner.belief.places import ALONG_DEG, in_circle
from planner.errors import InputError
from planner.mission.call_words import Faults, Words
from planner.network.georeference import grid_convergence_deg, is_georeferenced, lonlat
from planner.network.place_words import Where, heading, on_road, told, where
from planner.network.road_network import RoadNetwork

RADIUS_M = 200.0  # how well a place is known, where nobody says
DEGREE_DIGITS, METRE_DIGITS = 6, 1


class Seen(NamedTuple):
    """Where the target was last seen."""

    start: Any  # as `target.start` has it
    called: str  # the place and the heading, for a title
    said: str  # as it was understood


class Site(NamedTuple):
    """Where the drone may take off."""

    start: dict[str, float]  # as `uav.start` has it
    called: str
    said: str  # as it was understood


def last_seen(words: Words, network: RoadNetwork, faults: Faults) -> Seen | None:
    """Return where the target was last seen; None if that is not understood."""
    to_deg = None
    if words.heading is not None:
        text = words.heading
        to_deg = faults.tried("--heading", lambda: heading(text))
    found = faults.tried("--last-seen", lambda: _seen(words, network))
    if found is None or (to_deg is None and words.heading is not None):
        return None
    place, said = found
    if place.edges and words.radius_m is not None:
        text = f"goes with a point, and {place.called} is all of its length; leave it out"
        faults.add("--radius-m", text)
    radius_m = RADIUS_M if words.radius_m is None else words.radius_m
    start = faults.tried("--last-seen", lambda: _start(place, radius_m, to_deg, network))
    radius = "" if place.edges else f", within {radius_m:g} m"
    to = "" if to_deg is None else f", heading {compass.letters(to_deg)} ({to_deg:g} deg)"
    return Seen(start, f"{place.called}{to}", f"{said}{radius}{to}")


def drone_site(text: str, network: RoadNetwork, faults: Faults) -> Site | None:
    """Return a place that the drone may take off from; None if it is not understood."""
    place = faults.tried("--drone-at", lambda: where(text, network))
    if place is None:
        return None
    return Site(_written(place, network), place.called, told(place, network))


def _seen(words: Words, network: RoadNetwork) -> tuple[Where, str]:
    """Return the place that was said, moved to a road, and how it was understood."""
    place = where(words.last_seen, network)
    moved, said = on_road(words.last_seen, place, network)
    return moved, told(place, network) + (said and f"; {said}")


def _start(place: Where, radius_m: float, to_deg: float | None, network: RoadNetwork) -> Any:
    """Return where the target starts, as `target.start` has it."""
    in_net_deg = to_deg
    if to_deg is not None and is_georeferenced(network):
        in_net_deg = to_deg - float(grid_convergence_deg(network, place.xy_m))
    if place.edges:
        edges = [edge for edge in place.edges if _goes(network, edge, in_net_deg)]
        if not edges:
            raise InputError(
                f"no part of {place.called} within {ALONG_DEG:g} degrees of the heading leads "
                "on; leave --heading out"
            )
        return [{"edge": edge} for edge in edges]
    in_circle(network, place.x_m, place.y_m, radius_m, heading_deg=in_net_deg, leads_on=True)
    to = {} if to_deg is None else {"heading_deg": to_deg}
    return {**_written(place, network), "radius_m": radius_m, **to}


def _goes(network: RoadNetwork, name: str, heading_deg: float | None) -> bool:
    """Return whether an edge leads on, and along a heading in the net if one is given."""
    edge = network.edge_index[name]
    if not len(network.turns(edge)):
        return False
    if heading_deg is None:
        return True
    shape = network.edge_shape(edge)
    east_m, north_m = shape[-1] - shape[0]
    bearing_deg = math.degrees(math.atan2(east_m, north_m))
    return abs((bearing_deg - heading_deg + 180.0) % 360.0 - 180.0) <= ALONG_DEG


def _written(place: Where, network: RoadNetwork) -> dict[str, float]:
    """Return a place as a scenario has it: degrees, or metres on a net without a projection."""
    if not is_georeferenced(network):
        return {"x_m": round(place.x_m, METRE_DIGITS), "y_m": round(place.y_m, METRE_DIGITS)}
    lon, lat = np.round(lonlat(network, place.xy_m), DEGREE_DIGITS).tolist()
    return {"lon": lon, "lat": lat}
