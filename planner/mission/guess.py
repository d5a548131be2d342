"""How well the kinematic clock guesses what SUMO recorded, net by net."""

import logging

import numpy as np

from planner.errors import InputError
from planner.futures.calibrate import MOST, calibrated
from planner.futures.clock_error import ClockError, clock_error
from planner.futures.futures import Futures
from planner.futures.kinematic import kinematic_futures
from planner.mission.recorder import Recorder
from planner.network.signals import signals_of

log = logging.getLogger(__name__)


def planning_clock_error(recorder: Recorder, recorded: Futures) -> ClockError | None:
    """Return how far the clock is from the recorded planning particles; None if there is no clock.

    Where signals are actuated, it is calibrated on half of the particles and measured on the rest.

    Parameters
    ----------
    recorded
        What ``recorder.planning()`` has recorded.
    """
    network = recorder.opened.network
    if network.is_abstract:
        return None
    try:
        signals = signals_of(network)
    except InputError as error:
        log.warning("no kinematic clock: %s", error)
        return None
    particles = recorder.planning_particles()
    measured, calibration = np.arange(len(particles)), None
    if signals.actuated.any() and particles.driving == "free" and len(particles) > 1:
        half = measured[: min(len(particles) // 2, MOST)]
        measured = measured[len(half) :]
        calibration = calibrated(
            network, particles.take(half), recorded.take(half), signals=signals
        )
    clock = kinematic_futures(
        network,
        particles.take(measured),
        signals,
        horizon_s=recorder.opened.scenario.search.horizon_s,
        calibration=calibration,
    )
    return clock_error(clock, recorded.take(measured))
