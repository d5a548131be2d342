"""A sensor that may miss: each look at a target within the radius sees it with a probability.

A target is looked at as it comes within the radius, and again every minute as long as it stays
there, or as it comes back; looks fail independently of each other. With a probability of one this
is the perfect sensor. Nothing is drawn: the expectation over all hits and misses is exact.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Frozen, freeze
from planner.detection.first_detection import first_detection
from planner.detection.sensor import Sensor
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.futures.truncate import after

AGAIN_S = 60.0  # from one look to the next that is independent of it
FORGET = 1e-9  # probability of having missed so often that further looks change nothing


@dataclass(frozen=True, eq=False)
class Looks(Frozen):
    """When each of N targets is looked at, and how probably a look is the one that sees it."""

    at_s: Floats  # (looks, N) seconds, inf: never
    share: Floats  # (looks,) probability of being the first look that sees the target

    def __post_init__(self) -> None:
        freeze(self, at_s=np.float64, share=np.float64)

    def time_s(self, horizon_s: float) -> Floats:
        """Return E[min(time seen, horizon)] of each target, (N,) seconds."""
        capped = np.minimum(self.at_s, horizon_s)
        return np.asarray(self.share @ capped + (1.0 - self.share.sum()) * horizon_s)

    def found_by(self, by_s: Floats, *, strict: bool = False) -> Floats:
        """Return the probability that each target is seen by its own time, (N,).

        Parameters
        ----------
        strict
            True: before that time, not at it.
        """
        by = self.at_s < by_s if strict else self.at_s <= by_s
        return np.asarray(self.share @ by)


def looked(
    futures: Futures, tracks: Sequence[Track], sensor: Sensor, detects: float = 1.0
) -> Looks:
    """Return the looks that flights have at targets.

    Parameters
    ----------
    detects
        Probability that a look sees the target, above 0 and at most 1.
    """
    at_s: list[Floats] = []
    share: list[float] = []
    missed = 1.0
    left, still = futures, np.arange(len(futures))  # those that a look has yet to find
    while True:
        seen = np.full(len(left), np.inf)
        for track in tracks:
            np.minimum(seen, first_detection(left, track, sensor.radius_m), out=seen)
        at_s.append(np.full(len(futures), np.inf))
        at_s[-1][still] = seen
        share.append(missed * detects)
        missed *= 1.0 - detects
        again = np.isfinite(seen)
        if missed <= FORGET or not again.any():
            break
        left, still = after(left.take(again), seen[again] + AGAIN_S), still[again]
    return Looks(np.array(at_s), np.array(share))
