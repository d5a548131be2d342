"""Which particles ride together in which realisation of the traffic, and what became of them."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Offsets
from planner.belief.particles import Particles
from planner.futures.fates import Fates
from planner.futures.futures import Futures
from planner.futures.riders import DRIVEN_S, Ridden, TrafficSession
from planner.futures.tracks import futures_of_tracks, motion_of, tracks_of_rides
from planner.futures.traffic import Traffic
from planner.futures.vehicles import vehicles_of
from planner.network.road_network import RoadNetwork

# Constants of the recording, never derived from the number of workers.
RIDERS = 10  # particles in one copy of the traffic
ALONE_EVERY = 4  # copies, of one of which the first particle rides once more without the others


class Riding(NamedTuple):
    """Who rides in which copy of a session."""

    together: tuple[Offsets, ...]
    session: TrafficSession


def ridings(
    network: RoadNetwork,
    particles: Particles,
    missing: Offsets,
    traffic: Traffic,
    horizon_s: float,
    workers: int,
) -> Iterator[Riding]:
    """Yield a session for each realisation, with the copies in which someone is missing.

    With more processes than realisations a realisation is parted, each part of which is warmed up.
    """
    realisations = np.unique(particles.realisation[missing]).tolist()
    shares = -(-workers // max(1, len(realisations)))
    for realisation in realisations:
        copies = [
            (number, copy)
            for number, copy in enumerate(copies_of(particles, realisation))
            if np.isin(copy, missing).any()
        ]
        for part in np.array_split(np.arange(len(copies)), min(shares, len(copies))):
            numbers, together = zip(*(copies[k] for k in part), strict=True)
            yield Riding(
                together,
                TrafficSession(
                    net=network.path.absolute(),
                    given_as=network.given_as,
                    traffic=traffic,
                    realisation=realisation,
                    together=tuple(vehicles_of(network, particles, copy) for copy in together),
                    alone=tuple(number % ALONE_EVERY == 0 for number in numbers),
                    end_s=horizon_s,
                ),
            )


def copies_of(particles: Particles, realisation: int) -> list[Offsets]:
    """Return who rides together in a realisation, copy by copy."""
    there = np.flatnonzero(particles.realisation == realisation)
    return np.split(there, np.arange(RIDERS, len(there), RIDERS))


def futures_of_riders(
    ridden: Ridden, realisation: int, network: RoadNetwork, *, tolerance_m: float, every_s: float
) -> Futures:
    """Return the futures of those that rode in one copy, with their fates."""
    tracks = tracks_of_rides(ridden.rides, network, step_s=ridden.step_s)
    futures = futures_of_tracks(tracks, tolerance_m=tolerance_m, every_s=every_s)
    return replace(futures, fates=_fates(ridden, realisation))


def _fates(ridden: Ridden, realisation: int) -> Fates:
    count = len(ridden.rides)
    driven_m, alone_m = np.full(count, np.nan), np.full(count, np.nan)
    if ridden.alone is not None:
        driven_m[0], alone_m[0] = (
            _driven_m(motion_of(ride, ridden.step_s)) for ride in (ridden.rides[0], ridden.alone)
        )
    late_s, took_over, teleports = zip(*ridden.fates, strict=True)
    return Fates(
        realisation=np.full(count, realisation),
        late_s=np.array(late_s),
        took_over=np.array(took_over),
        teleports=np.array(teleports),
        driven_m=driven_m,
        alone_m=alone_m,
    )


def _driven_m(motion: Floats) -> float:
    """Return how far a vehicle came in the first seconds, along its way, metres."""
    some = motion[motion[:, 0] <= motion[0, 0] + DRIVEN_S]
    return float(np.hypot(*np.diff(some[:, 1:], axis=0).T).sum())
