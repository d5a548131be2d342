"""How well the kinematic clock guesses what SUMO recorded, net by net."""

import logging

import numpy as np

from planner.errors import InputError
from planner.futures.calibrate import MOST, calibrated
from planner.futures.clock_error import ClockError, clock_error
from planner.futures.futures import Futures
from planner.futures.kinematic import kinematic_futures
from planner.messages import percent
from planner.mission.recorder import Recorder
from planner.mission.traffic import on_its_clock
from planner.network.signals import Signals, signals_of

log = logging.getLogger(__name__)

AT_MINUTES = (5, 10, 20, 30)  # when the reach is told
SHARE = 0.9  # of the particles that are still there, within the reach


def planning_guess(recorder: Recorder) -> Futures | None:
    """Return where the planning particles may be, before SUMO drives any; None: no clock."""
    signals = _signals(recorder)
    if signals is None:
        return None
    horizon_s = recorder.opened.scenario.search.horizon_s
    particles = on_its_clock(recorder.planning_particles(), recorder.opened.traffic)
    return kinematic_futures(recorder.opened.network, particles, signals, horizon_s=horizon_s)


def reach_m(futures: Futures, at_s: float) -> tuple[float, float]:
    """Return how far particles are at a time from the middle of their starts, and how many.

    Returns
    -------
    tuple of float
        Within how many metres most of those are that are on the map then, NaN if none is; and the
        share of all particles that are.
    """
    first = futures.first_knot[:-1][np.diff(futures.first_knot) > 0]
    if len(first) == 0:
        return float("nan"), 0.0
    middle = np.array([futures.x_m[first].mean(), futures.y_m[first].mean()])
    away_m = np.linalg.norm(futures.positions(at_s) - middle, axis=1)
    there = np.isfinite(away_m)
    far_m = float(np.quantile(away_m[there], SHARE)) if there.any() else float("nan")
    return far_m, float(there.mean())


def told_reach(futures: Futures, horizon_s: float) -> str:
    """Return in a sentence how far a guessed cloud reaches, and how much of it is on the map."""
    minutes: list[float] = [m for m in AT_MINUTES if 60.0 * m <= horizon_s]
    reaches = [(m, *reach_m(futures, 60.0 * m)) for m in minutes or [horizon_s / 60.0]]
    reaches = [reach for reach in reaches if np.isfinite(reach[1])]
    if not reaches:
        return "a guess, before SUMO drives: all particles are gone by then"
    all_there = all(share == 1.0 for _, _, share in reaches)
    far = ", ".join(
        f"{far_m / 1000.0:.1f} km at {minute:g} min"
        + ("" if all_there else f" ({percent(share, 0)}{'' if k else ' of all are on it'})")
        for k, (minute, far_m, share) in enumerate(reaches)
    )
    those = "the particles" if all_there else "the particles that are on the map then"
    return (
        f"a guess, before SUMO drives: {percent(SHARE, 0)} of {those} are within {far} of the "
        "middle of their starts"
    )


def planning_clock_error(recorder: Recorder, recorded: Futures) -> ClockError | None:
    """Return how far the clock is from the recorded planning particles; None if there is no clock.

    Where signals are actuated, it is calibrated on half of the particles and measured on the rest.

    Parameters
    ----------
    recorded
        What ``recorder.planning()`` has recorded.
    """
    signals = _signals(recorder)
    if signals is None:
        return None
    network = recorder.opened.network
    particles = on_its_clock(recorder.planning_particles(), recorder.opened.traffic)
    measured, calibration = np.arange(len(particles)), None
    if signals.actuated.any() and particles.driving != "constant" and len(particles) > 1:
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


def _signals(recorder: Recorder) -> Signals | None:
    """Return what cars meet on a scenario's net; None if it has no clock."""
    network = recorder.opened.network
    if network.is_abstract:
        return None
    try:
        return signals_of(network)
    except InputError as error:
        log.warning("no kinematic clock: %s", error)
        return None
