"""What the UAV carries to see the target with."""

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from planner.arrays import Floats
from planner.checked import flag, number, set_fields
from planner.errors import InputError

NODES = 200  # of the quadrature over a swath


@dataclass(frozen=True)
class Sensor:
    """A sensor that may see every target within its radius while it is on: a definite range law.

    It detects at a constant rate, so that a contact of d seconds misses with probability
    exp(-rate d), whatever came before. A perfect sensor has an infinite rate.
    """

    radius_m: float
    detects_in_transit: bool = True  # False: only above the roads that the plan names
    rate_per_s: float = math.inf  # of detection while a target is within the radius

    def __post_init__(self) -> None:
        radius_m = number("radius_m", self.radius_m, above=0.0)
        in_transit = flag("detects_in_transit", self.detects_in_transit)
        rate_per_s = number("rate_per_s", self.rate_per_s, above=0.0, ends=False)
        names = {"radius_m": radius_m, "detects_in_transit": in_transit, "rate_per_s": rate_per_s}
        set_fields(self, names)

    @property
    def is_perfect(self) -> bool:
        """Whether it sees everybody who comes within its radius."""
        return math.isinf(self.rate_per_s)

    @property
    def without_misses(self) -> "Sensor":
        """The same sensor as if it were perfect."""
        return replace(self, rate_per_s=math.inf)

    def detects(self, speed_mps: float) -> float:
        """Return the probability that a pass straight over a resting target at a speed sees it."""
        return -math.expm1(-self.rate_per_s * 2.0 * self.radius_m / speed_mps)

    def sweep_width_m(self, speed_mps: float) -> float:
        """Return how wide a swath a perfect sensor would sweep to find as many at a speed."""
        return sweep_width_m(self.radius_m, self.rate_per_s, speed_mps)


def rate_of(detects: float, radius_m: float, speed_mps: float) -> float:
    """Return the rate, per second, at which a pass straight over a resting target sees it.

    Parameters
    ----------
    detects
        With which probability, above 0; 1 is an infinite rate.
    """
    detects = number("detects", detects, above=0.0)
    if detects > 1.0:
        raise InputError(f"detects: {detects:g} is no probability; write one of at most 1")
    if detects == 1.0:
        return math.inf
    return -math.log1p(-detects) * speed_mps / (2.0 * radius_m)


def sweep_width_m(radius_m: float, rate_per_s: float, speed_mps: float) -> float:
    """Return the integral, over the lateral range, of the probability that a straight pass sees.

    That is pi R (I1(z) - L1(z)) with z = 2 rate R / v; here by quadrature, which also holds where
    these Bessel and Struve functions are too great.
    """
    if math.isinf(rate_per_s):
        return 2.0 * radius_m
    cosine, share = _swath()
    exposure = 2.0 * rate_per_s * radius_m / speed_mps * cosine
    return float(2.0 * radius_m * (share @ (-np.expm1(-exposure) * cosine)))


@cache
def _swath() -> tuple[Floats, Floats]:
    """Return nodes over half a swath, as cosines of angles from its middle, and their shares."""
    at, share = np.polynomial.legendre.leggauss(NODES)
    return np.cos(0.25 * math.pi * (at + 1.0)), 0.25 * math.pi * share


def rate_of_sweep(width_m: float, radius_m: float, speed_mps: float) -> float:
    """Return the rate, per second, with which a sensor has a sweep width.

    Raises
    ------
    InputError
        If the width is not above 0, or above the diameter, which a perfect sensor sweeps.
    """
    width_m = number("sweep_width_m", width_m, above=0.0)
    if width_m > 2.0 * radius_m:
        raise InputError(
            f"sweep_width_m: {width_m:g} m is wider than the sensor sees, {2.0 * radius_m:g} m; "
            "write less, or a greater radius_m"
        )
    if width_m == 2.0 * radius_m:
        return math.inf
    low, high = 0.0, speed_mps / radius_m
    while sweep_width_m(radius_m, high, speed_mps) < width_m:
        high *= 2.0
    while low < (middle := 0.5 * (low + high)) < high:
        if sweep_width_m(radius_m, middle, speed_mps) < width_m:
            low = middle
        else:
            high = middle
    return middle
