"""Intervals that say how far chance may have moved a figure."""

import math
from collections.abc import Sequence

import numpy as np

from planner.arrays import Floats, Ints

NORMAL_95 = 1.959963984540054  # the 97.5 % point of the standard normal distribution


def share_interval(share: float, draws: float) -> tuple[float, float]:
    """Return the 95 % interval of a probability, from the share seen in independent draws.

    Wilson's interval, which stays within 0 and 1 and has a width also when all or none were
    found (E. B. Wilson, Journal of the American Statistical Association 22, 1927).

    Parameters
    ----------
    share
        What was seen, from 0 to 1.
    draws
        How many were drawn; for weighted draws the effective number. Without any, all is
        possible.
    """
    if draws <= 0:
        return 0.0, 1.0
    z2 = NORMAL_95**2 / draws
    middle = (share + z2 / 2) / (1 + z2)
    half = math.sqrt(share * (1 - share) * z2 + z2 * z2 / 4) / (1 + z2)
    return max(0.0, middle - half), min(1.0, middle + half)


def interval_of_sum(
    value: float, parts: Sequence[tuple[float, tuple[float, float]]], slopes: Sequence[float] = ()
) -> tuple[float, float]:
    """Return the 95 % interval of what independent figures make together, from their own ones.

    What leads from each figure to its limits adds up in squares, on either side (G. Y. Zou and A.
    Donner, Statistics in Medicine 27, 2008): exact for a sum of normal figures.

    Parameters
    ----------
    value
        What they make.
    parts
        Each figure with its interval.
    slopes
        By how much the value grows with each of them, 0 or more; left out: it is their sum.
    """
    rates = slopes or (1.0,) * len(parts)
    steps = zip(rates, parts, strict=True)
    below, above = zip(
        *((rate * (own - low), rate * (high - own)) for rate, (own, (low, high)) in steps),
        strict=True,
    )
    return value - math.hypot(*below), value + math.hypot(*above)


def standard_error(values: Floats, share: Floats) -> float:
    """Return the standard error of the weighted mean of independent values.

    sqrt(n / (n - 1) sum_k v_k^2 (x_k - m)^2) with m = sum_k v_k x_k and n = 1 / sum_k v_k^2, which
    is the number of values when all weigh the same. Infinity for fewer than two: they tell nothing.

    Parameters
    ----------
    share
        Weight of each value, v, with a sum of 1.
    """
    draws = 1.0 / float(share @ share)
    if draws < 2.0 - 1e-9:
        return math.inf
    deviation = values - share @ values
    variance = draws / (draws - 1.0) * float(share**2 @ deviation**2)
    return float(np.sqrt(variance))


def half_width(values: Floats, weight: Floats) -> float:
    """Return half the width of the 95 % interval of a sum of independent values, each by weight.

    Parameters
    ----------
    weight
        Of each value. What they miss of 1 is known, not drawn, and adds no width; where nothing is
        drawn, the width is infinite as it is for a single value.
    """
    present = float(weight.sum())
    if present <= 0.0:
        return math.inf
    return NORMAL_95 * present * standard_error(values, weight / present)


def means_of_runs(values: Floats, run: Ints) -> Floats:
    """Return the mean of the values of each run, (runs,), by rising number.

    Parameters
    ----------
    run
        Of each value, (n,).
    """
    _, code, count = np.unique(run, return_inverse=True, return_counts=True)
    return np.asarray(np.bincount(code, weights=values) / count)


def half_width_of_runs(values: Floats, weight: Floats, run: Ints) -> float:
    """Return half the width of the 95 % interval of a sum of values, alike within a run.

    As `half_width`, but only the runs are independent: Student's t on sums of deviations by run,
    sqrt(R / (R - 1) sum_r (sum_k in r v_k (x_k - m))^2). Infinity for a single run.

    Parameters
    ----------
    run
        Of each value; values of one run may have anything in common.
    """
    present = float(weight.sum())
    if present <= 0.0:
        return math.inf
    share = weight / present
    _, code = np.unique(run[share > 0.0], return_inverse=True)
    runs = int(code.max()) + 1
    if runs < 2:
        return math.inf
    deviation = (share * (values - share @ values))[share > 0.0]
    variance = float((np.bincount(code, weights=deviation) ** 2).sum()) * runs / (runs - 1)
    return student_point(runs - 1, 0.05) * present * math.sqrt(variance)


def student_interval(values: Sequence[float]) -> tuple[float, float]:
    """Return the 95 % interval of the mean of independent values (Student's t)."""
    count, mean = len(values), math.fsum(values) / len(values)
    variance = sum((value - mean) ** 2 for value in values) / (count - 1)
    half = student_point(count - 1, 0.05) * math.sqrt(variance / count)
    return mean - half, mean + half


def ratio_of_means(values: Floats, others: Floats) -> tuple[float, float]:
    """Return the ratio of the means of pairs, and half the width of its 95 % interval.

    By the delta method, with Student's t; infinite for a single pair.

    Parameters
    ----------
    values, others
        (n,) each, of which the second is not 0 on average.
    """
    count, ratio = len(values), float(values.mean() / others.mean())
    if count < 2:
        return ratio, math.inf
    residual = (values - ratio * others) / others.mean()
    deviation = float(np.sqrt((residual**2).sum() / (count - 1) / count))
    return ratio, student_point(count - 1, 0.05) * deviation


def student_point(freedom: float, chance: float) -> float:
    """Return how many standard errors a mean is off at most, but for a chance on both sides."""
    from scipy.special import stdtrit

    return float(stdtrit(freedom, 1.0 - chance / 2))


def lower_limit(bounds: Floats) -> float:
    """Return the 95 % lower confidence limit of the true optimum from bounds of independent sets.

    The expected bound of a random set is never above the optimum for the whole distribution (Mak,
    Morton and Wood 1999); Student's t takes the bounds' scatter into account. For a probability
    it is the upper limit that is wanted: hand over the negative bounds.
    """
    from scipy.stats import t

    many = len(bounds)
    spread = float(np.std(bounds, ddof=1)) / math.sqrt(many)
    return float(np.mean(bounds)) - float(t.ppf(0.95, many - 1)) * spread
