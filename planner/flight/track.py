"""A UAV's flight as detection sees it: where it is when, and when its sensor is on."""

from dataclasses import dataclass

import numpy as np

from planner.arrays import Flags, Floats, Frozen, freeze
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

    def until(self, time_s: float) -> "Track":
        """Return the flight up to a time; where it begins, if that is later, is all of it."""
        here = (time_s, *self._at(time_s)) if time_s < self.end_s else ()
        return self._cut(self.time_s <= time_s, here, (-np.inf, time_s), last=True)

    def after(self, time_s: float) -> "Track":
        """Return the flight from a time on; where it ends, if that is earlier, is all of it."""
        here = (time_s, *self._at(time_s))
        return self._cut(self.time_s > time_s, here, (time_s, np.inf), last=False)

    def later(self, by_s: float) -> "Track":
        """Return the same flight so many seconds later."""
        return Track(self.time_s + by_s, self.x_m, self.y_m, self.sensor_on + by_s)

    def then(self, other: "Track") -> "Track":
        """Return this flight and another one after it, straight in between."""
        columns = zip(_columns(self), _columns(other), strict=True)
        time_s, x_m, y_m = (np.concatenate(both) for both in columns)
        return Track(time_s, x_m, y_m, _merged(np.vstack([self.sensor_on, other.sensor_on])))

    def _at(self, time_s: float) -> tuple[float, float]:
        x_m, y_m = (float(np.interp(time_s, self.time_s, one)) for one in (self.x_m, self.y_m))
        return x_m, y_m

    def _cut(
        self, kept: Flags, here: tuple[float, ...], window: tuple[float, float], *, last: bool
    ) -> "Track":
        """Return some of the waypoints and one more, with the sensor on within a window."""
        rows = np.stack(_columns(self), axis=1)[kept]
        more = np.array([here]).reshape(-1, 3)
        time_s, x_m, y_m = np.vstack([rows, more] if last else [more, rows]).T
        on_s = np.clip(self.sensor_on, *window)
        inside = (self.sensor_on[:, 0] <= window[1]) & (self.sensor_on[:, 1] >= window[0])
        return Track(time_s, x_m, y_m, on_s[inside])


def _columns(track: Track) -> tuple[Floats, Floats, Floats]:
    return track.time_s, track.x_m, track.y_m


def _merged(windows: Floats) -> Floats:
    """Return windows in order, those that touch as one."""
    begins = np.append(True, windows[1:, 0] > windows[:-1, 1])[: len(windows)]
    ends = np.append(begins[1:], True)[: len(windows)]
    return np.stack([windows[begins, 0], windows[ends, 1]], axis=1)


def _rises(windows: Floats) -> bool:
    flat = windows.ravel()
    return bool(not np.isnan(flat).any() and np.all(flat[1:] >= flat[:-1]))
