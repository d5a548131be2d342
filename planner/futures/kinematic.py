"""A kinematic clock beside SUMO: where particles may be, in next to no time; a guess.

It drives each particle by speed limits, turn speeds, start-up and corner losses and the net's own
signal programs. The clock proposes, SUMO decides: candidates may be searched on it, but what is
chosen, and every figure that is told, comes from recordings.
"""

from dataclasses import astuple, dataclass, replace

import numpy as np

from planner.arrays import Floats, Ints
from planner.belief.particles import Particles
from planner.checked import lengths, number
from planner.errors import InputError
from planner.futures.edges_driven import EdgesDriven
from planner.futures.futures import Futures
from planner.futures.kernels.driver import Driver
from planner.futures.kernels.kinematic import Cars, Roads, Scene, drive_cars
from planner.futures.kernels.motion import Lines
from planner.network.road_network import RoadNetwork
from planner.network.signals import Signals

TOLERANCE_M = 2.5  # of knots in x and in y
AT_ONCE = 1e9  # m/s2


@dataclass(frozen=True)
class Calibration:
    """How SUMO's driver of default type moves in the mean, with steps of one second.

    It may accelerate by 2.6 m/s2 and brake by 4.5 m/s2, and dawdles by up to 1.3 m/s in each step,
    by 0.65 m/s in the mean, at any speed and while it speeds up.
    """

    accel: float = 1.95  # m/s2
    decel: float = 4.5  # m/s2
    dawdles_mps: float = 0.65  # below the speed that it may drive
    yields_mps: float = 4.5  # at the line where it gives way
    late_s: float = 0.3  # by which it decides later to stop than it should brake
    early_s: float = 0.2  # by which it is off before the sample of the first green second
    # at the limit, before the line: who is there prolongs an actuated green
    detector_s: float = 1.0


# Whoever drives at a constant speed heeds nothing.
CONSTANT = Driver(AT_ONCE, AT_ONCE, 0.0, np.inf, 0.0, 0.0, 0.0)


def kinematic_futures(
    network: RoadNetwork,
    particles: Particles,
    signals: Signals,
    phase_s: Ints | None = None,
    *,
    horizon_s: float,
    calibration: Calibration | None = None,
) -> Futures:
    """Return where particles may be up to a horizon: a guess of what SUMO would record.

    Parameters
    ----------
    signals
        Of this network.
    phase_s
        (N,) second of the signals' cycle at which each particle's time is 0; its own if not given.
    horizon_s
        Seconds on the target's clock.
    calibration
        That of `planner.futures.calibrate.calibrated`; SUMO's default driver if not given.

    Raises
    ------
    InputError
        If the network is abstract: there SUMO is exact and as fast, and no clock exists.
    """
    horizon_s = number("horizon_s", horizon_s, above=0.0)
    if network.is_abstract:
        raise InputError(f"{network.given_as}: is abstract; there is no kinematic clock for it")
    phase_s = particles.phase_s if phase_s is None else np.asarray(phase_s)
    lengths(len(particles), phase_s=phase_s)
    lengths(len(network.turn_edge), signals=signals.minor)
    cars = Cars(
        particles.first_edge,
        particles.route_edge,
        particles.speed_mps,
        particles.start_m,
        particles.depart_s,
        phase_s.astype(np.int32),
        particles.stop_s,
        particles.end_m,
        particles.flees_s,
        particles.flees,
    )
    free = particles.driving != "constant"
    roads = _roads(network, signals, free=free)
    driver = Driver(*astuple(calibration or Calibration())) if free else CONSTANT
    scene = Scene(roads, cars, driver, horizon_s)
    knots, first_knot, changes, first_change = drive_cars(scene, TOLERANCE_M)
    laid, changed = slice(0, first_knot[-1]), slice(0, first_change[-1])
    futures = Futures(
        time_s=knots.time_s[laid],
        x_m=knots.x_m[laid],
        y_m=knots.y_m[laid],
        first_knot=first_knot,
        weight=particles.weight,
        gone=particles.gone,
        target=particles.target,
        edges=EdgesDriven(first_change, changes.time_s[changed], changes.edge[changed]),
    )
    return replace(futures, gone=particles.gone_after(futures.end_s))


def _roads(network: RoadNetwork, signals: Signals, *, free: bool) -> Roads:
    """Return what cars meet; who does not drive freely meets neither limits nor signals."""
    # Copies, so that compiled code meets the same kinds of arrays either way.
    limit_mps, first_second = signals.limit_mps.copy(), signals.first_second.copy()
    minor = signals.minor.copy()
    if not free:
        limit_mps[:], first_second[:], minor[:] = np.inf, 0, False
    return Roads(
        first_turn=network.first_turn,
        turn_edge=network.turn_edge,
        length_m=signals.length_m,
        limit_mps=limit_mps,
        first_second=first_second,
        shows=signals.shows,
        offset_s=signals.offset_s,
        actuated=signals.actuated,
        minor=minor,
        lines=Lines(signals.first_point, _points(signals)),
    )


def _points(signals: Signals) -> Floats:
    """Return the points of all lines with how far along they are as SUMO drives, (P, 3)."""
    first, last = signals.first_point[:-1], signals.first_point[1:] - 1
    steps_m = np.linalg.norm(np.diff(signals.xy_m, axis=0, prepend=signals.xy_m[:1]), axis=1)
    steps_m[first] = 0.0
    travelled_m = np.cumsum(steps_m)
    count = np.diff(signals.first_point)
    along_m = travelled_m - np.repeat(travelled_m[first], count)
    drawn_m = along_m[last]
    scale = np.divide(signals.length_m, drawn_m, out=np.ones(len(last)), where=drawn_m > 0.0)
    along_m *= np.repeat(scale, count)
    along_m[last] = signals.length_m
    return np.column_stack([signals.xy_m, along_m])
