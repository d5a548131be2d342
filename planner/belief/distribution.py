"""Distributions of a distance or a speed, drawn by inverting the distribution function."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from planner.arrays import Floats, Frozen, Offsets, freeze

if TYPE_CHECKING:
    from planner.scenario.values import DistributionSection


class Distribution(Protocol):
    """What a scenario says about one number."""

    @property
    def low(self) -> float:
        """The lowest value that occurs."""

    @property
    def high(self) -> float:
        """The highest value that occurs."""

    def quantile(self, u: Floats) -> Floats:
        """Return the values below which the shares ``u`` of the distribution lie.

        Parameters
        ----------
        u
            Numbers from 0 up to but not including 1, of any shape. Uniform ones give draws.
        """


@dataclass(frozen=True)
class Uniform:
    """Every value from ``low`` to ``high`` alike."""

    low: float
    high: float

    def quantile(self, u: Floats) -> Floats:
        """Return the values below which the shares ``u`` lie."""
        return self.low + u * (self.high - self.low)


@dataclass(frozen=True)
class Normal:
    """The normal distribution, cut off below ``low`` and above ``high``."""

    mean: float
    sd: float
    low: float
    high: float

    def quantile(self, u: Floats) -> Floats:
        """Return the values below which the shares ``u`` lie."""
        from scipy.special import ndtr, ndtri

        low, high = (self.low - self.mean) / self.sd, (self.high - self.mean) / self.sd
        # Far above the mean the distribution function is one to all digits; below it, it keeps
        # them. So the upper tail is drawn as the lower one, mirrored.
        if low > 0:
            z = -ndtri(ndtr(-low) + u * (ndtr(-high) - ndtr(-low)))
        else:
            z = ndtri(ndtr(low) + u * (ndtr(high) - ndtr(low)))
        return np.asarray(np.clip(self.mean + self.sd * z, self.low, self.high))


@dataclass(frozen=True, eq=False)
class Listed(Frozen):
    """Single values, each with its probability."""

    values: Floats  # (k,)
    probabilities: Floats  # (k,) summing to one

    def __post_init__(self) -> None:
        freeze(self, values=np.float64, probabilities=np.float64)

    @property
    def low(self) -> float:
        """The lowest value that occurs."""
        return float(self.values[self.probabilities > 0].min())

    @property
    def high(self) -> float:
        """The highest value that occurs."""
        return float(self.values[self.probabilities > 0].max())

    def quantile(self, u: Floats) -> Floats:
        """Return the values that the shares ``u`` fall on, in the list's order."""
        return np.asarray(self.values[chosen(self.probabilities, u)])


def chosen(probabilities: Floats, u: Floats) -> Offsets:
    """Return the index that each ``u`` in [0, 1) falls on; one without probability never."""
    cumulative = np.cumsum(probabilities)
    last = np.flatnonzero(probabilities)[-1]
    return np.asarray(
        np.minimum(np.searchsorted(cumulative, u * cumulative[-1], side="right"), last)
    )


def distribution(section: "DistributionSection") -> Distribution:
    """Return what a scenario's table describes."""
    if section.uniform is not None:
        return Uniform(*section.uniform)
    if section.normal is not None:
        normal = section.normal
        return Normal(normal.mean, normal.sd, normal.low, normal.high)
    values = np.array(section.list or (section.constant,), dtype=np.float64)
    equal = np.ones(len(values)) if section.probabilities is None else section.probabilities
    weights = np.array(equal, dtype=np.float64)
    return Listed(values, weights / weights.sum())
