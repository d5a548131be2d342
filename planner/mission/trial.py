"""A method tried on a scenario: the plan it makes, what it took, and what the plan is worth."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

from planner.compiling import COMPILING
from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.detection.sensor import Sensor
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.mission.planning import budget_of, make_plan, problem_of
from planner.mission.recorder import Recorder
from planner.search.methods import Method
from planner.search.patrol import with_patrol
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult
from planner.user_code import UserFunction


@dataclass(frozen=True, eq=False, kw_only=True)
class Attempt:
    """One plan of one method, before it meets fresh targets."""

    method: str
    sensor: Sensor
    result: SearchResult
    planned: Evaluation  # on the futures that it was planned with
    took_s: float  # wall-clock time of planning, without compilation
    work_allowed: int  # units of work that it might have done
    own: UserFunction | None = None  # the user's, that made it; None: the program's own

    @property
    def plan(self) -> Plan:
        """The plan that the method made."""
        return self.result.plan

    @property
    def roads(self) -> int:
        """How many roads the plan flies."""
        return self.plan.roads

    def evaluated_on(self, targets: Futures) -> Evaluation:
        """Return what the plan is worth on other targets."""
        return evaluate(self.plan.tracks, targets, self.sensor, self.planned.objective)

    def met(self, fresh: Futures) -> "Trial":
        """Return it with what the plan is worth on fresh targets."""
        mine = {field.name: getattr(self, field.name) for field in fields(Attempt)}
        return Trial(**mine, evaluated=self.evaluated_on(fresh))


@dataclass(frozen=True, eq=False, kw_only=True)
class Trial(Attempt):
    """One plan of one method, with its figures."""

    evaluated: Evaluation  # on fresh targets


def try_method(
    method: Method,
    recorder: Recorder,
    futures: Futures,
    fresh: Futures,
    *,
    holdout: Futures | None = None,
    budget: Budget | None = None,
) -> Trial:
    """Return the plan that a method makes on futures, and what it is worth on fresh targets.

    Parameters and errors are those of `attempted`.
    """
    return attempted(method, recorder, futures, holdout=holdout, budget=budget).met(fresh)


def attempted(
    method: Method,
    recorder: Recorder,
    futures: Futures,
    *,
    holdout: Futures | None = None,
    budget: Budget | None = None,
) -> Attempt:
    """Return the plan that a method makes on futures.

    Parameters
    ----------
    holdout
        Other particles, for methods that choose between plans.
    budget
        The scenario's own if not given.

    Raises
    ------
    NotApplicableError
        If the method cannot work on this problem.
    """
    opened = recorder.opened
    budget = budget or budget_of(opened)
    begun_s = time.perf_counter() - COMPILING.spent_s
    made = make_plan(method, opened, recorder, futures, holdout=holdout, budget=budget)
    took_s = time.perf_counter() - COMPILING.spent_s - begun_s
    problem = problem_of(opened, futures, method=method)
    return Attempt(
        method=method.name,
        sensor=problem.sensor,
        result=made,
        planned=evaluate(made.plan.tracks, futures, problem.sensor, problem.objective),
        took_s=took_s,
        work_allowed=budget.work,
        own=method.own,
    )


def try_order(problem: Problem, order: Sequence[int], found: Attempt) -> Attempt:
    """Return an attempt that flies other legs in order, and goes on as long as it can."""
    plan = plan_of_legs(problem, found.method, with_patrol(problem, order))
    made = replace(found, result=replace(found.result, plan=plan))
    return replace(made, planned=made.evaluated_on(problem.futures))
