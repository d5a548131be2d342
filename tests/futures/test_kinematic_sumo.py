"""The kinematic clock against SUMO: the same routes from the same second of the signals' cycle."""

from dataclasses import replace

import numpy as np
import pytest

from planner.belief.particles import Particles
from planner.belief.prior import prior_of
from planner.belief.sampling import sample
from planner.futures.calibrate import calibrated
from planner.futures.clock_error import clock_error, distances
from planner.futures.kinematic import kinematic_futures
from planner.network.build import import_osm
from planner.network.read import read_net
from planner.network.road_network import RoadNetwork
from planner.network.signals import signal_cycle_s, signals_of
from planner.network.sumo import sumo_home
from planner.scenario.target import TargetSection
from support.data import data_file
from support.drives import driven
from support.signal_grid import signal_grid

HORIZON_S = 320
MOST_180_M, MOST_300_M = 15.0, 45.0
LEAST_RATIO, MOST_RATIO = 0.97, 1.03


def berlin() -> RoadNetwork:
    """The town that comes with SUMO; its signals are actuated."""
    return read_net(sumo_home() / "tools" / "game" / "DRT" / "osm.net.xml")


def luxembourg() -> RoadNetwork:
    """A whole town with fixed signals."""
    return read_net(import_osm(data_file("luxembourg.osm.gz")))


def cars(network: RoadNetwork, n: int, *, seed: int, route_s: float = HORIZON_S) -> Particles:
    """Cars from anywhere in the middle, with routes for at most some seconds."""
    middle = np.median(network.shape_xy_m, axis=0)
    away_m = np.linalg.norm(network.edge_xy(np.arange(len(network.edge_ids)), 0.0) - middle, axis=1)
    inner = [int(edge) for edge in np.argsort(away_m) if len(network.turns(int(edge)))][:60]
    target = TargetSection(
        start=[network.edge_ids[edge] for edge in inner],
        speed_mps={"uniform": [8, 25]},
        driving="constant",  # so that routes end where they would be then
    )
    rng = np.random.default_rng(seed)
    drawn = sample(prior_of(target, network), network, n, rng, horizon_s=route_s)
    phase_s = rng.integers(0, signal_cycle_s(network), n)
    return replace(drawn, driving="free", phase_s=phase_s)


@pytest.mark.slow
@pytest.mark.parametrize(
    "town", [berlin, pytest.param(luxembourg, marks=pytest.mark.long), signal_grid]
)
def test_the_clock_is_close_to_sumo(town: object) -> None:
    network: RoadNetwork = town()  # type: ignore[operator]
    # Some drive on to the horizon, and others arrive before it.
    far, near = cars(network, 60, seed=5), cars(network, 30, seed=6, route_s=60.0)
    signals = signals_of(network)
    error = clock_error(
        kinematic_futures(network, far, signals, horizon_s=HORIZON_S),
        driven(network, far, horizon_s=HORIZON_S),
    )
    assert error.at_180_s_m <= MOST_180_M
    assert error.at_300_s_m <= MOST_300_M
    arrivals = clock_error(
        kinematic_futures(network, near, signals, horizon_s=HORIZON_S),
        driven(network, near, horizon_s=HORIZON_S),
    )
    assert arrivals.arrived > 15
    assert LEAST_RATIO <= arrivals.arrival_ratio <= MOST_RATIO


@pytest.mark.slow
def test_the_phase_is_what_makes_it_close() -> None:
    # With signals half a cycle off, the same cars are elsewhere: the programs do the work.
    network = signal_grid()
    particles = cars(network, 40, seed=7)
    signals, recorded = signals_of(network), driven(network, particles, horizon_s=HORIZON_S)
    off_m = [
        clock_error(
            kinematic_futures(network, particles, signals, phase_s, horizon_s=HORIZON_S), recorded
        ).at_300_s_m
        for phase_s in (particles.phase_s, particles.phase_s + signal_cycle_s(network) // 2)
    ]
    assert off_m[0] < MOST_180_M < MOST_300_M < off_m[1]


@pytest.mark.slow
def test_calibration_brings_actuated_signals_closer() -> None:
    network = berlin()
    particles = cars(network, 150, seed=8)
    signals, recorded = signals_of(network), driven(network, particles, horizon_s=HORIZON_S)
    some, others = np.arange(100), np.arange(100, 150)
    calibration = calibrated(network, particles.take(some), recorded.take(some), signals=signals)
    unseen, known = particles.take(others), recorded.take(others)
    mean_m = []
    for driver in (None, calibration):
        clock = kinematic_futures(network, unseen, signals, horizon_s=HORIZON_S, calibration=driver)
        times = range(30, HORIZON_S, 30)
        mean_m.append(np.concatenate([distances(clock, known, t) for t in times]).mean())
    assert mean_m[1] < mean_m[0]
