"""What `planner certify` does; bounds with their progress, for all who ask for one."""

import argparse
import math
import time
from contextlib import ExitStack

from planner.bounds.certificate import STEPS, Certificate
from planner.cli.session import output, recorded, tell
from planner.errors import InputError
from planner.flight.plan import Plan
from planner.interrupts import first_asks
from planner.mission import certificate_file as files
from planner.mission import certify as mission
from planner.mission.opening import OpenScenario
from planner.mission.recorder import Recorder
from planner.report import run_files
from planner.report import sentences as remarks
from planner.report.progress import progress
from planner.search.problem import Problem

UNCOUNTED = 10**9  # price steps, where the time is the limit
FEWEST_SETS = 10  # from fewer, Student's limit of their mean lies too low to tell anything


def certify(arguments: argparse.Namespace) -> int:
    """Bound how much better than a run's plan any plan can be, and write the proof beside it."""
    arguments.output = arguments.directory
    opened, stored = run_files.open_run(arguments.directory)
    if arguments.sets is not None and arguments.sets < FEWEST_SETS:
        raise InputError(
            f"--sets {arguments.sets}: tells too little of chance; give {FEWEST_SETS} or more"
        )
    with ExitStack() as stack:
        folder = output(stack, arguments, files.PROOF)
        assert folder is not None
        recording = recorded(arguments, opened, "recording futures", Recorder.planning)
        run_files.same_futures(arguments.directory, recording)
        problem = mission.problem_of_plan(opened, stored.plan, recording.futures)
        certificate, limit = _certificate(arguments, opened, stored.plan, problem)
        of_sets = None if limit is None else (limit, arguments.sets)
        plan_file = arguments.directory / run_files.PLAN
        stays, kept = files.write_better(folder, plan_file, problem, certificate, of_sets)
        told = stays.content()
    shown = [remarks.certificate_line(certificate, problem.objective.by_s)]
    if kept:
        shown.append(f"the earlier bound is better and stays: gap {told['gap']:.1%}")
    if limit is None and arguments.sets is not None:
        shown.append("the other sets were stopped too soon for a statement about the true optimum")
    if certificate.better:
        shown.append("a better plan was met on the way: `planner plan --gap` takes such plans")
    if limit is not None:
        shown.append(remarks.limit_line(limit, arguments.sets, problem.objective.by_s))
        if opened.scenario.truth == opened.scenario.target:
            shown.append(remarks.world_line(limit, stored.evaluated, problem.objective.by_s))
    tell(arguments, told, [*shown, f"written to {arguments.directory}"])
    return 0


def certificate_of(problem: Problem, plan: Plan, limits: mission.Limits) -> Certificate:
    """Return a plan's certificate, and show value, bound and gap while they come closer."""
    begun_s = time.monotonic()
    timed = limits.steps >= UNCOUNTED and math.isfinite(limits.seconds)
    with progress("certifying") as shown:

        def told(step: int, value: float, bound: float, gap: float) -> None:
            note = f"value {value:,.6g}, bound {bound:,.6g}, gap {gap:.1%}"
            done = time.monotonic() - begun_s if timed else step
            all_s = limits.seconds if timed else limits.steps
            shown(int(min(done, all_s)), math.ceil(all_s), note)

        return mission.certify(problem, plan, limits, told)


def _certificate(
    arguments: argparse.Namespace, opened: OpenScenario, plan: Plan, problem: Problem
) -> tuple[Certificate, float | None]:
    """Return the certificate, and the limit of the true optimum if other sets are asked for."""
    seconds = math.inf if arguments.time_limit is None else arguments.time_limit
    with first_asks() as asked:
        steps = arguments.work or (STEPS if arguments.time_limit is None else UNCOUNTED)
        limits = mission.Limits(arguments.gap, steps, seconds, asked)
        certificate = certificate_of(problem, plan, limits)
        if arguments.sets is None:
            return certificate, None
        with progress("other sets") as shown:
            recorder = Recorder(opened, arguments.jobs)
            bounds = mission.bounds_of_sets(
                recorder, plan, limits, arguments.sets, lambda n: shown(n, arguments.sets)
            )
    enough = len(bounds) == arguments.sets and len(bounds) > 1
    return certificate, mission.limit_of(bounds, problem.objective.by_s) if enough else None
