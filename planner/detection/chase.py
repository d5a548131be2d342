"""How soon each target could be seen by a UAV that knew where it is going: nobody does better."""

from collections.abc import Sequence

import numpy as np

from planner.arrays import Floats
from planner.detection.first_detection import columns
from planner.detection.kernels.closest_approach import Chaser, caught_at
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.futures.futures import Futures


def chased_alone(futures: Futures, uav: Uav, sensor: Sensor) -> Floats:
    """Return when the UAV could first see each particle if it chased that one alone, (N,) seconds.

    The circle around the place of take-off with the detection radius grows with the UAV's speed;
    a particle can be seen as soon as it is inside. Never is infinity. A real aircraft may have the
    wind behind it, and be off its line.
    """
    sees_m = sensor.radius_m + uav.strays_m
    uav = uav.fastest
    chaser = Chaser(
        float(uav.x_m),
        float(uav.y_m),
        float(uav.take_off_s),
        float(uav.speed_mps),
        float(sees_m),
    )
    return np.asarray(caught_at(chaser, columns(futures)))


def chased_by_any(futures: Futures, uavs: Sequence[Uav], sensor: Sensor) -> Floats:
    """Return when the first of several UAVs could see each particle if all chased it, (N,) seconds.

    Never, as where there is no UAV, is infinity.
    """
    never = np.full(len(futures), np.inf)
    alone = (chased_alone(futures, uav, sensor) for uav in uavs)
    return np.asarray(np.min([never, *alone], axis=0))
