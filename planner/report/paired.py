"""How much better one plan is than another on the same targets, with a paired interval."""

from collections.abc import Sequence

from planner.clock import clock
from planner.detection.objective import Objective
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
    return _sentence(name, ahead(bests[0], pattern), pattern.objective)


def _sentence(pattern: str, lead: Ahead, objective: Objective) -> str:
    by_s, is_ahead = objective.by_s, lead.share >= 0.0
    counts = by_s is not None and objective.sought > 1  # targets, in place of per cent
    scale, digits = (1.0, 2) if counts else (100.0, 1)
    share, *ends = ((scale if is_ahead else -scale) * one for one in lead)
    low, high = sorted(ends)
    if by_s is None:
        lead_is = f"{share:.1f} % {'sooner than' if is_ahead else 'later than'}"
    elif counts:
        way = "more" if is_ahead else "fewer"
        of_all = f"of the {objective.sought} targets"
        lead_is = f"by {clock(by_s)} it finds {share:.2f} {way} {of_all} than"
    else:
        way = "ahead of" if is_ahead else "behind"
        lead_is = f"by {clock(by_s)} it is {share:.1f} points {way}"
    known = lead.is_known
    interval = f" (95 %: {low:.{digits}f} .. {high:.{digits}f}, paired)" if known else ""
    return f"{BEST}: {lead_is} the best tuned pattern, {pattern}{interval}"
