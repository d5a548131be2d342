"""What a search achieves: the one place where its figures are derived from seen times."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.arrays import Flags, Floats, Frozen, freeze
from planner.checked import same_length, weights
from planner.detection.objective import Objective
from planner.errors import InputError
from planner.intervals import half_width, share_interval


@dataclass(frozen=True, eq=False)
class Evaluation(Frozen):
    """When each target is first seen, and all that follows from it.

    Weights sum to the probability that a target is there at all; with the rest of the
    probability there is none, which is never found and costs the horizon.
    """

    seen_at: Floats  # (N,) seconds on the target's clock, inf: never
    weight: Floats  # (N,) probability
    end_s: Floats  # (N,) seconds, when the target reaches its goal; -inf: never sets out
    objective: Objective

    def __post_init__(self) -> None:
        freeze(self, seen_at=np.float64, weight=np.float64, end_s=np.float64)
        same_length(seen_at=self.seen_at, weight=self.weight, end_s=self.end_s)
        weights("weight", self.weight)
        if np.isnan(self.seen_at).any():
            raise InputError("seen_at: holds NaN; infinity stands for never")

    @cached_property
    def time_s(self) -> Floats:
        """What each target counts as: min(seen time, horizon), (N,) seconds.

        The horizon takes infinity's place.
        """
        return np.minimum(self.seen_at, self.objective.horizon_s)

    @cached_property
    def found(self) -> Flags:
        """Which targets are found by the horizon, (N,)."""
        return np.asarray(self.seen_at <= self.objective.horizon_s)

    @property
    def absent_probability(self) -> float:
        """Probability that there is no target to be found."""
        return max(0.0, 1.0 - float(self.weight.sum()))

    @property
    def figure(self) -> float:
        """What the search was for: expected seconds, or the probability by the deadline."""
        by_s = self.objective.by_s
        return self.expected_detection_time_s if by_s is None else self.found_by_probability(by_s)

    def is_better(self, other: "Evaluation") -> bool:
        """Tell whether this is a better figure than another search's for the same."""
        return self.objective.is_better(self.figure, other.figure)

    @property
    def expected_detection_time_s(self) -> float:
        """E[min(tau, horizon)], seconds; the objective of line 28 of Figure 6."""
        return float(self.weight @ self.time_s) + self.absent_probability * self.objective.horizon_s

    @property
    def detection_probability(self) -> float:
        """Probability that the target is there and found by the horizon."""
        return self._probability(self.found)

    def found_by_probability(self, time_s: float) -> float:
        """Return the probability that the target is there and found by a time, seconds."""
        return self._probability(self.found & (self.seen_at <= time_s))

    @property
    def found_before_goal_probability(self) -> float:
        """Probability that it is found strictly before it reaches its goal (Section 5)."""
        return self._probability(self.found & (self.seen_at < self.end_s))

    def _probability(self, which: Flags) -> float:
        return min(1.0, float(self.weight @ which))  # a thousand thousandths may sum to more

    @property
    def ci95_s(self) -> tuple[float, float]:
        """95 % interval of the expected detection time, from and to, seconds.

        For targets drawn independently: E -+ 1.96 p sqrt(n / (n - 1) sum_k v_k^2 (x_k - m)^2)
        with p = sum(weight), v = weight / p, x = min(tau, horizon), m = sum_k v_k x_k and
        n = 1 / sum_k v_k^2, which is the number of targets when all weigh the same. The
        probability 1 - p that there is no target is known, not drawn, and adds no width. Fewer
        than two draws tell nothing: the interval is then from 0 to the horizon.
        """
        if self.weight.sum() <= 0.0:
            return self.objective.horizon_s, self.objective.horizon_s
        half_s = half_width(self.time_s, self.weight)
        if np.isinf(half_s):
            return 0.0, self.objective.horizon_s
        middle_s = self.expected_detection_time_s
        return middle_s - half_s, middle_s + half_s

    @property
    def found_interval(self) -> tuple[float, float]:
        """95 % interval of the probability that the target is found.

        The probability that there is a target is known, not drawn; only what happens to those
        that are there is uncertain.
        """
        return self._interval(self.detection_probability)

    @property
    def found_before_goal_interval(self) -> tuple[float, float]:
        """95 % interval of the probability that it is found before it reaches its goal."""
        return self._interval(self.found_before_goal_probability)

    def found_by_interval(self, time_s: float) -> tuple[float, float]:
        """Return the 95 % interval of the probability that it is found by a time, seconds."""
        return self._interval(self.found_by_probability(time_s))

    def _interval(self, probability: float) -> tuple[float, float]:
        present = float(self.weight.sum())
        if present <= 0:
            return 0.0, 0.0
        draws = present**2 / float(self.weight @ self.weight)
        low, high = share_interval(min(1.0, probability / present), draws)
        return low * present, high * present

    def curve(self) -> tuple[Floats, Floats]:
        """Return the detection curve: rising times (M,), seconds, and the probability by each.

        The probability of having found the target jumps at these times and is constant between
        them; before the first it is zero.
        """
        times, which = np.unique(self.seen_at[self.found], return_inverse=True)
        steps = np.bincount(which, weights=self.weight[self.found], minlength=len(times))
        return times, np.cumsum(steps)
