"""What it costs SUMO to drive targets, known before any is driven."""

from typing import NamedTuple

import numpy as np

from planner.belief.particles import Driving
from planner.futures.among_traffic import RIDERS
from planner.futures.record import SHARED
from planner.network.road_network import RoadNetwork

# Seconds of one core of an ordinary server; another one may take twice or half as long.
#
# Alone, in a fork: a target that SUMO's driver drives, for each second of its motion. Targets of
# 20 minutes took 20 ms on a net of 740 edges and 35 ms on one of 5,749: a line through both.
ALONE_S, ALONE_EDGE_S = 1.48e-5, 2.5e-9
# In traffic: each vehicle in the net, for each step of a second, and how many there are as a rule.
# Nobody knows before SUMO has driven them: 70 in a quarter, 600 in a rush hour.
VEHICLE_S, VEHICLES = 1.0e-5, 200
# A process reads the net once: 0.34 s and 1.2 s on the same two.
LOAD_S, LOAD_EDGE_S = 0.21, 1.72e-4
# Shared: one of a hundred targets at constant speed that share a run, for each second up to the
# horizon; 2.0e-7 to 2.4e-7 on the 5 x 5 grid. Each run reads the net again, which is small.
SHARED_S, SHARED_RUN_S = 2.2e-7, 0.01


class Cost(NamedTuple):
    """What a recording costs."""

    runs: int  # of SUMO; a ride in a fork is one
    cpu_s: float  # of one core, for all of them
    load_s: float  # for each process, before its first run

    def times(self, sets: int) -> "Cost":
        """Return that of so many recordings, each with runs of its own."""
        return Cost(sets * self.runs, sets * self.cpu_s, sets * self.load_s)

    def plus(self, other: "Cost") -> "Cost":
        """Return that of both, one after the other."""
        return Cost(self.runs + other.runs, self.cpu_s + other.cpu_s, self.load_s + other.load_s)

    def wall_s(self, workers: int) -> float:
        """Return how long it takes with some processes, seconds."""
        return self.load_s + self.cpu_s / max(1, min(workers, self.runs))


def cost_of(network: RoadNetwork, particles: int, *, driving: Driving, horizon_s: float) -> Cost:
    """Return what it costs to record particles; those that end early cost less.

    Parameters
    ----------
    driving
        As the particles have it: with a driver each rides alone, which counts as a run. In traffic
        a copy of it does; what it costs to warm it up is left out.
    horizon_s
        Up to when they are recorded, seconds on the target's clock.
    """
    if shares_runs(network, driving):
        runs = -(-particles // SHARED)
        return Cost(runs, SHARED_S * horizon_s * particles + SHARED_RUN_S * runs, 0.0)
    edges = len(network.edge_ids)
    load_s = LOAD_S + LOAD_EDGE_S * edges
    if driving == "traffic":
        copies = -(-particles // RIDERS)
        return Cost(copies, VEHICLE_S * VEHICLES * horizon_s * copies, load_s)
    each_s = (ALONE_S + ALONE_EDGE_S * edges) * horizon_s
    return Cost(particles, each_s * particles, load_s)


def shares_runs(network: RoadNetwork, driving: Driving) -> bool:
    """Return whether many particles share a run wherever they drive on a net."""
    return driving == "constant" and bool(np.all(network.edge_lanes == 1))
