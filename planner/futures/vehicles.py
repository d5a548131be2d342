"""Particles in SUMO's words."""

from typing import Any

from planner.arrays import Offsets
from planner.belief.particles import Particles
from planner.futures.simulation import Vehicle
from planner.network.road_network import RoadNetwork


def vehicles_of(network: RoadNetwork, particles: Particles, batch: Offsets) -> tuple[Vehicle, ...]:
    """Return some particles as vehicles, named by their numbers."""
    return tuple(_vehicle(network, particles, k) for k in batch.tolist())


def _vehicle(network: RoadNetwork, particles: Particles, k: int) -> Vehicle:
    route: Any = particles.route(k)
    return Vehicle(
        name=str(k),
        edges=tuple(network.edge_ids[edge] for edge in route),
        speeds_mps=tuple(particles.speeds(k).tolist()),
        lengths_m=tuple(network.edge_length_m[route].tolist()),
        start_m=float(particles.start_m[k]),
        depart_s=float(particles.depart_s[k]),
        stop_s=float(particles.stop_s[k]),
        end_m=float(particles.end_m[k]),
        flees_s=float(particles.flees_s[k]),
        flees=float(particles.flees[k]),
    )
