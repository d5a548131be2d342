"""A mission that hears news while it flies: a quick plan at once, the best one soon after.

A plan takes time to make, and perhaps a person to look at it. So it begins a little later than the
news, and the UAV flies on until then as it did.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from planner.compiling import COMPILING
from planner.flight.plan import Plan
from planner.mission.news_words import Heard
from planner.mission.online import Mission
from planner.mission.opening import OpenScenario
from planner.mission.recorder import budget_of
from planner.mission.replan import Replanned, Resumed, Standing
from planner.scenario.news import FoundNews
from planner.search.methods import method_named
from planner.search.stop import Elapsed

QUICK = method_named("rate")  # in one pass over the roads
QUICK_S, BEST_S = 1.0, 15.0  # from the news to the first plan, and to the best one
DECIDE_S = 30.0  # that a person has to say yes

Check = Callable[[OpenScenario, Plan], list[str]]  # what is wrong with a plan, a line each


@dataclass(frozen=True, eq=False)
class Proposal:
    """A plan that could be flown from a time on."""

    going_on: Resumed
    found: Replanned
    by: str  # the method
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


class Live:
    """Turns news into proposals; whoever listens decides on each before the next one comes."""

    def __init__(self, mission: Mission, check: Check, *, decide_s: float = 0.0) -> None:
        self.mission, self._check, self._decide_s = mission, check, decide_s

    def hear(self, heard: Heard, now_s: float) -> Iterator[Proposal]:
        """Yield a quick plan, then the best one; each counts as soon as it is taken.

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
        standing = heard.standing_at(now_s + QUICK_S + self._decide_s)
        flags = {"same_source": heard.same_source, "insist": heard.insist}
        going_on = self.mission.heard(standing, heard.news, **flags)
        quick = self._proposed(going_on, begun_s, QUICK.name)
        yield quick
        # What was heard is known from here on, whether the plan is taken or not.
        self.mission.goes_on(going_on, quick.plan if self._is_taken(quick) else going_on.incumbent)
        later = self.mission.heard(Standing(now_s + BEST_S + self._decide_s))
        best = self._proposed(later, begun_s, self.mission.method.name)
        yield best
        if self._is_taken(best):
            self.mission.goes_on(later, best.plan)

    def take(self, proposal: Proposal) -> None:
        """Fly a proposal from its time on."""
        self._taken = proposal

    _taken: Proposal | None = None

    def _is_taken(self, proposal: Proposal) -> bool:
        return self._taken is proposal

    def _proposed(self, going_on: Resumed, begun_s: float, name: str) -> Proposal:
        left_s = max(0.0, BEST_S - (_now_s() - begun_s))
        budget = replace(budget_of(going_on.opened), stop=Elapsed(0.8 * left_s))
        found = self.mission.planned(going_on, budget, method_named(name))
        wrong = () if found.is_kept else (*self._check(going_on.opened, found.attempt.plan),)
        return Proposal(going_on, found, name, _now_s() - begun_s, wrong)


def ends(heard: Heard, targets: int = 1) -> bool:
    """Return whether news ends a mission: the only target is found."""
    found = {one.target for one in heard.news if isinstance(one, FoundNews)}
    return len(found) >= targets


def _now_s() -> float:
    return time.monotonic() - COMPILING.spent_s
