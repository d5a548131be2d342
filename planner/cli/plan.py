"""What `planner plan` does: record, plan, certify if a gap is asked for, evaluate, write."""

import argparse
import math
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from planner.bounds.certificate import STEPS, Certificate
from planner.cli.certify import UNCOUNTED, certificate_of
from planner.cli.session import (
    Targets,
    evaluation_recorded,
    holdout_recorded,
    opened_of,
    output,
    recorded,
    tell,
    trial_of,
)
from planner.detection.sensor import Sensor
from planner.errors import InputError, NotApplicableError
from planner.files import write_json
from planner.flight.plan import Plan
from planner.futures.store import Recording, read_recording
from planner.interrupts import first_asks
from planner.mission import certificate_file, certify
from planner.mission.opening import OpenScenario
from planner.mission.plan_file import plan_content
from planner.mission.recorder import Recorder, problem_of
from planner.mission.to_gap import Sides, planned_to_gap
from planner.mission.trial import Limits, Trial, try_order
from planner.provenance import provenance
from planner.report import run_files, tables
from planner.report import sentences as remarks
from planner.search.methods import Method, method_named
from planner.search.problem import Problem


@dataclass(frozen=True, eq=False)
class _Found:
    """What a search came to."""

    problem: Problem  # that the plan answers
    trial: Trial
    certificate: Certificate | None = None
    no_bound: str = ""  # why there is no certificate, though it was asked for


def plan(arguments: argparse.Namespace) -> int:
    """Plan a search, evaluate it on fresh targets, and write the run."""
    method, watch = method_named(arguments.method), _Watch()
    with ExitStack() as stack:
        folder = output(stack, arguments, (*run_files.RUN, *certificate_file.PROOF))
        opened = opened_of(arguments)
        recording = _planning_recording(arguments, opened)
        targets = Targets(
            recording,
            evaluation_recorded(arguments, opened),
            holdout_recorded(arguments, opened, method),
        )
        watch.lap("futures")
        found = _found(arguments, opened, method, targets)
        watch.lap("planning and evaluation")
        watch.took_s["planning"] = found.trial.took_s
        content = _plan_content(opened, found.trial)
        if folder is not None:
            _write(folder, opened, found, content)
            watch.lap("files")
            record = _provenance(opened, content, recording, watch)
            record["planning"] = _planning_record(found.trial)
            write_json(folder / run_files.PROVENANCE, record)
    told = {key: content[key] for key in ("method", "planned", "evaluated")}
    if arguments.gap is not None:
        told["certificate"] = found.certificate and certificate_file.certificate_content(
            found.problem, found.certificate
        )
    told["directory"] = arguments.output and str(arguments.output)
    tell(arguments, told, _shown(arguments, opened, found))
    return 0


def _found(
    arguments: argparse.Namespace, opened: OpenScenario, method: Method, targets: Targets
) -> _Found:
    """Return what the method finds; with a gap to reach, what both sides come to."""
    problem = problem_of(opened, targets.planning.futures, method=method)
    seconds = math.inf if arguments.time_limit is None else arguments.time_limit
    reasons: list[str] = []
    with first_asks() if method.stops else nullcontext(bool) as asked:

        def planned(more: int, limit_s: float) -> Trial:
            limits = Limits(limit_s, asked, more=more)
            return trial_of(arguments, opened, method, targets, limits)

        def bound(plan: Plan, limit_s: float) -> Certificate | None:
            steps = STEPS if math.isinf(limit_s) else UNCOUNTED
            try:
                with nullcontext(asked) if method.stops else first_asks() as heard:
                    limits = certify.Limits(arguments.gap, steps, limit_s, heard)
                    return certificate_of(problem, plan, limits)
            except NotApplicableError as error:
                reasons.append(str(error))
                return None

        if arguments.gap is None:
            return _Found(problem, planned(1, seconds))

        def fly(order: Sequence[int], trial: Trial) -> Trial:
            return try_order(problem, order, targets.fresh.futures, trial)

        sides = Sides(planned, bound, fly, asked)
        trial, certificate = planned_to_gap(
            sides, arguments.gap, seconds=seconds, again=method.stops
        )
        return _Found(problem, trial, certificate, *reasons[:1])


def _write(folder: Path, opened: OpenScenario, found: _Found, content: dict[str, Any]) -> None:
    problem, trial, certificate = found.problem, found.trial, found.certificate
    title = f"{opened.scenario.name}: {trial.method}"
    row = tables.row_of(trial)
    run_files.write_run(folder, problem, trial.plan, content, row, title=title)
    if certificate is not None:
        told = certificate_file.certificate_content(problem, certificate)
        plan_file = folder / run_files.PLAN
        certificate_file.write_certificate(folder, problem, certificate, plan_file, told)


def _shown(arguments: argparse.Namespace, opened: OpenScenario, found: _Found) -> list[Any]:
    trial, certificate = found.trial, found.certificate
    shown: list[Any] = [
        tables.plan_table(tables.row_of(trial)),
        tables.legs_table(trial.plan, opened.network),
    ]
    hint = remarks.particles_hint(trial.planned, trial.evaluated)
    same_belief = opened.scenario.truth == opened.scenario.target
    shown += [hint] if hint and same_belief and not arguments.futures else []
    if trial.stopped:
        shown.append("the search was stopped: this is the best plan so far")
    if arguments.futures is not None:
        shown.append("the fresh targets are drawn from the scenario's belief, not from --futures")
    if certificate is not None:
        shown.append(remarks.certificate_line(certificate, found.problem.objective.by_s))
        if certificate.gap > arguments.gap:
            shown.append(remarks.gap_line(arguments.gap))
    elif arguments.gap is not None:
        shown.append(f"there is no certificate: {found.no_bound}")
    return shown + ([f"written to {arguments.output}"] if arguments.output else [])


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


def _planning_recording(arguments: argparse.Namespace, opened: OpenScenario) -> Recording:
    if arguments.futures is not None:
        if opened.scenario.greedy.particles == "anew":
            raise InputError(
                'greedy.particles: "anew" draws from the belief at every step, which --futures '
                'takes the place of; use "once"'
            )
        return read_recording(arguments.futures, opened.network)
    return recorded(arguments, opened, "recording futures", Recorder.planning)


def _plan_content(opened: OpenScenario, trial: Trial) -> dict[str, Any]:
    scenario = opened.scenario
    return plan_content(
        trial.plan,
        opened.network,
        sensor=Sensor(scenario.sensor.radius_m, scenario.sensor.detects_in_transit),
        planned=trial.planned,
        evaluated=trial.evaluated,
        seed=scenario.search.seed,
    )


def _planning_record(trial: Trial) -> dict[str, Any]:
    return {"work": trial.allowed, "work_done": trial.work, "stopped_early": trial.stopped}


def _provenance(
    opened: OpenScenario, content: dict[str, Any], recording: Recording, watch: _Watch
) -> dict[str, Any]:
    scenario = opened.scenario
    made_by = provenance(
        [Path(sys.argv[0]).name, *sys.argv[1:]],
        scenario.as_dict(),
        seed=scenario.search.seed,
        sha256=run_files.hashes(opened, content, recording),
        started=watch.started,
        took_s=watch.took_s,
    )
    return made_by | {"scenario_path": str(scenario.path.resolve())}
