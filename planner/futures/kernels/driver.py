"""How a driver speeds up, brakes, and stops in time, on one line; compiled."""

from typing import NamedTuple

import numpy as np

from planner.futures.kernels.motion import Lines, Moment, Place, Trace, drive
from planner.jit import compiled

CRAWL_MPS = 0.1  # the least speed of a car that moves


class Driver(NamedTuple):
    """How SUMO's driver moves; `planner.futures.kinematic.Calibration` says what is what."""

    accel: float
    decel: float
    dawdles_mps: float
    yields_mps: float
    late_s: float
    early_s: float
    detector_s: float


class Stretch(NamedTuple):
    """What lies ahead on a line."""

    to_m: float  # along the line
    even_mps: float  # the greatest speed on the way
    exit_mps: float  # the greatest speed there


class Stop(NamedTuple):
    """Where and when a car has to brake to stop at a line's end."""

    at_m: float
    time_s: float
    speed_mps: float


@compiled
def mean_speed(driver: Driver, speed_mps: float) -> float:
    """Return at which speed a driver goes in the mean who may go at another one."""
    return max(speed_mps - driver.dawdles_mps, 0.75 * speed_mps, CRAWL_MPS)


@compiled
def drive_line(
    trace: Trace, lines: Lines, driver: Driver, place: Place, stretch: Stretch, moment: Moment
) -> tuple[Place, Moment]:
    """Drive a stretch: speed up, go evenly, brake; return where, when and how fast it ends."""
    rest_m, a, b = stretch.to_m - place.at_m, driver.accel, driver.decel
    time_s, speed_mps = moment
    if rest_m <= 0.0:
        return place, Moment(time_s, min(speed_mps, stretch.exit_mps))
    now2, exit2 = speed_mps * speed_mps, stretch.exit_mps * stretch.exit_mps
    peak2 = (2.0 * a * b * rest_m + b * now2 + a * exit2) / (a + b)
    peak_mps = max(min(stretch.even_mps, np.sqrt(peak2)), speed_mps)
    # It may have to brake all the way, and harder than it likes.
    brakes_m = min(max(peak_mps * peak_mps - exit2, 0.0) / (2.0 * b), rest_m)
    gains_m = min((peak_mps * peak_mps - now2) / (2.0 * a), rest_m - brakes_m)
    if gains_m > 0.0:
        place, time_s = drive(trace, lines, place, place.at_m + gains_m, moment, a)
        speed_mps = np.sqrt(now2 + 2.0 * a * gains_m)
    if rest_m - gains_m - brakes_m > 0.0:
        to_m = stretch.to_m - brakes_m
        place, time_s = drive(trace, lines, place, to_m, Moment(time_s, speed_mps), 0.0)
    if brakes_m > 0.0:
        accel = (exit2 - speed_mps * speed_mps) / (2.0 * brakes_m)
        begins = Moment(time_s, speed_mps)
        place, time_s = drive(trace, lines, place, stretch.to_m, begins, accel)
        speed_mps = stretch.exit_mps
    return place, Moment(time_s, speed_mps)


@compiled
def stop_before(driver: Driver, place: Place, stretch: Stretch, moment: Moment) -> Stop:
    """Return where a car has to brake to stop at a stretch's end; before it, where that is late."""
    a, b, rest_m = driver.accel, driver.decel, stretch.to_m - place.at_m
    time_s, speed_mps = moment
    now2 = speed_mps * speed_mps
    if now2 >= 2.0 * b * rest_m:
        late_m = now2 / (2.0 * b) - rest_m
        return Stop(place.at_m, time_s - late_m / max(speed_mps, CRAWL_MPS), speed_mps)
    peak2 = (2.0 * a * rest_m + now2) * b / (a + b)
    peak_mps = max(min(stretch.even_mps, np.sqrt(peak2)), speed_mps)
    gains_m = (peak_mps * peak_mps - now2) / (2.0 * a)
    brakes_m = peak_mps * peak_mps / (2.0 * b)
    evenly_s = max(rest_m - gains_m - brakes_m, 0.0) / max(peak_mps, CRAWL_MPS)
    gains_s = (peak_mps - speed_mps) / a
    return Stop(stretch.to_m - brakes_m, time_s + gains_s + evenly_s, peak_mps)
