"""Drives particles through SUMO and records their futures."""

import logging
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from planner.arrays import Offsets
from planner.belief.particles import Particles
from planner.checked import number, whole
from planner.errors import InputError
from planner.futures.edges_driven import EdgesDriven
from planner.futures.futures import Futures
from planner.futures.knots import TOLERANCE_M, DrivenRoutes, futures_of_samples
from planner.futures.simulation import Run, Vehicle, simulate
from planner.futures.workers import in_processes
from planner.network.road_network import RoadNetwork
from planner.progress import Progress

log = logging.getLogger(__name__)

# Constants of the recording, never derived from the number of workers: the same particles give
# the same bytes on any machine.
SHARED = 100  # particles in one run, where they can be kept from noticing each other
STRAIGHT_STEP_S = 10.0  # knots at the ends of straight roads come from distance and speed
STEP_S = 1.0
TOWN_TOLERANCE_M = 5.0  # how far futures in towns may be from what SUMO recorded
POINT_M = 0.02  # lengths in net files have two decimals


def record(
    network: RoadNetwork,
    particles: Particles,
    *,
    horizon_s: float,
    tolerance_m: float | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Futures:
    """Return the futures of particles, as SUMO drives them up to the horizon.

    Parameters
    ----------
    horizon_s
        Seconds on the target's clock up to which motion is recorded.
    tolerance_m
        How far futures may be from what SUMO recorded, metres; None: as `tolerance_of` has it.
    workers
        Processes; one per core if not given. They change nothing in the result.
    progress
        Called with the particles recorded so far and their number.

    Raises
    ------
    SumoError
        With SUMO's own message, or if a process that runs it dies.
    """
    horizon_s = number("horizon_s", horizon_s, above=0.0)
    workers = None if workers is None else whole("workers", workers, least=1)
    if len(particles) == 0:
        raise InputError("particles: there is none to record; draw at least one")
    batches = _batches(network, particles)
    parts: list[Futures] = []
    tolerance_m = tolerance_of(network, tolerance_m)
    drive = partial(record_batch, network, particles, horizon_s=horizon_s, tolerance_m=tolerance_m)
    for part in in_processes(drive, batches, workers=workers):
        parts.append(part)
        if progress is not None:
            progress(sum(map(len, parts)), len(particles))
    return joined(parts, particles)


def tolerance_of(network: RoadNetwork, tolerance_m: float | None) -> float:
    """Return how far futures may be from what SUMO recorded, metres, where it may not be given.

    Raises
    ------
    InputError
        If the one given is not above 0.
    """
    if tolerance_m is not None:
        return number("tolerance_m", tolerance_m, above=0.0)
    return TOLERANCE_M if _is_abstract(network) else TOWN_TOLERANCE_M


def joined(parts: Sequence[Futures], particles: Particles) -> Futures:
    """Return batches of futures as one, with the particles' weights, ends and targets."""
    counts = np.concatenate([np.diff(part.first_knot) for part in parts])
    return Futures(
        time_s=np.concatenate([part.time_s for part in parts]),
        x_m=np.concatenate([part.x_m for part in parts]),
        y_m=np.concatenate([part.y_m for part in parts]),
        first_knot=np.concatenate(([0], np.cumsum(counts))),
        weight=particles.weight,
        gone=particles.gone,
        target=particles.target,
        edges=EdgesDriven.joined([part.edges for part in parts]),
    )


def _batches(network: RoadNetwork, particles: Particles) -> list[Offsets]:
    """Particles that may share a run: many where nothing but their own speed drives them."""
    one_lane = bool(np.all(network.edge_lanes[particles.route_edge] == 1))
    size = SHARED if particles.driving == "constant" and one_lane else 1
    return [np.arange(i, min(i + size, len(particles))) for i in range(0, len(particles), size)]


def record_batch(
    network: RoadNetwork,
    particles: Particles,
    batch: Offsets,
    *,
    horizon_s: float,
    tolerance_m: float,
) -> Futures:
    """Return the futures of some particles, out of one SUMO run; weights are not theirs yet."""
    run = _run(network, particles, batch, horizon_s)
    samples = simulate(network, run)
    numbers = [batch[int(name)] for name in samples.names]
    constant = particles.driving == "constant"
    routes = DrivenRoutes(
        [particles.route(k) for k in numbers],
        [particles.speeds(k) for k in numbers] if constant else None,
    )
    futures = futures_of_samples(
        samples,
        network,
        routes=routes,
        ended=(horizon_s, run.step_s),
        tolerance_m=tolerance_m,
    )
    return futures.take(np.argsort(numbers))


def _run(network: RoadNetwork, particles: Particles, batch: Offsets, horizon_s: float) -> Run:
    constant = particles.driving == "constant"
    vehicles = tuple(_vehicle(network, particles, k, str(i)) for i, k in enumerate(batch.tolist()))
    return Run(
        vehicles=vehicles,
        free=not constant,
        seed=int(particles.seed[batch[0]]),
        step_s=STRAIGHT_STEP_S if constant and _is_abstract(network) else STEP_S,
        end_s=horizon_s,
    )


def _is_abstract(network: RoadNetwork) -> bool:
    """Return whether edges run straight from node to node: junctions are points, all is exact."""
    straight = len(network.shape_xy_m) == 2 * len(network.road_ids)
    away_m = network.edge_length_m - network.road_length_m[network.edge_road]
    return straight and bool(np.all(np.abs(away_m) <= POINT_M))


def _vehicle(network: RoadNetwork, particles: Particles, k: int, name: str) -> Vehicle:
    route: Any = particles.route(k)
    return Vehicle(
        name=name,
        edges=tuple(network.edge_ids[edge] for edge in route),
        speeds_mps=tuple(particles.speeds(k).tolist()),
        lengths_m=tuple(network.edge_length_m[route].tolist()),
        start_m=float(particles.start_m[k]),
        depart_s=float(particles.depart_s[k]),
    )
