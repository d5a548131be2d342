"""How many targets are driven beside the particles that plans are made on.

The numbers are looked up in a table, never taken from a clock: the same scenario has the same ones
on any machine. Where SUMO's driver drives, each second of a target's motion costs eighty times what
it costs at constant speed (`planner.futures.cost`), so there are fewer: in a town as many as make
the 95 % interval of a plan's figure less than 4 % of it to either side (in `berlin`, 2,100 make
2.4 %), and where these would take minutes, fewer still. In traffic a target costs most, and further
ones of the same realisations tell little.
"""

import math
from typing import NamedTuple

from planner.belief.particles import Driving
from planner.network.road_network import RoadNetwork
from planner.scenario.sections import Scenario

FRESH_TARGETS = 4000  # at constant speed


class Sizes(NamedTuple):
    """How many targets are driven."""

    holdout_factor: int  # times as many as are planned with, to choose between plans on
    fresh: int  # that a plan is evaluated on


class Row(NamedTuple):
    """For which targets some sizes are; the first row that fits counts."""

    driving: Driving
    edges: float  # of the net, at most
    horizon_s: float  # at most
    sizes: Sizes


TABLE = (
    Row("constant", math.inf, math.inf, Sizes(2, FRESH_TARGETS)),
    Row("free", 1500, 3600.0, Sizes(1, 2100)),
    Row("free", math.inf, 3600.0, Sizes(1, 1000)),
    Row("free", math.inf, math.inf, Sizes(1, 500)),
    Row("traffic", math.inf, math.inf, Sizes(1, 400)),
)


def sizes_for(network: RoadNetwork, driving: Driving, horizon_s: float) -> Sizes:
    """Return how many targets are driven on a net up to a horizon."""
    edges = len(network.edge_ids)
    return next(
        row.sizes
        for row in TABLE
        if row.driving == driving and edges <= row.edges and horizon_s <= row.horizon_s
    )


def holdout_particles(scenario: Scenario, network: RoadNetwork) -> int:
    """Return on how many particles, drawn from what is known, methods choose between plans."""
    search = scenario.search
    sizes = sizes_for(network, scenario.target.driving, search.horizon_s)
    return sizes.holdout_factor * search.particles


def fresh_targets(scenario: Scenario, network: RoadNetwork) -> int:
    """Return on how many true targets a plan is evaluated: as the scenario says, or the table."""
    if scenario.search.targets is not None:
        return scenario.search.targets
    return sizes_for(network, scenario.truth.driving, scenario.search.horizon_s).fresh
