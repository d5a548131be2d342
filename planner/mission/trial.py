"""A method tried on a scenario: the plan it makes, what it took, and what the plan is worth."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from planner.detection.evaluation import Evaluation, evaluate
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.mission.recorder import Recorder, budget_of, make_plan, problem_of
from planner.search.methods import Method
from planner.search.patrol import with_patrol
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem

Told = Callable[[float, int], None]


@dataclass(frozen=True, eq=False)
class Trial:
    """One plan of one method, with its figures."""

    method: str
    plan: Plan
    planned: Evaluation  # on the futures that it was planned with
    evaluated: Evaluation  # on fresh targets
    took_s: float  # wall-clock time of planning
    work: int | None  # units of work done, if the method counts them
    allowed: int  # units of work that it might have done
    stopped: bool  # whether the search was told to stop before its work was done

    @property
    def roads(self) -> int:
        """How many roads the plan flies."""
        return sum(len(legs) for legs in self.plan.legs)


@dataclass(frozen=True)
class Limits:
    """What ends a search before its work is done, and who hears how far it has come."""

    seconds: float = float("inf")  # of wall-clock time
    asked: Callable[[], bool] = bool  # whether somebody wants the best plan so far
    told: Told | None = None
    more: int = 1  # times as much work as the scenario says


def try_method(
    method: Method,
    recorder: Recorder,
    futures: Futures,
    fresh: Futures,
    *,
    holdout: Futures | None = None,
    limits: Limits | None = None,
) -> Trial:
    """Return the plan that a method makes on futures, and what it is worth on fresh targets.

    Raises
    ------
    NotApplicableError
        If the method cannot work on this problem.
    """
    limits, watch, opened = limits or Limits(), _Watch(), recorder.opened
    until_s = time.monotonic() + limits.seconds

    def stop() -> bool:
        watch.stopped = watch.stopped or limits.asked() or time.monotonic() > until_s
        return watch.stopped

    def told(value: float, done: int) -> None:
        watch.work = done
        if limits.told:
            limits.told(value, done)

    budget = budget_of(opened)
    budget = replace(budget, work=limits.more * budget.work, stop=stop, told=told)
    begun_s = time.perf_counter()
    plan = make_plan(method, opened, recorder, futures, holdout=holdout, budget=budget)
    took_s = time.perf_counter() - begun_s
    problem = problem_of(opened, futures, method=method)
    both = _evaluated(problem, plan, futures), _evaluated(problem, plan, fresh)
    return Trial(method.name, plan, *both, took_s, watch.work, budget.work, watch.stopped)


def try_order(problem: Problem, order: Sequence[int], fresh: Futures, found: Trial) -> Trial:
    """Return a trial whose plan flies other legs in order, and goes on as long as it can."""
    plan = plan_of_legs(problem, found.method, with_patrol(problem, order))
    planned = _evaluated(problem, plan, problem.futures)
    return replace(found, plan=plan, planned=planned, evaluated=_evaluated(problem, plan, fresh))


def _evaluated(problem: Problem, plan: Plan, targets: Futures) -> Evaluation:
    return evaluate(plan.tracks, targets, problem.sensor, problem.objective)


@dataclass
class _Watch:
    work: int | None = None
    stopped: bool = False
