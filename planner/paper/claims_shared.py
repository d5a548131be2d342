"""What the claims on Figures 8 and 9 share: who is compared, and the words for it."""

from collections.abc import Sequence
from typing import Any

from planner.messages import percent
from planner.paper.claims import Verdict
from planner.paper.figures import HORIZON_S
from planner.report.estimates import Estimate

GREEDY: dict[str, Any] = {"block": "300 s", "method": "greedy"}
EXHAUSTIVE: dict[str, Any] = {"block": "no planning", "method": "exhaustive-shortest"}
FIFO: dict[str, Any] = {"block": "no planning", "method": "exhaustive"}
PAPERS_M = 120e3  # where the paper says that things change
UNDER = 0.9  # of the horizon: a mean above it is not significantly under

PRESET = (
    "preset `paper` (targets start at the origin, greedy takes off at 300 s, exhaustive at 0, "
    "failures count 10,000 s), all paths by their probability, speeds 15 to 25 m/s"
)
UNDER_READING = (
    f"a mean is under if the upper end of its interval is below {UNDER * HORIZON_S:,.0f} s, "
    f"{percent(1 - UNDER, 0)} less than the horizon"
)


def well_under(one: Estimate) -> bool:
    """Return whether a mean is under the horizon by a margin that means something."""
    return one.high < UNDER * HORIZON_S


def verdict_on(holds: Sequence[bool]) -> Verdict:
    """Return the verdict on a claim that should hold in each of some cases."""
    if holds and all(holds):
        return "reproduced"
    return "in part" if any(holds) else "not reproduced"
