"""A method tried on a scenario: the plan it makes, what it took, and what the plan is worth."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from planner.compiling import COMPILING
from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.mission.recorder import Recorder, budget_of, make_plan, problem_of
from planner.search.methods import Method
from planner.search.patrol import with_patrol
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult


@dataclass(frozen=True, eq=False)
class Trial:
    """One plan of one method, with its figures."""

    method: str
    result: SearchResult
    planned: Evaluation  # on the futures that it was planned with
    evaluated: Evaluation  # on fresh targets
    took_s: float  # wall-clock time of planning, without compilation
    work_allowed: int  # units of work that it might have done

    @property
    def plan(self) -> Plan:
        """The plan that the method made."""
        return self.result.plan

    @property
    def roads(self) -> int:
        """How many roads the plan flies."""
        return self.plan.roads


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
    both = _evaluated(problem, made.plan, futures), _evaluated(problem, made.plan, fresh)
    return Trial(method.name, made, *both, took_s, budget.work)


def try_order(problem: Problem, order: Sequence[int], fresh: Futures, found: Trial) -> Trial:
    """Return a trial whose plan flies other legs in order, and goes on as long as it can."""
    plan = plan_of_legs(problem, found.method, with_patrol(problem, order))
    planned = _evaluated(problem, plan, problem.futures)
    made = replace(found.result, plan=plan)
    return replace(found, result=made, planned=planned, evaluated=_evaluated(problem, plan, fresh))


def _evaluated(problem: Problem, plan: Plan, targets: Futures) -> Evaluation:
    return evaluate(plan.tracks, targets, problem.sensor, problem.objective)
