"""A UAV's flight as detection sees it: where it is when, and when its sensor is on."""

from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Frozen, freeze
from planner.checked import finite, same_length
from planner.errors import InputError

SHARP_DEG = 30.0  # a turn by more is a corner
ROUNDING_DEG = 1e-6


@dataclass(frozen=True, eq=False)
class Track(Frozen):
    """A UAV's flight: straight and at constant speed from waypoint to waypoint.

    The sensor is off outside ``sensor_on`` and after the last waypoint.
    """

    time_s: Floats  # (W,) seconds on the target's clock, never falling
    x_m: Floats  # (W,) metres
    y_m: Floats  # (W,) metres
    sensor_on: Floats  # (S, 2) seconds, from and to, rising and disjoint

    def __post_init__(self) -> None:
        freeze(self, time_s=np.float64, x_m=np.float64, y_m=np.float64, sensor_on=np.float64)
        same_length(time_s=self.time_s, x_m=self.x_m, y_m=self.y_m)
        finite(time_s=self.time_s, x_m=self.x_m, y_m=self.y_m)
        if np.any(np.diff(self.time_s) < 0):
            raise InputError("time_s: should never fall")
        if self.sensor_on.shape[1:] != (2,) or not _rises(self.sensor_on):
            raise InputError("sensor_on: should be pairs of from and to, rising and disjoint")

    @property
    def end_s(self) -> float:
        """Time of the last waypoint, seconds."""
        return float(self.time_s[-1])

    @property
    def corners(self) -> int:
        """How often it turns by more than `SHARP_DEG`."""
        steps = np.diff(np.stack([self.x_m, self.y_m], axis=1), axis=0)
        steps = steps[np.any(steps != 0.0, axis=1)]
        heading = np.arctan2(steps[:, 1], steps[:, 0])
        turn_deg = np.degrees(np.abs(np.angle(np.exp(1j * np.diff(heading)))))
        return int(np.sum(turn_deg > SHARP_DEG + ROUNDING_DEG))

    def xy(self, time_s: Floats | float) -> Floats:
        """Return where the UAV is at given times, (..., 2) metres, NaN outside the flight."""
        return np.stack(
            [
                np.interp(time_s, self.time_s, column, left=np.nan, right=np.nan)
                for column in (self.x_m, self.y_m)
            ],
            axis=-1,
        )


def _rises(windows: Floats) -> bool:
    flat = windows.ravel()
    return bool(not np.isnan(flat).any() and np.all(flat[1:] >= flat[:-1]))
