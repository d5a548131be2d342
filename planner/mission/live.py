"""A mission that hears news while it flies: a quick plan at once, the best one soon after.

A plan takes time to make, and perhaps a person to look at it. So it begins a little later than the
news, and the UAV flies on until then as it did.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from planner.compiling import COMPILING
from planner.flight.plan import Plan
from planner.mission.heard import Heard
from planner.mission.online import Mission
from planner.mission.opening import OpenScenario
from planner.mission.planning import budget_of
from planner.mission.replan import Replanned
from planner.mission.resume import Resumed
from planner.mission.standing import Standing
from planner.scenario.news import FoundNews
from planner.search.methods import Method, method_named
from planner.search.stop import Elapsed

QUICK, BEST = method_named("rate"), method_named("best")  # in one pass over the roads; all there is
QUICK_S, BEST_S = 1.0, 15.0  # from the news to the first plan, and to the best one
DECIDE_S = 30.0  # that a person has to say yes
SEARCHES = 0.8  # of the time that is left; the rest is for checks, and for writing

Check = Callable[[OpenScenario, Plan], list[str]]  # what is wrong with a plan, a line each


@dataclass(frozen=True, eq=False)
class Offer:
    """A plan that could be flown from a time on."""

    going_on: Resumed
    found: Replanned
    is_quick: bool  # whether a better one may follow soon
    took_s: float  # from the news until it was there
    wrong: tuple[str, ...]  # why it cannot be flown; empty: nothing

    @property
    def plan(self) -> Plan:
        """The plan."""
        return self.found.attempt.plan

    @property
    def is_new(self) -> bool:
        """Whether it is another plan than the one there was, and can be flown."""
        return not self.found.is_kept and not self.wrong


Decides = Callable[[Offer], bool]  # whether an offer is flown


@dataclass(frozen=True, eq=False)
class Live:
    """Plans a mission anew whenever something is heard."""

    mission: Mission
    check: Check
    decide_s: float = 0.0  # how long it takes to decide on a plan

    def hear(self, heard: Heard, now_s: float, decides: Decides) -> None:
        """Offer a quick plan, then the best one; each is flown from its time on if it is taken.

        What was heard is known from then on, whether a plan is taken or not.

        Parameters
        ----------
        now_s
            Seconds on the target's clock.

        Raises
        ------
        InputError
            If the news cannot be true, or the flight is over; the old plan stands then.
        """
        begun_s = _now_s()
        flags = {"same_source": heard.same_source, "insist": heard.insist}
        standing = heard.standing_at(now_s + QUICK_S + self.decide_s)
        self._offered(self.mission.heard(standing, heard.news, **flags), QUICK, begun_s, decides)
        later = Standing(now_s + BEST_S + self.decide_s)
        self._offered(self.mission.heard(later), self.mission.method, begun_s, decides)

    def _offered(self, going_on: Resumed, method: Method, begun_s: float, decides: Decides) -> None:
        left_s = max(0.0, BEST_S - (_now_s() - begun_s))
        budget = replace(budget_of(going_on.opened), stop=Elapsed(SEARCHES * left_s))
        found = self.mission.planned(going_on, budget, method)
        wrong = () if found.is_kept else (*self.check(going_on.opened, found.attempt.plan),)
        offer = Offer(going_on, found, method is QUICK, _now_s() - begun_s, wrong)
        taken = decides(offer) and offer.is_new
        self.mission.goes_on(going_on, offer.plan if taken else going_on.incumbent)


def ends(heard: Heard, opened: OpenScenario) -> bool:
    """Return whether news ends a mission: no target is left that is not found."""
    known = (*opened.news, *heard.news)
    found = {one.target for one in known if isinstance(one, FoundNews)}
    return len(found) == len(opened.scenario.targets)


def _now_s() -> float:
    return time.monotonic() - COMPILING.spent_s
