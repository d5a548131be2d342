"""Means over seeds, paired differences and their 95 % intervals, from rows of experiments."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from planner.experiments.results import Row
from planner.intervals import student_interval

EXPECTED, FOUND = "expected_detection_time_s", "detection_probability"
BEFORE_GOAL = "found_before_goal_probability"


@dataclass(frozen=True)
class Estimate:
    """A mean over seeds with its 95 % interval, which has no width where chance plays no part."""

    mean: float
    low: float
    high: float
    seeds: int

    @classmethod
    def of(cls, values: Sequence[float]) -> "Estimate":
        """Return what independent values come to; a single one is taken as exact."""
        if len(values) == 1:
            return cls(values[0], values[0], values[0], 1)
        mean = sum(values) / len(values)
        return cls(mean, *student_interval(values), len(values))

    @property
    def seconds(self) -> str:
        """As text: the mean, and the interval if there is one."""
        return self._text(lambda value: f"{value:,.0f}", "s")

    @property
    def change(self) -> str:
        """As text with its sign."""
        return self._text(lambda value: f"{value:+,.0f}", "s")

    @property
    def percent(self) -> str:
        """A probability as text."""
        return self._text(lambda value: f"{100 * value:.1f}", "%")

    def _text(self, shown: Callable[[float], str], unit: str) -> str:
        low, high = shown(self.low), shown(self.high)
        return f"{shown(self.mean)} {unit}" + (f" ({low} to {high})" if low != high else "")

    def within(self, least: float, most: float) -> "Estimate":
        """Return it with an interval that goes no further than values can."""
        return replace(self, low=max(least, self.low), high=min(most, self.high))


def chosen(rows: Iterable[Row], where: Mapping[str, Any]) -> list[Row]:
    """Return the rows that have these values and did not fail."""
    # Sets of targets and factors have the most levels: what leaves the fewest rows comes first.
    left = rows
    for key in sorted(where, key=lambda key: key != "targets" and "." not in key):
        left = [row for row in left if row.get(key) == where[key]]
    return [row for row in left if row.get("reason") is None]


def levels(rows: Iterable[Row], key: str) -> list[Any]:
    """Return the values that occur in a column, in the order in which they do."""
    return list(dict.fromkeys(row.get(key) for row in rows))


def estimate(
    rows: Iterable[Row], where: Mapping[str, Any], figure: str = EXPECTED
) -> Estimate | None:
    """Return the mean of a figure over the seeds of rows that have these values, None without."""
    values = _by_seed(chosen(rows, where), figure)
    if not values:
        return None
    found = Estimate.of(list(values.values()))
    if figure.endswith("probability"):
        return found.within(0.0, 1.0)
    return found.within(0.0, math.inf) if figure == EXPECTED else found


def difference(
    first: Sequence[Row], second: Sequence[Row], figure: str = EXPECTED
) -> Estimate | None:
    """Return the mean of first minus second, paired by seed, None if they share none.

    One seed stands for all: it is that of a method in which chance plays no part.
    """
    one, other = _by_seed(first, figure), _by_seed(second, figure)
    if not one or not other:
        return None
    seeds = list(one if len(other) == 1 else other if len(one) == 1 else {*one} & {*other})
    apart = [_value(one, seed) - _value(other, seed) for seed in sorted(seeds)]
    return Estimate.of(apart) if apart else None


def _by_seed(rows: Iterable[Row], figure: str) -> dict[int, float]:
    return {row["seed"]: row[figure] for row in rows if row.get(figure) is not None}


def _value(values: Mapping[int, float], seed: int) -> float:
    return values[seed] if seed in values else next(iter(values.values()))
