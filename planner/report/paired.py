"""How much better one plan is than another on the same targets, with a paired interval."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.intervals import NORMAL_95, standard_error
from planner.report.tables import MethodRow
from planner.search.methods import METHODS, is_pattern

BEST = METHODS[0].name  # the planner that is held against the patterns


class Ahead(NamedTuple):
    """How far one plan is ahead of another, with its 95 % interval."""

    share: float  # of the other one's expected time; or of all targets, for those by a deadline
    low: float
    high: float


def ahead(one: Evaluation, other: Evaluation) -> Ahead:
    """Return how far one plan is ahead of another on the same targets.

    With the least expected time as objective that is 1 - E[one] / E[other], whose interval is that
    of the ratio of two means, linearised about it; with a deadline it is the difference of the
    probabilities. Each target's two times belong together, so that what makes it hard for both
    does not widen the interval. Fewer than two draws tell nothing.
    """
    by_s, present = one.objective.by_s, float(one.weight.sum())
    other_s = other.expected_detection_time_s
    if present <= 0.0 or other_s <= 0.0:
        return Ahead(0.0, 0.0, 0.0)
    if by_s is None:
        share = 1.0 - one.expected_detection_time_s / other_s
        apart = ((1.0 - share) * other.time_s - one.time_s) / other_s
    else:
        share = one.found_by_probability(by_s) - other.found_by_probability(by_s)
        apart = one.objective.reward(one.seen_at) - other.objective.reward(other.seen_at)
    half = NORMAL_95 * present * standard_error(apart, one.weight / present)
    return Ahead(share, share - half, share + half)


def against_patterns(rows: Sequence[MethodRow]) -> str | None:
    """Return how far ``best`` is ahead of the best tuned pattern, in words.

    Which pattern is the best one is decided on the fresh targets too, in its favour. None without
    a plan of ``best`` and one of a pattern.
    """
    found = [(row.method, row.evaluated) for row in rows if row.evaluated is not None]
    bests = [evaluated for method, evaluated in found if method == BEST]
    patterns = [(method, one) for method, one in found if is_pattern(method)]
    if not bests or not patterns:
        return None
    name, pattern = patterns[0]
    for method, one in patterns[1:]:
        if one.is_better(pattern):
            name, pattern = method, one
    return _sentence(name, ahead(bests[0], pattern), pattern.objective.by_s)


def _sentence(pattern: str, lead: Ahead, by_s: float | None) -> str:
    sign = 100.0 if lead.share >= 0.0 else -100.0
    share, low, high = (sign * one for one in lead)
    low, high = sorted((low, high))
    if by_s is None:
        lead_is = f"{share:.1f} % {'sooner than' if sign > 0.0 else 'later than'}"
    else:
        way = "ahead of" if sign > 0.0 else "behind"
        lead_is = f"by {clock(by_s)} it is {share:.1f} points {way}"
    interval = f" (95 %: {low:.1f} .. {high:.1f}, paired)" if np.isfinite(low) else ""
    return f"{BEST}: {lead_is} the best tuned pattern, {pattern}{interval}"
