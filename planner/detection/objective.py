"""What a search is for: the one place that says what a sighting at a time is worth."""

from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats
from planner.checked import number, set_fields, whole
from planner.messages import percent


@dataclass(frozen=True)
class Objective:
    """Either the least expected detection time, or the greatest probability of one by a time.

    Both reward a sighting, the sooner the better: with ``horizon - t``, so that the greatest
    expected reward is the least E[min(tau, horizon)]; or, if ``by_s`` is given, with 1 up to then.
    Of several targets it is the sum of their times, or how many are expected to be found by then.
    """

    horizon_s: float  # a target not seen by then counts as this much
    by_s: float | None = None  # None: least expected time; else the deadline, seconds
    sought: int = 1  # how many targets are searched for

    def __post_init__(self) -> None:
        set_fields(self, {"horizon_s": number("horizon_s", self.horizon_s, above=0.0)})
        if self.by_s is not None:
            set_fields(self, {"by_s": number("by_s", self.by_s, above=0.0)})
        set_fields(self, {"sought": whole("sought", self.sought, least=1)})

    def reward(self, seen_at: Floats) -> Floats:
        """Return what sightings are worth, never negative; a miss (inf) is worth nothing."""
        if self.by_s is not None:
            return np.asarray(seen_at <= self.by_s, dtype=np.float64)
        return np.maximum(0.0, self.horizon_s - seen_at)

    @property
    def most(self) -> float:
        """What a sighting at time 0 is worth: no reward is greater."""
        return self.horizon_s if self.by_s is None else 1.0

    @property
    def ends_s(self) -> float:
        """From when on no sighting is worth anything, seconds."""
        return self.horizon_s if self.by_s is None else min(self.by_s, self.horizon_s)

    def value(self, reward: float) -> float:
        """Return the objective's own figure for an expected reward: seconds, or a probability."""
        return reward if self.by_s is not None else self.sought * self.horizon_s - reward

    def as_text(self, value: float) -> str:
        """Return a figure of the objective for people."""
        if self.by_s is None:
            return f"{value:,.0f} s"
        several = f" of {self.sought}" * (self.sought > 1)
        return f"{self.number_found(value)}{several} found"

    def number_found(self, found: float) -> str:
        """Return for people how probably the target is found, or how many of several are."""
        return percent(found) if self.sought == 1 else f"{found:.2f}"

    def is_better(self, one: float, other: float) -> bool:
        """Tell whether one figure of the objective is better than another."""
        return one < other if self.by_s is None else one > other
