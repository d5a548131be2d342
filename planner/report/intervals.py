"""Intervals of shares."""

import math

from planner.detection.evaluation import NORMAL_95, Evaluation


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


def found_intervals(evaluation: Evaluation) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the 95 % intervals of being found at all, and of being found before the goal.

    The probability that there is a target is known, not drawn; only what happens to those that
    are there is uncertain.
    """
    found = _interval(evaluation, evaluation.detection_probability)
    return found, _interval(evaluation, evaluation.found_before_goal_probability)


def found_by_interval(evaluation: Evaluation, time_s: float) -> tuple[float, float]:
    """Return the 95 % interval of being found by a time, in the same way."""
    return _interval(evaluation, evaluation.found_by_probability(time_s))


def _interval(evaluation: Evaluation, probability: float) -> tuple[float, float]:
    present = float(evaluation.weight.sum())
    if present <= 0:
        return 0.0, 0.0
    draws = present**2 / float(evaluation.weight @ evaluation.weight)
    low, high = share_interval(min(1.0, probability / present), draws)
    return low * present, high * present
