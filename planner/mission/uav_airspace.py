"""Where a UAV of a scenario may fly, and whether it can be where the scenario has it."""

from planner.errors import Fault
from planner.flight.airspace import Airspace
from planner.mission.areas import airspace_of, place_faults
from planner.mission.uav_places import (
    far_faults,
    landing_faults,
    return_xy,
    start_xy,
    uav_faults,
)
from planner.network.road_network import RoadNetwork
from planner.scenario.draft import Draft
from planner.scenario.sections import Scenario
from planner.scenario.uav import UavSection


def airspace_for(
    uav: UavSection, said: Draft | Scenario, network: RoadNetwork, *, sound: bool = True
) -> tuple[Airspace | None, list[Fault]]:
    """Return where a UAV may fly, None for anywhere, and what is wrong with its places.

    Parameters
    ----------
    said
        Where the areas, the horizon and the sensor are said.
    sound
        Whether nothing else of it is faulty.
    """
    faults = [*uav_faults(uav, network)]
    sound = sound and not faults
    airspace, found = airspace_of(said.airspace, said.folder, network, uav if sound else None)
    faults += found
    if not sound:
        return airspace, faults
    faults += landing_faults(uav, network)
    if said.search is not None and said.sensor is not None:
        reach_m = uav.speed_mps * said.search.horizon_s + said.sensor.radius_m
        faults += far_faults(uav, network, reach_m)
    if airspace is not None:
        start, home = start_xy(uav.start, network), return_xy(uav, network)
        faults += place_faults(airspace, network, start, home)
    return airspace, faults
