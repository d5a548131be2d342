"""A net, or the scenario that names it, as `build` and `check` take either."""

import argparse
from pathlib import Path

from planner.cli.arguments import scenario_overrides
from planner.cli.session import opened_scenario
from planner.errors import InputError
from planner.mission.opening import OpenScenario
from planner.network.net_file import is_net_file
from planner.network.read import open_network
from planner.network.road_network import RoadNetwork
from planner.scenario.sections import OF_SUMO, NetworkSection


def opened_net(arguments: argparse.Namespace) -> tuple[RoadNetwork, OpenScenario | None]:
    """Return the network that was named, and the scenario if it was one.

    Raises
    ------
    InputError
        If there is none, it cannot be opened, or a net is given options of a scenario.
    """
    place = str(arguments.scenario)
    if not (place.startswith(OF_SUMO) or is_net_file(Path(place))):
        opened = opened_scenario(arguments)
        return opened.network, opened
    if scenario_overrides(arguments) or arguments.preset is not None:
        raise InputError(
            f"{place}: is a net; --set, --preset, --seed and -n go with a scenario, leave them out"
        )
    return open_network(NetworkSection(net=place), Path()), None
