"""Columns of whole numbers, in which a page holds places and times."""

import base64
from dataclasses import dataclass

import numpy as np

from planner.arrays import Flags, Floats, Ints

MOST = 65_534  # of what 16 bits hold; the one above stands for never
NEVER = 65_535


@dataclass(frozen=True)
class Frame:
    """A square of the plane and a span of time, each cut into `MOST` steps."""

    west_m: float
    south_m: float
    step_m: float
    step_s: float

    @classmethod
    def around(cls, places_m: Floats, until_s: float) -> "Frame":
        """Return the frame of all places, (n, 2) metres, and of times from 0 until one."""
        west_m, south_m = places_m.min(axis=0).tolist()
        size_m = max(float(np.ptp(places_m, axis=0).max()), 1.0)
        return cls(west_m, south_m, size_m / MOST, until_s / MOST)

    def places(self, xy_m: Floats) -> Ints:
        """Return places, (n, 2) metres, as steps eastward and northward, (n, 2)."""
        steps = np.round((xy_m - (self.west_m, self.south_m)) / self.step_m)
        return np.clip(steps, 0, MOST).astype(np.uint16)

    def times(self, time_s: Floats) -> Ints:
        """Return times, (n,) seconds, as steps; infinity, and what lies beyond, is `NEVER`."""
        steps = np.ceil(np.maximum(time_s, 0.0) / self.step_s - 1e-6)
        return np.where(steps <= MOST, steps, NEVER).astype(np.uint16)

    def as_dict(self) -> dict[str, float]:
        """Return it as the page's script takes it."""
        return {"x": self.west_m, "y": self.south_m, "m": self.step_m, "s": self.step_s}


def packed(column: Ints | Flags) -> str:
    """Return whole numbers up to `NEVER` as text: two bytes each, the low one first, base 64."""
    return base64.b64encode(np.ascontiguousarray(column, dtype="<u2").tobytes()).decode("ascii")
