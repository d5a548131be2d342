"""How far one search is ahead of another on the same targets, with a paired interval."""

import math
from typing import NamedTuple

from planner.detection.evaluation import Evaluation


class Ahead(NamedTuple):
    """How far one plan is ahead of another, with its 95 % interval."""

    # of the other one's expected time; or of all targets, for those by a deadline: of several
    # targets how many more are found
    share: float
    low: float  # these two infinite where too few targets tell nothing
    high: float

    @property
    def is_known(self) -> bool:
        """Whether there is an interval."""
        return math.isfinite(self.low) and math.isfinite(self.high)


def ahead(one: Evaluation, other: Evaluation) -> Ahead:
    """Return how far one plan is ahead of another on the same targets.

    With the least expected time as objective that is 1 - E[one] / E[other], whose interval is that
    of the ratio of two means, linearised about it; with a deadline it is the difference of the
    probabilities. Each target's two times belong together, so that what makes it hard for both
    does not widen the interval. Fewer than two draws tell nothing; of targets in traffic only
    those of different runs of it are independent.
    """
    by_s, other_s = one.objective.by_s, other.expected_detection_time_s
    if one.weight.sum() <= 0.0 or other_s <= 0.0:
        return Ahead(0.0, 0.0, 0.0)
    if by_s is None:
        share = 1.0 - one.expected_detection_time_s / other_s
        apart = ((1.0 - share) * other.time_s - one.time_s) / other_s
    else:
        share = one.found_by_probability(by_s) - other.found_by_probability(by_s)
        apart = one.reward - other.reward
    half = one.half_width(apart)
    return Ahead(share, share - half, share + half)
