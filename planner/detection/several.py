"""When the first and the last of several targets are found: figures told of a search, not its aim.

Where one target is tells nothing of the others, so the probabilities multiply: with S_j(t) that
target j is unseen at t (not being there at all included), none is found with probability prod S_j,
and not yet all with 1 - prod(1 - S_j). The expected times are their integrals up to the horizon.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats
from planner.detection.evaluation import Evaluation
from planner.intervals import half_width, interval_of_sum

EVENLY = 1000  # moments up to the horizon at which curves are looked at, beside those of contacts
MOST = 20_000  # moments of contacts with a sensor that may miss: more are thinned out evenly
ROUGHLY = 100  # moments for the width of an interval
NODES = 0.5 + 0.5 * np.array([-1.0, 1.0]) / np.sqrt(3.0)  # of Gauss and Legendre, in a unit


@dataclass(frozen=True)
class Find:
    """When the first, the last or one of several targets is found, with 95 % intervals."""

    expected_s: float  # E[min(tau, horizon)]
    ci95_s: tuple[float, float]  # from 0 to the horizon where fewer than two draws say nothing
    probability: float  # that it is, by the deadline if there is one, else by the horizon
    interval: tuple[float, float]  # of the probability, within 0 and 1


def first_and_last(evaluation: Evaluation) -> tuple[Find, Find]:
    """Return when any of several targets is found, and when all are.

    One of whom nothing is left, as after news, is never found.
    """
    each = [*evaluation.each.values()]
    there = float(len(each) == evaluation.objective.sought)  # 0: one of them never is
    edges_s = _moments(each, evaluation.objective.horizon_s)
    widths_s = np.diff(edges_s)
    nodes_s = (edges_s[:-1, None] + widths_s[:, None] * NODES).ravel()
    unseen = np.array([_unseen(one, nodes_s) for one in each])
    by = np.array([find_of(one).probability for one in each])
    spans_s, horizon_s = np.repeat(widths_s / 2.0, 2), evaluation.objective.horizon_s
    first = _find(
        each,
        float(spans_s @ unseen.prod(axis=0)),
        1.0 - float((1.0 - by).prod()),
        (edges_s, _others(unseen)),
        lambda found: _others(1.0 - found),
    )
    last = _find(
        each,
        horizon_s - there * float(spans_s @ (1.0 - unseen).prod(axis=0)),
        there * float(by.prod()),
        (edges_s, there * _others(1.0 - unseen)),
        lambda found: there * _others(found),
    )
    return first, last


def find_of(evaluation: Evaluation) -> Find:
    """Return when one target is found."""
    by_s = evaluation.objective.by_s or evaluation.objective.horizon_s
    return Find(
        evaluation.expected_detection_time_s,
        evaluation.ci95_s,
        evaluation.found_by_probability(by_s),
        evaluation.found_by_interval(by_s),
    )


def _find(
    each: list[Evaluation],
    expected_s: float,
    probability: float,
    slopes: tuple[Floats, Floats],
    slopes_by: Callable[[Floats], Floats],
) -> Find:
    """Return a figure of all targets with intervals, by how it grows with those of each.

    Parameters
    ----------
    slopes
        Moments, (C + 1,), and at two of each span between them the derivative of what is
        integrated with respect to the probability that a target is unseen, (J, 2 C).
    slopes_by
        Returns the derivative of the probability with respect to those of all targets, (J,), at
        any such.
    """
    edges_s, rates = slopes
    means = rates.reshape(len(each), -1, 2).mean(axis=2)
    halves = [_half_width(one, edges_s, rate) for one, rate in zip(each, means, strict=True)]
    half_s, most_s = float(np.hypot.reduce(halves)), each[0].objective.horizon_s
    found = [find_of(one) for one in each]
    parts = [(one.probability, one.interval) for one in found]
    at, lows, highs = np.array([(one.probability, *one.interval) for one in found]).T
    # A slope that vanishes where a target is surely found, or not, does not at its limit.
    below, above = (np.maximum(slopes_by(at), slopes_by(limit)) for limit in (lows, highs))
    low, _ = interval_of_sum(probability, parts, below.tolist())
    _, high = interval_of_sum(probability, parts, above.tolist())
    # As of one target: fewer than two draws of any say nothing of the time.
    known = np.isfinite(half_s)
    return Find(
        expected_s,
        (expected_s - half_s, expected_s + half_s) if known else (0.0, most_s),
        probability,
        (max(0.0, low), min(1.0, high)),
    )


def _half_width(one: Evaluation, edges_s: Floats, rate: Floats) -> float:
    """Return half the width that one target's draws give an integral, by the delta method.

    A draw counts as the integral of its own survival, times the rate at each moment.
    """
    upto = np.concatenate(([0.0], np.cumsum(rate * np.diff(edges_s))))
    if one.survival is None:
        return half_width(np.interp(one.time_s, edges_s, upto), one.weight)
    some_s = np.linspace(0.0, one.objective.horizon_s, ROUGHLY + 1)
    rates = np.diff(np.interp(some_s, edges_s, upto)) / np.diff(some_s)
    lasts_s = np.array([one.survival.lasts_s(moment_s) for moment_s in some_s.tolist()])
    return half_width(rates @ np.diff(lasts_s, axis=0), one.weight)


def _moments(each: list[Evaluation], horizon_s: float) -> Floats:
    """Return rising moments from 0 to the horizon between which all curves are smooth, or nearly.

    Those of perfect sensors are constant in between.
    """
    evenly, steps = np.linspace(0.0, horizon_s, EVENLY + 1), [np.zeros(0)]
    for one in each:
        if one.survival is None:
            steps.append(one.seen_at)
        else:
            bends_s = np.unique(one.survival.time_s)
            steps.append(bends_s[:: 1 + len(bends_s) // MOST])
    found = np.concatenate(steps)
    return np.union1d(evenly, found[(found > 0.0) & (found < horizon_s)])


def _unseen(one: Evaluation, times_s: Floats) -> Floats:
    """Return the probability that a target is unseen at rising times, (T,)."""
    if one.survival is not None:
        return 1.0 - one.survival.found_by(one.weight, times_s)
    order = np.argsort(one.seen_at)
    found = np.concatenate(([0.0], np.cumsum(one.weight[order])))
    return np.asarray(1.0 - found[np.searchsorted(one.seen_at[order], times_s, side="right")])


def _others(factors: Floats) -> Floats:
    """Return for each row, (J, ...), the product of all others."""
    rows = range(len(factors))
    return np.array([np.delete(factors, row, axis=0).prod(axis=0) for row in rows])
