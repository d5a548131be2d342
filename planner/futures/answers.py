"""What processes that run SUMO answer, as futures of the particles that it is of."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Offsets
from planner.belief.particles import Particles
from planner.errors import SumoError
from planner.futures.among_traffic import futures_of_riders
from planner.futures.fcd import Samples, read_samples
from planner.futures.futures import Futures
from planner.futures.knots import DrivenRoutes, futures_of_samples
from planner.futures.riders import Ridden, TrafficSession
from planner.futures.rides import Ride, Session
from planner.futures.simulation import Run
from planner.futures.timing import as_timed
from planner.futures.tracks import futures_of_tracks, tracks_of_rides
from planner.locks import temporary_folder
from planner.network.road_network import RoadNetwork

KNOT_EVERY_S = 300.0  # in towns recordings have knots there, so that they can be cut


class Batch(NamedTuple):
    """What a process is asked for, and of which particles each part of its answer is."""

    parts: tuple[Offsets, ...]
    task: Run | Session | TrafficSession


def collected(
    network: RoadNetwork,
    particles: Particles,
    batch: Batch,
    answer: bytes | list[Ride] | Ridden,
    tolerance_m: float,
) -> tuple[Offsets, Futures]:
    """Return which particles a part of an answer is of, and their futures, without weights."""
    task = batch.task
    if isinstance(task, TrafficSession):
        assert isinstance(answer, Ridden)
        futures = futures_of_riders(
            answer, task.realisation, network, tolerance_m=tolerance_m, every_s=KNOT_EVERY_S
        )
        return batch.parts[answer.number], futures
    (some,) = batch.parts
    if isinstance(task, Session):
        assert isinstance(answer, list)
        tracks = tracks_of_rides(answer, network, step_s=task.step_s)
        in_town = task.free and not network.is_abstract
        every_s = KNOT_EVERY_S if in_town else None
        return some, futures_of_tracks(tracks, tolerance_m=tolerance_m, every_s=every_s)
    assert isinstance(answer, bytes)
    samples = _samples(task, answer, network)
    numbers = np.array([int(name) for name in samples.names])
    routes = DrivenRoutes(
        [particles.route(k) for k in numbers], [particles.speeds(k) for k in numbers]
    )
    ended = (task.end_s, task.step_s)
    futures = futures_of_samples(
        samples, network, routes=routes, ended=ended, tolerance_m=tolerance_m
    )
    return some, as_timed(
        futures.take(np.argsort(numbers)), particles.take(np.sort(numbers)), network, task.end_s
    )


def _samples(run: Run, content: bytes, network: RoadNetwork) -> Samples:
    """Return what SUMO recorded of a shared run.

    Raises
    ------
    SumoError
        If a vehicle never entered the net.
    """
    with temporary_folder() as work:
        path = work / "fcd.parquet"
        path.write_bytes(content)
        samples = read_samples(path, network)
    missing = {vehicle.name for vehicle in run.vehicles} - set(samples.names)
    if missing:
        raise SumoError(f"SUMO never let particle {min(missing)} into {network.given_as}")
    return samples
