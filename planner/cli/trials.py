"""Methods tried and plans bounded while the terminal shows the progress."""

import argparse
import logging
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from planner.bounds.certificate import STEPS, Certificate, Effort, certified
from planner.cli.backends import recorder_of
from planner.cli.progress import progress_bar
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.futures.workers import cores
from planner.mission.opening import OpenScenario
from planner.mission.planning import budget_of
from planner.mission.trial import Attempt, attempted
from planner.progress import Progress, silent
from planner.search.methods import Method
from planner.search.problem import Budget, Problem
from planner.search.stop import AnyOf, Asked, Elapsed, WorkDone

log = logging.getLogger(__name__)


def attempt_of(
    arguments: argparse.Namespace,
    opened: OpenScenario,
    method: Method,
    futures: Futures,
    *,
    holdout: Futures | None = None,
    budget: Budget | None = None,
) -> Attempt:
    """Return what a method makes of a scenario, and show the best value while it plans.

    Parameters
    ----------
    futures
        To plan with.
    holdout
        To choose between plans with.
    budget
        The scenario's own if not given.
    """
    with progress_bar(f"planning: {method.name}") as progress:

        def on_progress(done: int, total: int, note: str = "", /) -> None:
            log.info("best so far %s after %d units of work", note, done)
            progress(done, total, note)

        return attempted(
            method,
            recorder_of(arguments, opened),
            futures,
            holdout=holdout,
            budget=replace(budget or budget_of(opened), on_progress=on_progress),
        )


@dataclass(frozen=True)
class Bounding:
    """When the search for a bound ends."""

    asked: Callable[[], bool]  # whether the user wants the best bound so far
    gap: float = 0.0  # as soon as it is this small
    seconds: float = math.inf  # of wall-clock time
    steps: int | None = None  # price steps; None: the usual number, or any within the seconds
    workers: int | None = None  # threads; None: one for each core

    @property
    def most_steps(self) -> int | None:
        """How many price steps are taken at most, None if only the time limits them."""
        return self.steps or (STEPS if math.isinf(self.seconds) else None)

    def effort(self, on_progress: Progress = silent) -> Effort:
        """Return what one search may spend, whose time begins now."""
        steps = [] if self.most_steps is None else [WorkDone(self.most_steps)]
        stop = AnyOf(Asked(self.asked), Elapsed(self.seconds), *steps)
        return Effort(self.gap, stop, on_progress, self.workers or cores())


def certificate_of(problem: Problem, plan: Plan, bounding: Bounding) -> Certificate:
    """Return a plan's certificate, and show value, bound and gap as they converge."""
    begun_s, most = time.monotonic(), bounding.most_steps
    with progress_bar("certifying") as progress:

        def on_progress(step: int, _: int, note: str = "", /) -> None:
            done, total = (step, most) if most else (time.monotonic() - begun_s, bounding.seconds)
            progress(int(min(done, total)), math.ceil(total), note)

        return certified(problem, plan, bounding.effort(on_progress))
