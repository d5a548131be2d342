"""What deserves to be known of a scenario before it is planned, though nothing is at fault."""

from collections.abc import Iterator

import numpy as np

from planner.arrays import Floats
from planner.belief.mixture import OneBelief, Several, parts_of
from planner.mission.aircraft import aircraft_of, never_flown, not_kept
from planner.mission.opening import OpenScenario
from planner.network.road_network import RoadNetwork
from planner.network.survey import edges_told, reach_m
from planner.scenario.checks import slow_uav_warning
from planner.scenario.listed import keys_of, named_for

YARD_SHARE = 0.05  # of the net's metres: who gets to less, and not off the map, is shut in
FAR_M = 2000.0  # from any road
FOR_A_ROAD = 30  # particles; measured on grids: with fewer a plan is 3 % worse than its own figure


def scenario_remarks(opened: OpenScenario) -> list[str]:
    """Return what is odd about a scenario on its net, a line each."""
    slow = slow_uav_warning(opened.scenario)
    return [
        *([slow] if slow else []),
        *_few(opened),
        *_yards(opened),
        *_far(opened),
        *_not_exported(opened),
        *opened.notes,
    ]


def _few(opened: OpenScenario) -> Iterator[str]:
    """Yield advice where particles are few for the roads; towns have one of their own."""
    search, roads = opened.scenario.search, len(opened.network.road_ids)
    is_sample = search.sampling != "all" and opened.network.is_abstract
    enough = FOR_A_ROAD * roads * len(opened.scenario.targets)  # which share them
    if is_sample and search.particles < enough:
        yield (
            f"search.particles: {search.particles:,} are few for {roads:,} roads, on which plans "
            f"may do much worse than their own figure; {enough:,} or more are enough"
        )


def _yards(opened: OpenScenario) -> Iterator[str]:
    prior, targets = opened.prior, opened.scenario.targets
    beliefs = prior.targets if isinstance(prior, Several) else (prior,)
    keys = keys_of("target", len(targets))
    for key, target, belief in zip(keys, targets, beliefs, strict=True):
        yield from _yards_of(key, target.start, belief, opened.network)


def _yards_of(
    section: str, start: object, belief: OneBelief, network: RoadNetwork
) -> Iterator[str]:
    """Yield where a target may start and gets nowhere."""
    if isinstance(start, str) or network.is_abstract:
        return
    probability = sum(prior.edge_probability for prior in parts_of(belief))
    most_m = YARD_SHARE * float(network.edge_length_m.sum())
    reach = ((edge, reach_m(network, edge)) for edge in np.flatnonzero(probability).tolist())
    yards = {network.edge_ids[edge]: metres for edge, metres in reach if metres < most_m}
    if isinstance(start, dict):
        for name, metres in yards.items():
            yield f"{section}.start.{name}: is a yard: {_shut_in(metres)}"
    elif yards:
        told = edges_told(tuple(yards), "are part of it are yards")
        yield f"{section}.start: {told}; {_shut_in(max(yards.values()))}"


def _shut_in(metres: float) -> str:
    return f"no car gets farther from there than {metres:,.0f} m of roads, and none leaves the map"


def _far(opened: OpenScenario) -> Iterator[str]:
    keys = keys_of("uav", len(opened.starts_m))
    for key, start, home in zip(keys, opened.starts_m, opened.landings_m, strict=True):
        places = {f"{key}.start": start, **({f"{key}.return_to": home} if home else {})}
        for name, place in places.items():
            away_m = off_roads_m(opened.network, np.array(place))
            if away_m > FAR_M:
                yield f"{name}: lies {away_m / 1000:,.1f} km from the nearest road"


def _not_exported(opened: OpenScenario) -> Iterator[str]:
    """Yield why `planner export` will refuse any plan, where a flight of a real drone is planned.

    On abstract nets that is one of which something is said: the paper's is not meant to be flown.
    """
    uavs = opened.scenario.uavs
    for number, uav in enumerate(uavs):
        aircraft = aircraft_of(uav)
        if aircraft is None and opened.network.is_abstract:
            continue
        faults = [*never_flown(uav)]
        if aircraft is not None:
            faults += not_kept(aircraft.law, climbs=uav.in_air is None)
        for fault in named_for(f"uav[{number}]" if len(uavs) > 1 else "uav", faults):
            yield f"`planner export` will refuse a plan: {fault}"


def off_roads_m(network: RoadNetwork, xy_m: Floats) -> float:
    """Return how far a place, (2,) metres, lies from the nearest road, metres."""
    return network.road_lines.nearest(xy_m).away_m
