"""What a search achieves: the one place where its figures are derived.

They come from seen times, or, where a sensor may miss, from how probably each target is unseen.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from planner.arrays import Flags, Floats, Frozen, Ints, freeze
from planner.checked import same_length, weights
from planner.detection.objective import Objective
from planner.detection.survival import Survival
from planner.errors import InputError
from planner.intervals import half_width, half_width_of_runs, interval_of_sum, share_interval

MOMENTS = 1000  # of a curve that has no steps


@dataclass(frozen=True, eq=False)
class Evaluation(Frozen):
    """When each target is first seen, or how probably by when, and all that follows from it.

    Weights sum to the probability that a target is there at all; with the rest of the
    probability there is none, which is never found and costs the horizon. If several are sought,
    this is so of each; times are then sums over them, and probabilities expected numbers.
    """

    # (N,) seconds on the target's clock, inf: never; where it may be missed the median: from
    # then on it is more likely found than not
    seen_at: Floats
    weight: Floats  # (N,) probability
    end_s: Floats  # (N,) seconds, when the target reaches its goal; -inf: never sets out
    objective: Objective
    survival: Survival | None = None  # where a sensor may miss; None: whoever is seen is found
    run: Ints | None = None  # (N,) of the traffic, in which targets met; None: none met another
    target: Ints | None = None  # (N,) which of those sought each row may be; None: one is sought

    def __post_init__(self) -> None:
        freeze(self, seen_at=np.float64, weight=np.float64, end_s=np.float64)
        same_length(seen_at=self.seen_at, weight=self.weight, end_s=self.end_s)
        weights("weight", self.weight)
        if np.isnan(self.seen_at).any():
            raise InputError("seen_at: holds NaN; infinity stands for never")
        if self.survival is not None:
            same_length(weight=self.weight, survival=self.survival.first[1:])
        if self.run is not None:
            same_length(weight=self.weight, run=self.run)
        if self.target is not None:
            same_length(weight=self.weight, target=self.target)

    @classmethod
    def of_survival(
        cls, survival: Survival, weight: Floats, end_s: Floats, objective: Objective
    ) -> "Evaluation":
        """Return what a search achieves under which each target survives unseen like this."""
        return cls(survival.falls_to(0.5), weight, end_s, objective, survival)

    def of_those(self, which: Flags, scale: float = 1.0) -> "Evaluation":
        """Return what it achieves with some of the targets, (N,), their weights scaled."""
        return Evaluation(
            self.seen_at[which],
            self.weight[which] * scale,
            self.end_s[which],
            self.objective,
            self.survival and self.survival.of_those(which),
            None if self.run is None else self.run[which],
            None if self.target is None else self.target[which],
        )

    @property
    def rows_of_each(self) -> list[Flags]:
        """Which rows are of each target, (N,) flags for each of whom any row has weight."""
        if self.target is None:
            return [np.ones(len(self.weight), dtype=bool)]
        return [self.target == number for number in self.each]

    @cached_property
    def each(self) -> Mapping[int, "Evaluation"]:
        """What it achieves with each target alone, by number; none of whom no row has weight."""
        if self.target is None:
            return {0: self}
        alone = replace(self.objective, sought=1)
        there = np.unique(self.target[self.weight > 0.0]).tolist()
        rows = {number: self.of_those(self.target == number) for number in there}
        return {n: replace(one, target=None, objective=alone) for n, one in rows.items()}

    @cached_property
    def time_s(self) -> Floats:
        """What each target counts as: E[min(time seen, horizon)], (N,) seconds.

        The horizon takes infinity's place.
        """
        if self.survival is not None:
            return self.survival.lasts_s(self.objective.horizon_s)
        return np.minimum(self.seen_at, self.objective.horizon_s)

    @cached_property
    def found(self) -> Flags:
        """Which targets are found by the horizon, or more likely so than not, (N,)."""
        return np.asarray(self.seen_at <= self.objective.horizon_s)

    def found_by(self, time_s: Floats | float) -> Floats | Flags:
        """Return how probably each target is found by a time, its own or one for all, (N,)."""
        if self.survival is not None:
            return 1.0 - self.survival.at(np.minimum(time_s, self.objective.horizon_s))
        return np.asarray(self.found & (self.seen_at <= time_s))

    @cached_property
    def reward(self) -> Floats:
        """What the search is worth with each target, by the objective, (N,)."""
        if self.survival is None:
            return self.objective.reward(self.seen_at)
        if self.objective.by_s is None:
            return self.objective.horizon_s - self.time_s
        return np.asarray(self.found_by(self.objective.by_s), dtype=np.float64)

    @property
    def absent_probability(self) -> float:
        """Probability that there is no target to be found, or how many of several are not."""
        return max(0.0, self.objective.sought - float(self.weight.sum()))

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
        return self._probability(self.found_by(self.objective.horizon_s))

    def found_by_probability(self, time_s: float) -> float:
        """Return the probability that the target is there and found by a time, seconds."""
        return self._probability(self.found_by(time_s))

    @property
    def found_before_goal_probability(self) -> float:
        """Probability that it is found strictly before it reaches its goal (Section 5)."""
        return self._probability(self.before_goal)

    @property
    def before_goal(self) -> Floats | Flags:
        """How probably each target is found strictly before it reaches its goal, (N,)."""
        if self.survival is not None:  # no single moment counts
            return self.found_by(self.end_s)
        return np.asarray(self.found & (self.seen_at < self.end_s))

    def _probability(self, which: Floats | Flags) -> float:
        most = float(self.objective.sought)
        return min(most, float(self.weight @ which))  # a thousand thousandths may sum to more

    @property
    def ci95_s(self) -> tuple[float, float]:
        """95 % interval of the expected detection time, from and to, seconds.

        For targets drawn independently: E -+ 1.96 p sqrt(n / (n - 1) sum_k v_k^2 (x_k - m)^2)
        with p = sum(weight), v = weight / p, x = min(tau, horizon), m = sum_k v_k x_k and
        n = 1 / sum_k v_k^2, which is the number of targets when all weigh the same. The
        probability 1 - p that there is no target is known, not drawn, and adds no width. Fewer
        than two draws tell nothing: the interval is then from 0 to the horizon. Of targets in
        traffic only those of different runs are independent. Several targets are drawn each for
        itself: of their sum, the squares of what leads to the limits add up.
        """
        if len(self.each) > 1:
            parts = [(one.expected_detection_time_s, one.ci95_s) for one in self.each.values()]
            return interval_of_sum(self.expected_detection_time_s, parts)
        if self.weight.sum() <= 0.0:
            return (self.objective.sought * self.objective.horizon_s,) * 2
        half_s = self.half_width(self.time_s)
        if np.isinf(half_s):
            return 0.0, self.objective.sought * self.objective.horizon_s
        middle_s = self.expected_detection_time_s
        return middle_s - half_s, middle_s + half_s

    @property
    def found_interval(self) -> tuple[float, float]:
        """95 % interval of the probability that the target is found.

        The probability that there is a target is known, not drawn; only what happens to those
        that are there is uncertain.
        """
        return self._interval(lambda one: one.detection_probability)

    @property
    def found_before_goal_interval(self) -> tuple[float, float]:
        """95 % interval of the probability that it is found before it reaches its goal."""
        return self._interval(lambda one: one.found_before_goal_probability)

    def found_by_interval(self, time_s: float) -> tuple[float, float]:
        """Return the 95 % interval of the probability that it is found by a time, seconds."""
        return self._interval(lambda one: one.found_by_probability(time_s))

    def _interval(self, figure: Callable[["Evaluation"], float]) -> tuple[float, float]:
        """Return the 95 % interval of a probability, or of a sum of those of several targets."""
        if len(self.each) > 1:
            parts = [(figure(one), one._interval(figure)) for one in self.each.values()]
            return interval_of_sum(figure(self), parts)
        probability = figure(self)
        present = float(self.weight.sum())
        if present <= 0:
            return 0.0, 0.0
        draws = present**2 / float(self.weight @ self.weight)
        if self.run is not None:  # as many independent ones as would make the interval as wide
            draws *= self._worth_of_draw()
        low, high = share_interval(min(1.0, probability / present), draws)
        return low * present, high * present

    def half_width(self, values: Floats) -> float:
        """Return half the width of the 95 % interval of a sum of any values, (N,), by weight.

        Targets sought are drawn each for itself, so that squares of their widths add up. Of targets
        in traffic only those of different runs are independent.
        """
        return math.hypot(*(self._half_width_of(values, rows) for rows in self.rows_of_each))

    def _half_width_of(self, values: Floats, rows: Flags) -> float:
        if self.run is None:
            return half_width(values[rows], self.weight[rows])
        return half_width_of_runs(values[rows], self.weight[rows], self.run[rows])

    def _worth_of_draw(self) -> float:
        """Return what a target counts for that meets others of its run, at most 1.

        By the detection times, whose interval says how much targets of a run have in common; a
        share near 0 or 1 says nothing of that by itself.
        """
        together = self.half_width(self.time_s)
        alone = math.hypot(
            *(half_width(self.time_s[rows], self.weight[rows]) for rows in self.rows_of_each)
        )
        if not np.isfinite(together):
            return 0.0
        return min(1.0, (alone / together) ** 2) if together > 0.0 else 1.0

    def curve(self) -> tuple[Floats, Floats]:
        """Return the detection curve: rising times (M,), seconds, and the probability by each.

        The probability of having found the target jumps at these times and is constant between
        them; before the first it is zero. Where it may be missed, it rises steadily, and these are
        so many times up to the horizon.
        """
        if self.survival is not None:
            times = np.linspace(0.0, self.objective.horizon_s, MOMENTS + 1)[1:]
            return times, self.survival.found_by(self.weight, times)
        times, which = np.unique(self.seen_at[self.found], return_inverse=True)
        steps = np.bincount(which, weights=self.weight[self.found], minlength=len(times))
        return times, np.cumsum(steps)
