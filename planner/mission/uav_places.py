"""Where the UAV takes off and lands, in the net's frame, and what is wrong with these places."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planner.errors import Fault, InputError
from planner.flight.uav import Uav
from planner.messages import as_written, suggestion
from planner.network.georeference import (
    grid_convergence_deg,
    is_georeferenced,
    lonlat,
    xy_of_lonlat,
)
from planner.network.road_network import RoadNetwork
from planner.scenario.uav import UavSection
from planner.scenario.uav_values import (
    InAir,
    LonLatPlace,
    NodeLanding,
    NodeStart,
    PointStart,
    UavLanding,
    UavStart,
)

FAR = 5.0  # widths of a net; a start beyond, which is out of reach too, is in another frame


def start_xy(start: UavStart, network: RoadNetwork) -> tuple[float, float]:
    """Return where a UAV takes off, metres east and north."""
    if isinstance(start, PointStart):
        return start.x_m, start.y_m
    if isinstance(start, LonLatPlace):
        return _xy_of(start, network)
    x_m, y_m = network.junction_xy_m[network.junction_index[start.node]]
    bearing_deg = start.bearing_deg  # clockwise from north: the true one, where that is known
    if start.distance_m > 0.0 and is_georeferenced(network):
        bearing_deg -= float(grid_convergence_deg(network, np.array([x_m, y_m])))
    bearing = math.radians(bearing_deg)
    return (
        float(x_m + start.distance_m * math.sin(bearing)),
        float(y_m + start.distance_m * math.cos(bearing)),
    )


def in_air(uav: Uav, there: InAir, network: RoadNetwork) -> Uav:
    """Return a UAV as it flies on from where it is in the air; it does not climb again."""
    x_m, y_m = start_xy(there.place, network)
    found = replace(uav.resumed(there.at_s, x_m, y_m), in_air=True)
    if uav.sorties > 1:
        found = replace(found, again=uav)
    if there.left_s is not None:
        found = replace(found, max_flight_time_s=there.left_s)
    if uav.aircraft is None:
        return found
    return replace(found, aircraft=uav.aircraft.in_air)


def return_xy(uav: UavSection, network: RoadNetwork) -> tuple[float, float] | None:
    """Return where a UAV has to land, metres east and north; None: anywhere."""
    place = uav.return_to
    if place is None or isinstance(place, PointStart):
        return None if place is None else (place.x_m, place.y_m)
    if isinstance(place, str):
        return start_xy(uav.start, network)
    if isinstance(place, LonLatPlace):
        return _xy_of(place, network)
    x_m, y_m = network.junction_xy_m[network.junction_index[place.node]]
    return float(x_m), float(y_m)


def _xy_of(place: LonLatPlace, network: RoadNetwork) -> tuple[float, float]:
    x_m, y_m = xy_of_lonlat(network, np.array([place.lon, place.lat])).tolist()
    return x_m, y_m


def uav_faults(uav: UavSection | None, network: RoadNetwork) -> Iterator[Fault]:
    """Yield nodes that the net does not have, and degrees where it has no projection."""
    if uav is None:
        return
    yield from place_faults_of("uav.start", uav.start, network)
    yield from place_faults_of("uav.return_to", uav.return_to, network)
    if uav.in_air is not None:
        yield from place_faults_of("uav.in_air.place", uav.in_air.place, network)


def place_faults_of(
    key: str, place: UavStart | UavLanding | None, network: RoadNetwork
) -> Iterator[Fault]:
    """Yield a node that the net does not have, or degrees where it has no projection."""
    if isinstance(place, NodeStart | NodeLanding) and place.node not in network.junction_index:
        hint = suggestion(place.node, network.junction_ids)
        yield Fault(f"{key}.node", f"{place.node} is not a node of the network; {hint}")
    elif isinstance(place, LonLatPlace):
        try:
            _xy_of(place, network)
        except InputError as error:
            yield Fault(key, str(error))


def landing_faults(uav: UavSection, network: RoadNetwork) -> Iterator[Fault]:
    """Yield a fault if a UAV cannot get to where it has to land in time."""
    home = return_xy(uav, network)
    if home is not None and uav.max_flight_time_s is not None:
        away_s = math.dist(start_xy(uav.start, network), home) / uav.speed_mps
        if away_s > uav.max_flight_time_s:
            yield Fault(
                "uav.return_to",
                f"lies {as_written(round(away_s, 1))} s of flight from the start, but "
                f"uav.max_flight_time_s is {as_written(uav.max_flight_time_s)}; "
                "choose a nearer place",
            )


def far_faults(uav: UavSection, network: RoadNetwork, reach_m: float) -> Iterator[Fault]:
    """Yield a fault if a UAV cannot see any of the roads by the horizon.

    Parameters
    ----------
    reach_m
        How far it sees at most by then, from where it takes off.
    """
    place = np.array(start_xy(uav.start, network))
    low, high = network.shape_xy_m.min(axis=0), network.shape_xy_m.max(axis=0)
    away_m = math.hypot(*np.maximum(np.maximum(low - place, place - high), 0.0))
    if away_m > reach_m and away_m > FAR * float((high - low).max()):
        where, remedy = _box(uav.start, low, high, network)
        yield Fault(
            "uav.start",
            f"lies {away_m / 1000:.6g} km from the net ({where}), farther than the UAV flies by "
            f"search.horizon_s; give a place nearby{remedy}",
        )


def _box(
    start: UavStart, low_m: np.ndarray, high_m: np.ndarray, network: RoadNetwork
) -> tuple[str, str]:
    """Return where a net lies, in the units that a start is given in, and which these are."""
    if isinstance(start, LonLatPlace):
        (west, south), (east, north) = lonlat(network, np.array([low_m, high_m])).tolist()
        return f"lat {south:.5f} to {north:.5f}, lon {west:.5f} to {east:.5f}", ""
    x_m, y_m = (f"{low:.8g} to {high:.8g}" for low, high in zip(low_m, high_m, strict=True))
    return f"x {x_m}, y {y_m} m", ", in metres as the net has them"
