"""The work of `planner plan`: record, plan, certify if a gap is asked for, evaluate, write."""

import argparse
import logging
import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from planner.bounds.certificate import Certificate
from planner.cli.found import Found, Planned, blocks_of
from planner.cli.page import COMPARED, compared
from planner.cli.preview import Preview, show_first_plan
from planner.cli.printing import print_result
from planner.cli.run_record import Watch, planning_record, record_of, targets_record
from planner.cli.session import (
    evaluation_recorded,
    futures_of_run,
    holdout_recorded,
    opened_scenario,
    output_folder,
    planning_recorded,
    tell_own,
)
from planner.cli.trials import Bounding, attempt_of, certificate_of
from planner.detection.evaluation import Evaluation
from planner.detection.mistimed import mistimed
from planner.detection.prospects import prospects
from planner.errors import InputError, NotApplicableError
from planner.export.formats import names_in_run
from planner.files import write_json
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.futures.store import Recording
from planner.interrupts import first_interrupt_asks
from planner.messages import counted
from planner.mission import certificate_file, certify, run_folder
from planner.mission.now_events import FirstPlan
from planner.mission.opening import OpenScenario
from planner.mission.own_futures import OwnFutures, read_split
from planner.mission.planning import budget_of, problem_of
from planner.mission.replan import Replanned
from planner.mission.run_folder import OWN_BEGIN, own_key
from planner.mission.to_gap import TwoSided, planned_to_gap
from planner.mission.trial import Attempt, try_order
from planner.page.page import page
from planner.page.shown import Shown
from planner.report import run_files, sentences, tables
from planner.scenario.source import paths_in_record
from planner.search.methods import Method, method_named
from planner.search.stop import AnyOf, Asked, Elapsed

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class _Targets:
    """The recorded targets of a scenario, each set for one use."""

    planning: Recording
    holdout: Futures | None = None
    kept_out: Recording | None = None  # to evaluate on; None: fresh ones, driven for the plan
    are: tables.Fresh = tables.FRESH  # what those are that it is evaluated on
    own: OwnFutures | None = None  # whence they are; None: from the belief


def plan_and_write(arguments: argparse.Namespace, overrides: Sequence[str]) -> int:
    """Plan a search, evaluate it on fresh targets, and write the run."""
    method, watch = method_named(arguments.method), Watch()
    with ExitStack() as stack:
        flown = [] if arguments.output is None else names_in_run(arguments.output)
        names = (*run_folder.RUN, *certificate_file.PROOF, *flown)
        folder = output_folder(stack, arguments, names)
        opened = opened_scenario(arguments, overrides)
        targets = _targets(arguments, opened, method)
        watch.lap("futures")
        planned = _planned(arguments, opened, method, targets)
        watch.lap("search")
        preview = Preview(arguments, opened, planned.attempt)
        found = _evaluated(arguments, targets, planned, preview)
        watch.lap("fresh targets")
        if folder is not None:
            _write_all(folder, arguments, targets, found, watch)
    summary = {key: found.content[key] for key in ("method", "planned", "evaluated")}
    if arguments.gap is not None:
        summary["certificate"] = found.certificate and certificate_file.certificate_content(
            found.problem, found.certificate
        )
    summary["directory"] = arguments.output and str(arguments.output)
    blocks = blocks_of(arguments, found, own=targets.own, shown=preview.is_shown)
    print_result(arguments, summary, blocks)
    return 0


def write_event(folder: Path, arguments: argparse.Namespace, event: FirstPlan) -> None:
    """Write the run of a call's plan, as `planner plan` writes that of its scenario."""
    watch = Watch()
    targets = _Targets(event.planning, event.holdout, kept_out=event.fresh)
    planned = Planned(event.opened, event.problem, event.trial)
    _write_all(folder, arguments, targets, _evaluated(arguments, targets, planned, None), watch)


def write_replanned(
    folder: Path | None,
    arguments: argparse.Namespace,
    found: Replanned,
    planning: Recording,
    parent: Mapping[str, Any],
) -> tuple[tables.MethodRow, Evaluation, Futures]:
    """Write the run of what is left of another one.

    Returns its row in a table, what it is worth on fresh targets, and these.

    Parameters
    ----------
    folder
        Where; None: nowhere.
    parent
        Of which run it is the rest, as ``plan.json`` has it.
    """
    watch, opened = Watch(), found.resumed.opened
    targets = _Targets(planning, found.holdout)
    planned = Planned(opened, found.problem, found.attempt, parent=parent)
    whole = _evaluated(arguments, targets, planned, None)
    if folder is not None:
        _write_all(folder, arguments, targets, whole, watch)
    return whole.row, whole.trial.evaluated, whole.met


def _write_all(
    folder: Path, arguments: argparse.Namespace, targets: _Targets, found: Found, watch: Watch
) -> None:
    """Write all files of a run."""
    watch.took_s["planning"] = found.trial.took_s
    _write(folder, found)
    _write_page(folder, arguments, found, targets)
    watch.lap("files")
    record = record_of(arguments, found.opened, found.content, targets.planning, watch)
    if targets.own is not None:
        for number, path in enumerate(targets.own.paths):
            record |= paths_in_record(own_key(number), path, arguments.output)
        record[OWN_BEGIN] = targets.own.begin_s
    record["planning"] = planning_record(found.trial)
    record["targets"] = targets_record(targets.planning, targets.holdout, found.trial)
    write_json(folder / run_folder.PROVENANCE, record)


def _targets(arguments: argparse.Namespace, opened: OpenScenario, method: Method) -> _Targets:
    """Return the targets to plan with, and to choose between plans with."""
    own = _own_futures(arguments)
    if own is None:
        planning = planning_recorded(arguments, opened)
        begins = partial(
            show_first_plan, arguments=arguments, opened=opened, futures=planning.futures
        )
        return _Targets(planning, holdout_recorded(arguments, opened, method, begins=begins))
    if opened.scenario.greedy.particles == "anew":
        raise InputError(
            'greedy.particles: "anew" draws from the belief at every step, which --futures '
            'takes the place of; use "once"'
        )
    split = read_split(own, opened)
    if split.kept_out is None:
        return _Targets(split.planning, are=tables.OTHERS, own=own)
    if arguments.targets is not None:
        log.warning(
            "--targets %d: goes unused; the plan is evaluated on the %s kept out of %s",
            arguments.targets,
            counted(len(split.kept_out.futures), "vehicle"),
            ", ".join(path.name for path in own.paths),
        )
    return _Targets(split.planning, kept_out=split.kept_out, are=tables.KEPT_OUT, own=own)


def _own_futures(arguments: argparse.Namespace) -> OwnFutures | None:
    """Return the futures that take the place of the belief; None if the belief holds."""
    if arguments.futures is not None:
        return OwnFutures(arguments.futures[0], arguments.begin, tuple(arguments.futures[1:]))
    own = futures_of_run(arguments)
    if own is not None:
        tell_own(arguments, own)
    return own


def _evaluated(
    arguments: argparse.Namespace, targets: _Targets, planned: Planned, preview: Preview | None
) -> Found:
    """Return a plan with what it is worth on targets that had no part in making it."""
    fresh, attempt = targets.kept_out, planned.attempt
    if fresh is None:

        def so_far(first: Futures) -> str:
            return sentences.so_far(attempt.evaluated_on(first))

        fresh = evaluation_recorded(arguments, planned.opened, begins=preview, note=so_far)
    problem = planned.problem
    judged = (fresh.futures, problem.sensor, problem.objective)
    is_real = problem.uav.aircraft is not None
    return Found(
        **vars(planned),
        met=fresh.futures,
        trial=attempt.met(fresh.futures),
        prospects=prospects(fresh.futures, problem.flying, problem.sensor, problem.objective),
        fresh=targets.are,
        timing=mistimed(attempt.plan.tracks, *judged) if is_real else (),
    )


def _planned(
    arguments: argparse.Namespace, opened: OpenScenario, method: Method, targets: _Targets
) -> Planned:
    """Return what the method finds; with --gap, the plan and the bound that come closest."""
    problem = problem_of(opened, targets.planning.futures, method=method)
    seconds = math.inf if arguments.time_limit is None else arguments.time_limit
    reasons: list[str] = []
    with first_interrupt_asks() if method.stops else nullcontext(bool) as asked:

        def planned(more: int, limit_s: float) -> Attempt:
            budget, stop = budget_of(opened), AnyOf(Elapsed(limit_s), Asked(asked))
            budget = replace(budget, work=more * budget.work, stop=stop)
            futures, holdout = targets.planning.futures, targets.holdout
            return attempt_of(arguments, opened, method, futures, holdout=holdout, budget=budget)

        def bound(plan: Plan, limit_s: float) -> Certificate | None:
            try:
                certify.refuse_unprovable(opened, plan)
                with nullcontext(asked) if method.stops else first_interrupt_asks() as interrupted:
                    jobs = arguments.jobs
                    bounding = Bounding(interrupted, arguments.gap, limit_s, workers=jobs)
                    return certificate_of(problem, plan, bounding)
            except NotApplicableError as error:
                reasons.append(str(error))
                return None

        if arguments.gap is None:
            return Planned(opened, problem, planned(1, seconds))

        def fly(order: Sequence[int], attempt: Attempt) -> Attempt:
            return try_order(problem, order, attempt)

        sides = TwoSided(planned, bound, fly, asked)
        attempt, certificate = planned_to_gap(
            sides, arguments.gap, seconds=seconds, again=method.stops
        )
        no_bound = reasons[0] if reasons else ""
        return Planned(opened, problem, attempt, certificate, no_bound)


def _write(folder: Path, found: Found) -> None:
    opened, problem, trial = found.opened, found.problem, found.trial
    certificate = found.certificate
    name = opened.scenario.name
    if not opened.network.is_abstract:
        name = opened.scenario.title or name
    title = f"{name}: {trial.method}"
    run_files.write_run(folder, problem, trial.plan, found.content, found.row, title=title)
    if certificate is not None:
        summary = certificate_file.certificate_content(problem, certificate)
        plan_file = folder / run_folder.PLAN
        certificate_file.write_certificate(folder, problem, certificate, plan_file, summary)


def _write_page(
    folder: Path, arguments: argparse.Namespace, found: Found, targets: _Targets
) -> None:
    opened = found.opened
    methods = [method for method in COMPARED if method.name != found.trial.method]
    others = compared(arguments, opened, methods, targets.planning.futures, found.met)
    run = Shown(opened, found.trial.plan, found.met, found.trial.evaluated, others)
    (folder / run_folder.PAGE).write_text(page(run), encoding="utf-8", newline="\n")
