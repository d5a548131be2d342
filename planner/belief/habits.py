"""What targets do beside driving to somewhere: they park, and some flee at first."""

from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats


@dataclass(frozen=True)
class Stops:
    """That targets park: some from the start, others after a time that has no memory."""

    parked: float  # the share that is parked from the start
    share: float  # of the others, how many park sooner or later
    mean_s: float  # how long these drive in the mean, seconds

    def after_s(self, which: Floats, when: Floats) -> Floats:
        """Return after how many seconds targets park, (N,), whole ones; infinity: never.

        Parameters
        ----------
        which, when
            (N,) numbers from 0 up to but not including 1: the shares of the targets, and of the
            times of those that park.
        """
        drives_s = np.ceil(-self.mean_s * np.log1p(-when))
        sooner_or_later = which < self.parked + (1.0 - self.parked) * self.share
        parks_s = np.where(sooner_or_later, drives_s, np.inf)
        return np.asarray(np.where(which < self.parked, 0.0, parks_s))


@dataclass(frozen=True)
class Flees:
    """That targets drive faster at first."""

    for_s: float  # since setting out, seconds
    factor: float  # times the limits and their own speed
