"""Two edges with a signal between them, written by hand: what a car does can be reckoned."""

from pathlib import Path

import numpy as np

from planner.belief.particles import Driving, Particles
from planner.network.road_network import RoadNetwork
from planner.network.signals import GO, STOP, Signals

RED_S, GREEN_S = 40, 50


def street() -> RoadNetwork:
    """500 m of lane, 10 m of junction, 500 m of lane, due east."""
    return RoadNetwork(
        node_ids=("a", "b", "c"),
        node_xy_m=np.array([[0.0, 0.0], [505.0, 0.0], [1010.0, 0.0]]),
        road_ids=("ab", "bc"),
        road_from=np.array([0, 1]),
        road_to=np.array([1, 2]),
        first_point=np.array([0, 2, 4]),
        shape_xy_m=np.array([[0.0, 0.0], [505.0, 0.0], [505.0, 0.0], [1010.0, 0.0]]),
        edge_ids=("ab", "bc"),
        edge_road=np.array([0, 1]),
        edge_length_m=np.array([500.0, 500.0]),
        edge_limit_mps=np.array([50.0, 50.0]),
        edge_lanes=np.array([1, 1]),
        first_turn=np.array([0, 1, 1]),
        turn_edge=np.array([1]),
        path=Path("street.net.xml"),
        sha256="0" * 64,
    )


def lights(
    *,
    through_mps: float = 50.0,
    offset_s: int = 0,
    green: int = GO,
    signal: bool = True,
    minor: bool = False,
    actuated: bool = False,
) -> Signals:
    """Red for 40 s, green for 50 s, from SUMO's second 0 on."""
    shows = [STOP] * RED_S + [green] * GREEN_S if signal else []
    return Signals(
        first_second=np.array([0, len(shows)]),
        shows=np.array(shows),
        offset_s=np.array([offset_s]),
        cycle_s=np.array([len(shows)]),
        actuated=np.array([actuated]),
        minor=np.array([minor]),
        first_point=np.array([0, 2, 4, 6]),
        xy_m=np.array([[0, 0], [500, 0], [510, 0], [1010, 0], [500, 0], [510, 0.0]]),
        length_m=np.array([500.0, 500.0, 10.0]),
        limit_mps=np.array([50.0, 50.0, through_mps]),
    )


def driver_on(
    *,
    speed_mps: float = 10.65,
    start_m: float = 0.0,
    phase_s: int = 0,
    depart_s: float = 0.0,
    gone: bool = False,
    driving: Driving = "free",
) -> Particles:
    """One car that goes at 10 m/s in the mean."""
    return Particles(
        weight=np.ones(1),
        start_m=np.array([start_m]),
        depart_s=np.array([depart_s]),
        first_edge=np.array([0, 2]),
        route_edge=np.array([0, 1]),
        speed_mps=np.array([speed_mps, speed_mps]),
        seed=np.ones(1),
        gone=np.array([gone]),
        driving=driving,
        phase_s=np.array([phase_s]),
    )
