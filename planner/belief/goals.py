"""Where a scenario says that a target goes: to stretches of edges, or along routes."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planner.arrays import Flags
from planner.belief.known_routes import KnownRoutes
from planner.belief.places import in_area, in_circle, place_nearest_to
from planner.belief.route_file import read_routes
from planner.belief.stretches import Stretches
from planner.belief.ways import QUIET_MPS, can_reach, quiet_streets, ways_out
from planner.belief.zone_file import read_zone
from planner.errors import InputError
from planner.network.georeference import xy_of_lonlat
from planner.network.road_network import RoadNetwork
from planner.scenario.target_values import Goal, GoalFile

Goals = Stretches | KnownRoutes


def goals_of(goes: Any, network: RoadNetwork, folder: Path = Path()) -> Goals | None:
    """Return where a target goes; None where it turns by chance.

    Parameters
    ----------
    goes
        As a scenario has it; edges that it names are in the network.
    folder
        Where the paths in it start.

    Raises
    ------
    InputError
        If there is no such place, or a file does not hold what it should.
    """
    if goes is None or goes == "turns":
        return None
    if goes == "somewhere":
        streets = quiet_streets(network)
        if len(streets.edge) == 0:
            raise InputError(
                f'"somewhere" is on a street with a limit of {QUIET_MPS:g} m/s or less, of which '
                'there is none; name places, or write "turns"'
            )
        return streets
    if goes == "leaves":
        exits = ways_out(network)
        if len(exits.edge) == 0:
            raise InputError(
                '"leaves" is by an exit of the map, of which there is none; name some in '
                'network.exits, or write "somewhere"'
            )
        return exits
    if isinstance(goes, GoalFile):
        return _of_file(network, folder / goes.file)
    return together(goes, [places_of(goal, network, folder) for goal in goes])


def together(goals: Sequence[Goal], places: Sequence[Stretches]) -> Stretches:
    """Return the places of all goals, by the probabilities of the goals; without any: alike."""
    given = [1.0 if goal.p is None else goal.p for goal in goals]
    total = sum(given)
    pairs = list(zip(places, given, strict=True))
    return Stretches(
        np.concatenate([place.edge for place in places]),
        np.concatenate([place.from_m for place in places]),
        np.concatenate([place.to_m for place in places]),
        np.concatenate([place.probability * (p / total) for place, p in pairs]),
    )


def places_of(goal: Goal, network: RoadNetwork, folder: Path) -> Stretches:
    """Return the stretches of one goal.

    Raises
    ------
    InputError
        If there is no road, or a file does not hold what it should.
    """
    if goal.edge is not None:
        return _edges(network, {goal.edge: 1.0})
    if goal.taz is not None:
        zone = read_zone(folder / (goal.file or ""), goal.taz)
        if not zone.goals:
            return in_area(network, zone.corners)
        return _edges(network, zone.goals)
    if goal.lon is not None:
        x_m, y_m = map(float, xy_of_lonlat(network, np.array([goal.lon, goal.lat])))
    else:
        x_m, y_m = goal.x_m or 0.0, goal.y_m or 0.0
    if goal.radius_m is not None:
        return in_circle(network, x_m, y_m, goal.radius_m)
    return place_nearest_to(network, x_m, y_m)


def _edges(network: RoadNetwork, weights: Mapping[str, float]) -> Stretches:
    """Return whole edges as probable as they weigh; those that no car may use are left out."""
    index = network.edge_index
    some = {name: w for name, w in weights.items() if name in index and w > 0}
    if not some:
        named = ", ".join(list(weights)[:3])
        raise InputError(
            f"names no edge of this net that a car may use and that weighs more than 0 ({named}); "
            "correct it"
        )
    edge = np.array([index[name] for name in some])
    weight = np.array(list(some.values()))
    return Stretches(edge, np.zeros(len(edge)), network.edge_length_m[edge], weight / weight.sum())


def _of_file(network: RoadNetwork, path: Path) -> Goals:
    planned = read_routes(path)
    if planned.routes:
        return KnownRoutes.of(planned.routes, network, path)
    return _edges(network, planned.ends)


def reached_from(goals: Goals, network: RoadNetwork) -> Flags:
    """Return from which edges a target can come to one of its goals, (E,)."""
    if isinstance(goals, KnownRoutes):
        return goals.passes(len(network.edge_ids))
    return can_reach(network, goals.edge[goals.probability > 0])
