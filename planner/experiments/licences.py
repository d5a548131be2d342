"""Under which licence what is derived from a road network can be passed on, and the notice."""

from planner.network.road_network import RoadNetwork

ODBL, APACHE = "ODbL-1.0", "Apache-2.0"
OPEN_DATABASE = (
    "The roads were made from OpenStreetMap, {credit}, and come with Eclipse SUMO. They, and all "
    "that is derived from them here, are made available under the Open Database License 1.0: "
    "https://opendatacommons.org/licenses/odbl/1-0/. Any rights in individual contents are "
    "licensed under the Database Contents License 1.0: "
    "https://opendatacommons.org/licenses/dbcl/1-0/. Name the contributors with whatever you make "
    "of them: https://www.openstreetmap.org/copyright.\n"
)
INVENTED = "The roads are invented. They, and all that is here, are under the Apache License 2.0.\n"


def licence_of(network: RoadNetwork) -> str:
    """Return the licence's identifier, as SPDX has it."""
    return ODBL if "OpenStreetMap" in network.attribution else APACHE


def notice_of(network: RoadNetwork) -> str:
    """Return what has to stand beside everything that is derived from the network."""
    is_open = licence_of(network) == ODBL
    return OPEN_DATABASE.format(credit=network.attribution) if is_open else INVENTED
