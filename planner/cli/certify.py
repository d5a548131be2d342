"""`planner certify`: how far a stored plan can be from the best possible one."""

import argparse
import math
from contextlib import ExitStack
from dataclasses import replace
from itertools import count as counted
from pathlib import Path
from typing import TYPE_CHECKING

from planner.cli.arguments import add_jobs, add_run, count, path, permit_of, share, span
from planner.cli.printing import print_result
from planner.errors import InputError
from planner.interrupts import first_interrupt_asks
from planner.messages import percent

if TYPE_CHECKING:
    from planner.bounds.certificate import Certificate
    from planner.flight.plan import Plan
    from planner.futures.store import Recording
    from planner.mission.opening import OpenScenario
    from planner.search.problem import Problem

SUMMARY = "bound the gap between a run's plan and the best possible plan"
DETAILS = """\
Adds a certificate to plan.json and writes prices.parquet, weights.parquet,
motion.parquet and net.json, with which tools/verify.py checks it.
Ctrl-C stops the search and keeps the best bound so far."""
EXAMPLES = (
    ("certify runs/first --time-limit 60", "what one minute can prove"),
    ("certify runs/first --gap 0.05", "until the gap is below 5 %"),
    ("certify runs/first --sets 10 --force", "for the belief, not one sample"),
)

FEWEST_SETS = 10  # with fewer, Student's limit of their mean is too low to be of use


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner certify`."""
    add_run(parser)
    parser.add_argument(
        "--gap", type=share, default=0.0, metavar="G", help="stop at this gap, e.g. 0.1"
    )
    parser.add_argument(
        "--time-limit", type=span, metavar="S", help="stop after S seconds per set of particles"
    )
    parser.add_argument(
        "--work",
        type=count,
        metavar="N",
        help="number of price steps (default: 600, or unlimited with --time-limit)",
    )
    parser.add_argument(
        "--sets",
        type=count,
        metavar="K",
        help="also bound K independent sets of particles, at least 10, for a statement about the "
        "true optimum",
    )
    parser.add_argument(
        "--futures",
        type=path,
        nargs="+",
        metavar="FILE",
        help="where the file given to `plan --futures` is now (default: where it was)",
    )
    add_jobs(parser)
    parser.add_argument("--force", action="store_true", help="replace an earlier certificate")


def run(arguments: argparse.Namespace) -> int:
    """Bound the gap between a run's plan and the best possible one; write the proof beside it."""
    from planner.cli.session import new_files
    from planner.mission.certificate_file import PROOF, write_better
    from planner.mission.certify import problem_of_plan, refuse_unprovable
    from planner.mission.run_folder import PLAN, open_run, refuse_no_run, refuse_other_futures
    from planner.mission.several import refuse_several
    from planner.report.sentences import world_line

    _check_sets(arguments.sets)
    run_folder: Path = arguments.directory
    refuse_no_run(run_folder)
    with ExitStack() as stack:
        folder = new_files(stack, run_folder, PROOF, force=arguments.force)
        # No other command replaces it now.
        opened, stored = open_run(run_folder, permit_of(arguments))
        refuse_unprovable(opened, stored.plan)
        refuse_several(opened, "certify")
        recording = _planned_on(arguments, opened)
        refuse_other_futures(run_folder, recording)
        problem = problem_of_plan(opened, stored.plan, recording.futures)
        certificate, limit = _certificate(arguments, opened, stored.plan, problem)
        of_sets = None if limit is None else (limit, arguments.sets)
        plan_file = run_folder / PLAN
        stays, kept = write_better(folder, plan_file, problem, certificate, of_sets)
        summary = stays.content()
    lines = _lines(certificate, limit, arguments.sets, problem.objective.by_s)
    if not problem.sensor.is_perfect and math.isinf(certificate.rate_per_s):
        closer = "; fewer particles may have a closer one" * (certificate.plan_class == "roads")
        lines.insert(1, f"this bound is that of a sensor that misses nobody{closer}")
    if kept:
        lines.insert(1, f"the earlier bound is better and stays: gap {percent(summary['gap'])}")
    if limit is not None and opened.scenario.truth == opened.scenario.target:
        lines.append(world_line(limit, stored.evaluated, problem.objective.by_s))
    print_result(arguments, summary, [*lines, f"written to {run_folder}"])
    return 0


def _planned_on(arguments: argparse.Namespace, opened: "OpenScenario") -> "Recording":
    """Return the particles that the plan was made on: the scenario's, or a user's own."""
    from planner.cli.session import planning_recorded
    from planner.mission.own_futures import OwnFutures, read_split
    from planner.mission.run_folder import own_futures

    planned_on = own_futures(arguments.directory)
    if planned_on is None and arguments.futures is None:
        return planning_recorded(arguments, opened)
    if arguments.sets is not None:
        raise InputError(
            "--sets: draws from the scenario's belief, but the plan was made on --futures; "
            "leave it out"
        )
    own = planned_on or OwnFutures(arguments.futures[0])
    if arguments.futures is not None:
        own = replace(own, path=arguments.futures[0], others=tuple(arguments.futures[1:]))
    for file in own.paths:
        if not file.is_file():
            raise InputError(
                f"{file}: the plan was made on this file, which is gone; --futures FILE"
            )
    return read_split(own, opened).planning


def _check_sets(sets: int | None) -> None:
    if sets is not None and sets < FEWEST_SETS:
        raise InputError(f"--sets {sets}: too few to allow for chance; give {FEWEST_SETS} or more")


def _certificate(
    arguments: argparse.Namespace, opened: "OpenScenario", plan: "Plan", problem: "Problem"
) -> "tuple[Certificate, float | None]":
    """Return the certificate, and the limit of the true optimum if other sets are asked for."""
    from planner.bounds.certificate import certified
    from planner.cli.progress import progress_bar
    from planner.cli.session import Drive, announcing
    from planner.cli.trials import Bounding, certificate_of
    from planner.mission.certify import bounds_of_sets, limit_of

    seconds, sets = arguments.time_limit, arguments.sets
    limit_s = math.inf if seconds is None else seconds
    with first_interrupt_asks() as asked:
        bounding = Bounding(asked, arguments.gap, limit_s, arguments.work, arguments.jobs)
        certificate = certificate_of(problem, plan, bounding)
        if sets is None:
            return certificate, None
        with progress_bar("other sets") as progress:
            drive = Drive.of_belief("recording other sets", opened)
            recorder = announcing(arguments, opened, drive, sets=sets)
            done = counted(1)

            def bound(other: "Problem") -> float | None:
                if asked():
                    return None
                found = certified(other, plan, bounding.effort()).bound
                progress(next(done), sets)
                return found

            bounds = bounds_of_sets(recorder, plan, sets, bound)
    enough = len(bounds) == sets and len(bounds) > 1
    return certificate, limit_of(bounds, problem.objective.by_s) if enough else None


def _lines(
    certificate: "Certificate", limit: float | None, sets: int | None, by_s: float | None
) -> list[str]:
    from planner.report import sentences

    lines = [sentences.certificate_line(certificate, by_s)]
    if limit is None and sets is not None:
        lines.append("stopped too early for a statement about the true optimum")
    if certificate.better:
        lines.append("a better plan was met on the way: `planner plan --gap` takes such plans")
    if limit is not None and sets is not None:
        lines.append(sentences.limit_line(limit, sets, by_s))
    return lines
