"""The kinematic clock's driver, fitted to what SUMO recorded of some hundred particles."""

from dataclasses import replace
from itertools import product

import numpy as np

from planner.belief.particles import Particles
from planner.errors import InputError
from planner.futures.clock_error import distances
from planner.futures.futures import Futures
from planner.futures.kinematic import Calibration, kinematic_futures
from planner.network.road_network import RoadNetwork
from planner.network.signals import Signals

# What is fitted, the first steps tried, and the least values.
STEPS = {
    "yields_mps": (0.5, 1.0),
    "detector_s": (0.5, 0.0),
    "early_s": (0.3, -2.0),
    "late_s": (0.3, -2.0),
    "dawdles_mps": (0.1, 0.0),
    "accel": (0.2, 0.5),
}
ROUNDS = 3  # each with half the steps of the one before
MOST_STEPS = 4  # of one value, one way, in a round
EVERY_S = 30.0  # between times that are compared
FAR_M = 100.0  # a particle that is farther off, mostly for a missed green, counts as this far
MOST = 500  # particles that are looked at


def calibrated(
    network: RoadNetwork, particles: Particles, recorded: Futures, *, signals: Signals
) -> Calibration:
    """Return the driver with which the clock comes closest to recordings of the same particles.

    Parameters
    ----------
    particles
        A hundred are enough; of many, the first `MOST` are looked at.
    recorded
        What SUMO made of them.
    signals
        Of this network.

    Raises
    ------
    InputError
        If there is no particle, or another number of recorded ones.
    """
    if len(particles) != len(recorded) or len(particles) == 0:
        raise InputError(
            f"particles, recorded: are {len(particles)} and {len(recorded)}; give the same ones"
        )
    few = particles.take(np.arange(min(len(particles), MOST)))
    known = recorded.take(np.arange(len(few)))
    horizon_s = float(known.end_s.max())
    if not horizon_s > 0.0:
        raise InputError("recorded: nobody moves; record for longer")

    def off_m(calibration: Calibration) -> float:
        clock = kinematic_futures(
            network, few, signals, horizon_s=horizon_s, calibration=calibration
        )
        return _mean_distance(clock, known, horizon_s)

    best, best_m = Calibration(), off_m(Calibration())
    for share in (0.5**n for n in range(ROUNDS)):
        for name, way in product(STEPS, (-share, share)):
            for _ in range(MOST_STEPS):
                tried = _stepped(best, name, way)
                tried_m = off_m(tried) if tried is not None else np.inf
                if tried is None or tried_m >= best_m:
                    break
                best, best_m = tried, tried_m
    return best


def _stepped(driver: Calibration, name: str, way: float) -> Calibration | None:
    """Return a driver with one value a step further; None if it would be too low."""
    step, least = STEPS[name]
    value = getattr(driver, name) + way * step
    return replace(driver, **{name: value}) if value >= least else None


def _mean_distance(clock: Futures, recorded: Futures, horizon_s: float) -> float:
    times_s = np.arange(EVERY_S, horizon_s, EVERY_S) if horizon_s > EVERY_S else [horizon_s]
    off_m = [np.minimum(distances(clock, recorded, float(at_s)), FAR_M) for at_s in times_s]
    return float(np.concatenate(off_m).mean()) if sum(map(len, off_m)) else 0.0
