"""How much better one plan is than another on the same targets, with a paired interval."""

from collections.abc import Sequence

import numpy as np

from planner.clock import clock
from planner.detection.paired import Ahead, ahead
from planner.report.tables import MethodRow
from planner.search.methods import METHODS, is_pattern

BEST = METHODS[0].name  # the planner that is held against the patterns


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
