"""What comes of a search: a plan, what it took, and how its best value grew."""

from dataclasses import dataclass
from typing import NamedTuple

from planner.flight.plan import Plan
from planner.search.problem import Budget, Problem


class TracePoint(NamedTuple):
    """The best value known after some work."""

    work: int  # units done
    value: float  # the objective's figure: seconds, or a probability


@dataclass(frozen=True, eq=False)
class SearchResult:
    """A planner's plan, and what its search did to find it."""

    plan: Plan
    work: int | None = None  # units done; None: the planner counts none
    stopped: bool = False  # whether a rule ended it before its work was done
    trace: tuple[TracePoint, ...] = ()  # rising work; values on the particles searched on


class SearchLog:
    """What a search has done so far: it is asked when to stop and given what is reached."""

    def __init__(self, problem: Problem, budget: Budget) -> None:
        self._objective, self._budget = problem.objective, budget
        self.work: int | None = None
        self.stopped = False
        self.trace: list[TracePoint] = []

    def stop(self) -> bool:
        """Return whether to stop now; once true, always true."""
        self.stopped = self.stopped or self._budget.stop(self.work or 0)
        return self.stopped

    def reached(self, reward: float, work: int) -> None:
        """Take note of the best expected reward after some units of work."""
        self.work = work
        value = self._objective.value(reward)
        if not self.trace or self.trace[-1].value != value:
            self.trace.append(TracePoint(work, value))
        note = self._objective.as_text(value)
        self._budget.on_progress(min(work, self._budget.work), self._budget.work, note)

    def result(self, plan: Plan) -> SearchResult:
        """Return the plan with what the search did."""
        return SearchResult(plan, self.work, self.stopped, tuple(self.trace))
