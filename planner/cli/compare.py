"""What `planner compare` does: all methods on a scenario, side by side."""

import argparse
import math
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from planner.bounds.certificate import STEPS
from planner.cli.certify import UNCOUNTED, certificate_of
from planner.cli.session import (
    Targets,
    evaluation_recorded,
    holdout_recorded,
    opened_of,
    output_file,
    recorded,
    tell,
    trial_of,
)
from planner.detection.evaluation import evaluate
from planner.errors import InputError, NotApplicableError
from planner.flight.plan import Plan
from planner.interrupts import first_asks
from planner.mission import certify
from planner.mission.bounds import Bounds, bounds_of, stored_bound
from planner.mission.opening import OpenScenario
from planner.mission.recorder import Recorder
from planner.mission.trial import Trial
from planner.report import run_files, tables
from planner.report import sentences as remarks
from planner.report.progress import progress
from planner.search.methods import METHODS, Method


def compare(arguments: argparse.Namespace) -> int:
    """Compare all methods on the same futures and the same fresh targets."""
    if arguments.instances:
        return _compare_instances(arguments)
    if arguments.scenario is None:
        raise InputError("compare: names no scenario; give one, or --instances")
    if arguments.time_limit is not None and not arguments.bound:
        raise InputError(f"--time-limit {arguments.time_limit:g}: goes with --bound")
    with ExitStack() as stack:
        path = output_file(stack, arguments, force=arguments.force)
        opened = opened_of(arguments)
        recording = recorded(arguments, opened, "recording futures", Recorder.planning)
        targets = Targets(recording, evaluation_recorded(arguments, opened))
        tried = _tried(arguments, opened, targets)
        stored, bounds = _stored(arguments, opened, targets)
        if arguments.bound:
            bounds = _computed(arguments, opened, targets, tried, bounds)
        rows = [*_rows(tried, bounds), *stored]
        if path is not None:
            run_files.write_compare(path, rows)
    told = [run_files.compare_cells(row) for row in rows]
    title = f"{opened.scenario.name}: {len(targets.fresh.futures):,} fresh targets"
    shown: list[Any] = [tables.compare_table(rows, title), *remarks.reasons(rows), *bounds.reasons]
    tell(arguments, {"methods": told}, shown)
    return 0


def _compare_instances(arguments: argparse.Namespace) -> int:
    from planner.cli.instances import compare_instances

    if arguments.bound:
        raise InputError("--bound: goes with one scenario, not with --instances")
    return compare_instances(arguments)


def _tried(
    arguments: argparse.Namespace, opened: OpenScenario, targets: Targets
) -> list[Trial | tables.MethodRow]:
    """Return the trial of each method; the row that says why where it cannot be used."""
    tried: list[Trial | tables.MethodRow] = []
    with progress("methods") as told:
        for done, method in enumerate(METHODS):
            told(done, len(METHODS))
            tried.append(_try(arguments, opened, method, targets))
    return tried


def _try(
    arguments: argparse.Namespace, opened: OpenScenario, method: Method, targets: Targets
) -> Trial | tables.MethodRow:
    judged = replace(targets, holdout=holdout_recorded(arguments, opened, method))
    try:
        return trial_of(arguments, opened, method, judged)
    except NotApplicableError as error:
        return tables.MethodRow(method.name, why_not=str(error))


def _rows(tried: Sequence[Trial | tables.MethodRow], bounds: Bounds) -> list[tables.MethodRow]:
    return [
        replace(tables.row_of(one), bound=bounds.bound(one.plan)) if isinstance(one, Trial) else one
        for one in tried
    ]


def _stored(
    arguments: argparse.Namespace, opened: OpenScenario, targets: Targets
) -> tuple[list[tables.MethodRow], Bounds]:
    """Return the row of the run whose run.json is the scenario, and the bound that it holds.

    There is none if an option makes another problem of it than the run's own.
    """
    folder = Path(arguments.scenario).parent
    if (
        Path(arguments.scenario).name != run_files.PROVENANCE
        or not (folder / run_files.PLAN).exists()
    ):
        return [], Bounds({})
    of_run, stored = run_files.open_run(folder)
    same = of_run.scenario.as_dict() == opened.scenario.as_dict()
    if not same or not run_files.is_planned_on(folder, targets.planning):
        return [], Bounds({})
    bounds = Bounds(stored_bound(folder / run_files.PLAN, stored.plan))
    planned, evaluated = (
        evaluate(stored.plan.tracks, some.futures, stored.sensor, stored.objective)
        for some in (targets.planning, targets.fresh)
    )
    row = tables.MethodRow(
        f"{folder.name}: {stored.plan.method}",
        planned,
        evaluated,
        sum(map(len, stored.plan.legs)),
        bound=bounds.bound(stored.plan),
    )
    return [row], bounds


def _computed(
    arguments: argparse.Namespace,
    opened: OpenScenario,
    targets: Targets,
    tried: Sequence[Trial | tables.MethodRow],
    known: Bounds,
) -> Bounds:
    """Return a bound for each kind of plans; one that is known already stays."""
    timed = arguments.time_limit is not None
    seconds, steps = (arguments.time_limit, UNCOUNTED) if timed else (math.inf, STEPS)
    futures, reasons = targets.planning.futures, list(known.reasons)
    with first_asks() as asked:
        limits = certify.Limits(0.0, steps, seconds, asked)

        def bound(plan: Plan) -> float | None:
            problem = certify.problem_of_plan(opened, plan, futures)
            try:
                return certificate_of(problem, plan, limits).bound
            except NotApplicableError as error:
                reasons.append(f"gap: {error}")
                return None

        trials = [one for one in tried if isinstance(one, Trial)]
        computed = bounds_of(trials, bound, known=known.of)
    return Bounds(computed, tuple(reasons))
