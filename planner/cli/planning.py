"""The work of `planner plan`: record, plan, certify if a gap is asked for, evaluate, write."""

import argparse
import math
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from planner.bounds.certificate import Certificate
from planner.cli.printing import print_result
from planner.cli.session import (
    evaluation_recorded,
    holdout_recorded,
    opened_scenario,
    output_folder,
    planning_recorded,
)
from planner.cli.trials import Bounding, Targets, certificate_of, trial_of
from planner.errors import InputError, NotApplicableError
from planner.files import write_json
from planner.flight.plan import Plan
from planner.futures.store import Recording
from planner.interrupts import first_interrupt_asks
from planner.mission import certificate_file, run_folder
from planner.mission.opening import OpenScenario
from planner.mission.own_futures import OwnFutures, read_split
from planner.mission.plan_file import plan_content
from planner.mission.recorder import budget_of, problem_of
from planner.mission.run_folder import OWN_BEGIN, OWN_FUTURES
from planner.mission.to_gap import TwoSided, planned_to_gap
from planner.mission.trial import Trial, try_order
from planner.provenance import provenance
from planner.report import run_files, sentences, tables
from planner.scenario.source import paths_in_record
from planner.search.methods import Method, method_named
from planner.search.problem import Problem
from planner.search.stop import AnyOf, Asked, Elapsed


@dataclass(frozen=True, eq=False)
class _Found:
    """The result of a search."""

    problem: Problem  # that the plan solves
    trial: Trial
    fresh: tables.Fresh  # what its targets for evaluation are
    certificate: Certificate | None = None
    no_bound: str = ""  # why there is no certificate, though it was asked for


def plan_and_write(arguments: argparse.Namespace, overrides: Sequence[str]) -> int:
    """Plan a search, evaluate it on fresh targets, and write the run."""
    method, watch = method_named(arguments.method), _Watch()
    with ExitStack() as stack:
        names = (*run_folder.RUN, *certificate_file.PROOF)
        folder = output_folder(stack, arguments, names)
        opened = opened_scenario(arguments, overrides)
        targets = _targets(arguments, opened, method)
        watch.lap("futures")
        found = _found(arguments, opened, method, targets)
        watch.lap("planning and evaluation")
        watch.took_s["planning"] = found.trial.took_s
        content = _plan_content(opened, found)
        if folder is not None:
            _write(folder, opened, found, content)
            watch.lap("files")
            record = _provenance(arguments, opened, content, targets.planning, watch)
            record["planning"] = _planning_record(found.trial)
            write_json(folder / run_folder.PROVENANCE, record)
    summary = {key: content[key] for key in ("method", "planned", "evaluated")}
    if arguments.gap is not None:
        summary["certificate"] = found.certificate and certificate_file.certificate_content(
            found.problem, found.certificate
        )
    summary["directory"] = arguments.output and str(arguments.output)
    print_result(arguments, summary, _blocks(arguments, opened, found))
    return 0


def _targets(arguments: argparse.Namespace, opened: OpenScenario, method: Method) -> Targets:
    """Return the targets to plan with, to choose between plans with, and to evaluate on."""
    if arguments.futures is None:
        planning = planning_recorded(arguments, opened)
        fresh = evaluation_recorded(arguments, opened)
        return Targets(planning, fresh, holdout_recorded(arguments, opened, method))
    if opened.scenario.greedy.particles == "anew":
        raise InputError(
            'greedy.particles: "anew" draws from the belief at every step, which --futures '
            'takes the place of; use "once"'
        )
    own = read_split(OwnFutures(arguments.futures, arguments.begin), opened)
    if own.kept_out is None:
        fresh = evaluation_recorded(arguments, opened)
        return Targets(own.planning, fresh, are=tables.OTHERS)
    return Targets(own.planning, own.kept_out, are=tables.KEPT_OUT)


def _found(
    arguments: argparse.Namespace, opened: OpenScenario, method: Method, targets: Targets
) -> _Found:
    """Return what the method finds; with --gap, the plan and the bound that come closest."""
    problem = problem_of(opened, targets.planning.futures, method=method)
    seconds = math.inf if arguments.time_limit is None else arguments.time_limit
    reasons: list[str] = []
    with first_interrupt_asks() if method.stops else nullcontext(bool) as asked:

        def planned(more: int, limit_s: float) -> Trial:
            budget, stop = budget_of(opened), AnyOf(Elapsed(limit_s), Asked(asked))
            budget = replace(budget, work=more * budget.work, stop=stop)
            return trial_of(arguments, opened, method, targets, budget)

        def bound(plan: Plan, limit_s: float) -> Certificate | None:
            try:
                with nullcontext(asked) if method.stops else first_interrupt_asks() as interrupted:
                    bounding = Bounding(interrupted, arguments.gap, limit_s)
                    return certificate_of(problem, plan, bounding)
            except NotApplicableError as error:
                reasons.append(str(error))
                return None

        if arguments.gap is None:
            return _Found(problem, planned(1, seconds), targets.are)

        def fly(order: Sequence[int], trial: Trial) -> Trial:
            return try_order(problem, order, targets.fresh.futures, trial)

        sides = TwoSided(planned, bound, fly, asked)
        trial, certificate = planned_to_gap(
            sides, arguments.gap, seconds=seconds, again=method.stops
        )
        return _Found(problem, trial, targets.are, certificate, *reasons[:1])


def _write(folder: Path, opened: OpenScenario, found: _Found, content: dict[str, Any]) -> None:
    problem, trial, certificate = found.problem, found.trial, found.certificate
    title = f"{opened.scenario.name}: {trial.method}"
    row = tables.row_of(trial)
    run_files.write_run(folder, problem, trial.plan, content, row, title=title)
    if certificate is not None:
        summary = certificate_file.certificate_content(problem, certificate)
        plan_file = folder / run_folder.PLAN
        certificate_file.write_certificate(folder, problem, certificate, plan_file, summary)


def _blocks(arguments: argparse.Namespace, opened: OpenScenario, found: _Found) -> Iterator[Any]:
    """Yield the tables and sentences to print."""
    trial, certificate = found.trial, found.certificate
    until_s = opened.scenario.search.horizon_s
    if trial.plan.follows_roads:
        yield tables.legs_table(trial.plan, opened.network, until_s)
    else:
        yield tables.waypoints_table(trial.plan, until_s)
    yield tables.plan_table(tables.row_of(trial), found.fresh)
    hint = sentences.particles_hint(trial.planned, trial.evaluated)
    same_belief = opened.scenario.truth == opened.scenario.target
    if hint and same_belief and not arguments.futures:
        yield hint
    if trial.result.stopped:
        yield "the search was stopped: this is the best plan so far"
    if arguments.futures is not None:
        yield sentences.own_futures_line(found.fresh, len(trial.evaluated.weight))
    if certificate is not None:
        yield sentences.certificate_line(certificate, found.problem.objective.by_s)
        if certificate.gap > arguments.gap:
            yield sentences.gap_line(arguments.gap)
    elif arguments.gap is not None:
        yield f"there is no certificate: {found.no_bound}"
    if arguments.output:
        yield f"written to {arguments.output}"
    else:
        yield "not saved; add -o DIR for plan.json, a picture, and what sumo-gui shows"


class _Watch:
    """Wall-clock time of the parts of a run."""

    def __init__(self) -> None:
        self.started = datetime.now(UTC)
        self.took_s: dict[str, float] = {}
        self._last_s = time.perf_counter()

    def lap(self, part: str) -> None:
        now_s = time.perf_counter()
        self.took_s[part] = now_s - self._last_s
        self._last_s = now_s


def _plan_content(opened: OpenScenario, found: _Found) -> dict[str, Any]:
    return plan_content(
        found.trial.plan,
        opened.network,
        sensor=found.problem.sensor,
        planned=found.trial.planned,
        evaluated=found.trial.evaluated,
        seed=opened.scenario.search.seed,
    )


def _planning_record(trial: Trial) -> dict[str, Any]:
    made = trial.result
    return {
        "work": trial.work_allowed,
        "work_done": made.work,
        "stopped_early": made.stopped,
        "trace": [list(point) for point in made.trace],  # work done, best value then
    }


def _provenance(
    arguments: argparse.Namespace,
    opened: OpenScenario,
    content: dict[str, Any],
    recording: Recording,
    watch: _Watch,
) -> dict[str, Any]:
    scenario = opened.scenario
    made_by = provenance(
        [Path(sys.argv[0]).name, *sys.argv[1:]],
        scenario.as_dict(),
        seed=scenario.search.seed,
        sha256=run_folder.hashes(opened, content, recording),
        started=watch.started,
        took_s=watch.took_s,
    )
    made_by |= opened.network.credit
    record = made_by | paths_in_record("scenario_path", scenario.path, arguments.output)
    if arguments.futures is None:
        return record
    own = paths_in_record(OWN_FUTURES, arguments.futures, arguments.output)
    return record | own | {OWN_BEGIN: arguments.begin}
