"""The work of `planner compare`: all methods on one scenario, side by side."""

import argparse
import math
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from planner.cli.arguments import permit_of
from planner.cli.printing import print_result
from planner.cli.progress import progress_bar
from planner.cli.session import (
    evaluation_recorded,
    holdout_recorded,
    opened_scenario,
    output_file,
    planning_recorded,
    tell_belief,
)
from planner.cli.trials import Bounding, attempt_of, certificate_of
from planner.detection.evaluate import evaluate
from planner.errors import NotApplicableError
from planner.flight.plan import Plan
from planner.futures.store import Recording
from planner.interrupts import first_interrupt_asks
from planner.mission import certify
from planner.mission.bounds import Bounds, bounds_of, stored_bound
from planner.mission.opening import OpenScenario
from planner.mission.run_folder import PLAN, PROVENANCE, is_planned_on, open_run
from planner.mission.trial import Trial
from planner.report import paired, real_flight, run_files, sentences, tables
from planner.search.methods import METHODS, Method, method_named


@dataclass(frozen=True, eq=False)
class _Targets:
    """What all methods plan with, and what their plans are evaluated on."""

    planning: Recording
    fresh: Recording


def compare_on_scenario(arguments: argparse.Namespace, overrides: Sequence[str]) -> int:
    """Compare all methods on the same futures and the same fresh targets."""
    with ExitStack() as stack:
        new, methods = output_file(stack, arguments), compared_methods(arguments)
        opened = opened_scenario(arguments, overrides)
        tell_belief(arguments)
        recording = planning_recorded(arguments, opened)
        targets = _Targets(recording, evaluation_recorded(arguments, opened))
        tried = _tried(arguments, opened, methods, targets)
        stored, bounds = _stored(arguments, opened, targets)
        if arguments.bound:
            bounds = _computed(arguments, opened, targets, tried, bounds)
        rows = [*_rows(tried, bounds), *stored]
        if new is not None:
            run_files.write_compare(new, rows)
    summary = {"methods": [run_files.compare_cells(row) for row in rows]}
    title = f"{opened.scenario.name}: {len(targets.fresh.futures):,} fresh targets"
    table = tables.compare_table(rows, title, in_town=not opened.network.is_abstract)
    written = [f"written to {arguments.output}"] if arguments.output else []
    lead = paired.against_patterns(rows)
    uav = opened.scenario.uav
    flown = [real_flight.aircraft_line(uav)] if uav.is_real else []
    blind = sentences.as_if_perfect({row.method: row.evaluated for row in rows if row.evaluated})
    hidden = sentences.hidden_line(opened.scenario.hidden)
    flees = sentences.flees_line(opened.scenario.targets)
    said = [
        table,
        *filter(None, [lead, blind, hidden, flees]),
        *sentences.reasons(rows),
        *bounds.reasons,
        *flown,
    ]
    said += written
    print_result(arguments, summary, said)
    return 0


def _tried(
    arguments: argparse.Namespace,
    opened: OpenScenario,
    methods: Sequence[Method],
    targets: _Targets,
) -> list[Trial | tables.MethodRow]:
    """Return the trial of each method, or the row that says why it cannot be used."""
    tried: list[Trial | tables.MethodRow] = []
    with progress_bar("methods") as progress:
        for done, method in enumerate(methods):
            progress(done, len(methods))
            tried.append(_try(arguments, opened, method, targets))
    return tried


def compared_methods(arguments: argparse.Namespace) -> list[Method]:
    """Return the methods of a comparison: the user's own ones first, so that they fail soon."""
    named = [method_named(name) for name in arguments.method]
    own = {method.name: method for method in named if method.own is not None}
    return [*own.values(), *METHODS]


def _try(
    arguments: argparse.Namespace, opened: OpenScenario, method: Method, targets: _Targets
) -> Trial | tables.MethodRow:
    holdout = holdout_recorded(arguments, opened, method)
    try:
        made = attempt_of(arguments, opened, method, targets.planning.futures, holdout=holdout)
        return made.met(targets.fresh.futures)
    except NotApplicableError as error:
        return tables.MethodRow(method.name, why_not=str(error))


def _rows(tried: Sequence[Trial | tables.MethodRow], bounds: Bounds) -> list[tables.MethodRow]:
    return [
        replace(tables.row_of(one), bound=bounds.bound(one.plan)) if isinstance(one, Trial) else one
        for one in tried
    ]


def _stored(
    arguments: argparse.Namespace, opened: OpenScenario, targets: _Targets
) -> tuple[list[tables.MethodRow], Bounds]:
    """Return the row of the run whose run.json is the scenario, and the bound that it holds.

    There is none if an option changes the problem that the run was planned for.
    """
    folder = Path(arguments.scenario).parent
    if Path(arguments.scenario).name != PROVENANCE or not (folder / PLAN).exists():
        return [], Bounds({})
    of_run, stored = open_run(folder, permit_of(arguments))
    same = of_run.scenario.as_dict() == opened.scenario.as_dict()
    if not same or not is_planned_on(folder, targets.planning):
        return [], Bounds({})
    problem = certify.problem_of_plan(opened, stored.plan, targets.planning.futures)
    bounds = Bounds(stored_bound(folder / PLAN, stored.plan, problem))
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
    targets: _Targets,
    tried: Sequence[Trial | tables.MethodRow],
    known: Bounds,
) -> Bounds:
    """Return a bound for each class of plans; a bound that is already known stays."""
    seconds = math.inf if arguments.time_limit is None else arguments.time_limit
    futures, reasons = targets.planning.futures, list(known.reasons)
    with first_interrupt_asks() as asked:
        bounding = Bounding(asked, seconds=seconds, workers=arguments.jobs)

        def bound(plan: Plan) -> float | None:
            problem = certify.problem_of_plan(opened, plan, futures)
            try:
                return certificate_of(problem, plan, bounding).bound
            except NotApplicableError as error:
                reasons.append(f"gap: {error}")
                return None

        trials = [one for one in tried if isinstance(one, Trial)]
        computed = bounds_of(trials, bound, known=known.of)
    return Bounds(computed, tuple(reasons))
