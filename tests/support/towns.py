"""Scenarios in real towns: one on a net that comes with SUMO, one on data kept elsewhere."""

from pathlib import Path

import numpy as np

from planner.mission.opening import OpenScenario, open_scenario
from planner.network.read import open_network
from planner.network.road_network import RoadNetwork
from planner.scenario.sections import NetworkSection
from support.data import data_file

NEAR_M = 300.0  # from the middle of the town to where the target starts
LUXEMBOURG = """
title = "Luxembourg: a car last seen in the middle of the town"
[network]
osm = "{osm}"
[target]
start = {start}
speed_mps = {{ uniform = [8, 14] }}
driving = "free"
at_sink = "gone"
[uav]
speed_mps = 15
start = {{ x_m = {x_m:.1f}, y_m = {y_m:.1f} }}
take_off_s = 120
[sensor]
radius_m = 60
[search]
horizon_s = "0:30:00"
particles = 20
sampling = "sobol"
"""


def berlin() -> OpenScenario:
    """The shipped town, 740 edges, on a net that comes with SUMO."""
    return open_scenario("berlin")


def luxembourg(folder: Path) -> OpenScenario:
    """A town of about 5,700 edges, or skip the test where its data are not.

    Parameters
    ----------
    folder
        Where the scenario file is written; netconvert's net is kept in the cache of the tests.
    """
    osm = data_file("luxembourg.osm.gz")
    network = open_network(NetworkSection(osm=str(osm)), Path())
    low, high = network.shape_xy_m.min(axis=0), network.shape_xy_m.max(axis=0)
    x_m, y_m = (low + high) / 2
    names = edges_near(network, float(x_m), float(y_m))
    text = LUXEMBOURG.format(osm=osm.as_posix(), start=names, x_m=x_m, y_m=y_m)
    (folder / "scenario.toml").write_text(text.replace("'", '"'), encoding="utf-8")
    return open_scenario(folder)


def edges_near(network: RoadNetwork, x_m: float, y_m: float) -> list[str]:
    """Edges that lie whole within NEAR_M of a place and lead on."""
    return [
        name
        for edge, name in enumerate(network.edge_ids)
        if len(network.turns(edge))
        and np.hypot(*(network.edge_shape(edge) - (x_m, y_m)).T).max() <= NEAR_M
    ]
