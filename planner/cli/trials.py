"""Methods tried and plans bounded while the terminal shows the progress."""

import argparse
import logging
import math
import time
from dataclasses import dataclass, replace

from planner.bounds.certificate import Certificate
from planner.cli.progress import progress_bar
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.futures.store import Recording
from planner.mission import certify
from planner.mission.opening import OpenScenario
from planner.mission.recorder import Recorder
from planner.mission.trial import Limits, Trial, try_method
from planner.search.methods import Method
from planner.search.problem import Problem

log = logging.getLogger(__name__)

UNCOUNTED = 10**9  # price steps, where the time is the limit


@dataclass(frozen=True, eq=False)
class Targets:
    """The recorded targets of a scenario, each set for one use."""

    planning: Recording
    fresh: Recording
    holdout: Futures | None = None


def trial_of(
    arguments: argparse.Namespace,
    opened: OpenScenario,
    method: Method,
    targets: Targets,
    limits: Limits | None = None,
) -> Trial:
    """Return what a method makes of a scenario, and show the best value while it plans."""
    limits, search = limits or Limits(), opened.scenario.search
    work = limits.more * search.work
    with progress_bar(f"planning: {method.name}") as progress:

        def on_progress(value: float, done: int) -> None:
            best = f"{value:,.0f} s" if search.objective == "time" else f"{value:.1%} found"
            log.info("best so far %s after %d units of work", best, done)
            progress(min(done, work), work, best)

        return try_method(
            method,
            Recorder(opened, arguments.jobs),
            targets.planning.futures,
            targets.fresh.futures,
            holdout=targets.holdout,
            limits=replace(limits, told=on_progress),
        )


def certificate_of(problem: Problem, plan: Plan, limits: certify.Limits) -> Certificate:
    """Return a plan's certificate, and show value, bound and gap as they converge."""
    begun_s = time.monotonic()
    timed = limits.steps >= UNCOUNTED and math.isfinite(limits.seconds)
    with progress_bar("certifying") as progress:

        def on_progress(step: int, value: float, bound: float, gap: float) -> None:
            note = f"value {value:,.6g}, bound {bound:,.6g}, gap {gap:.1%}"
            done = time.monotonic() - begun_s if timed else step
            total = limits.seconds if timed else limits.steps
            progress(int(min(done, total)), math.ceil(total), note)

        return certify.certify(problem, plan, limits, on_progress)
