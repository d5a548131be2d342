"""What each command of the command line does: open, work, write, print."""

import argparse
import logging
import math
import shutil
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack, nullcontext
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from planner.belief.opening import Opened, open_scenario
from planner.cli import print_json
from planner.detection.track import Sensor
from planner.errors import InputError, NotApplicableError, OutputError
from planner.files import results_written_whole, written_whole
from planner.futures.futures import Futures
from planner.futures.store import KNOTS, PARTICLES, Recording, read_recording
from planner.mission.fly import fly as fly_plan
from planner.mission.plan_file import StoredPlan, plan_content
from planner.mission.preparation import Recorder, problem_of
from planner.mission.trial import Limits, Trial, try_method
from planner.provenance import provenance
from planner.report import run_files, tables
from planner.report.progress import progress
from planner.search.certificate import Certificate
from planner.search.methods import METHODS, Method, method_named
from planner.search.problem import Problem
from planner.stopping import first_asks

log = logging.getLogger(__name__)


def build(arguments: argparse.Namespace) -> int:
    """Build the network and tell what it is."""
    with ExitStack() as stack:
        path = _output_file(stack, arguments, force=True)
        network = _open(arguments).network
        if path is not None:
            shutil.copyfile(network.path, path)
    told = {
        "net": str(arguments.output or network.path),
        "sha256": network.sha256,
        "nodes": len(network.node_ids),
        "roads": len(network.road_ids),
        "length_km": float(network.road_length_m.sum()) / 1000,
    }
    _tell(arguments, told, _lines(told))
    return 0


def futures(arguments: argparse.Namespace) -> int:
    """Record the particles' futures and tell what they are."""
    with ExitStack() as stack:
        folder = _output(stack, arguments, (KNOTS, PARTICLES))
        recording = _recording(arguments, _open(arguments), "recording futures", Recorder.planning)
        path = recording.path
        if folder is not None:
            for name in (KNOTS, PARTICLES):
                shutil.copyfile(path.with_name(name), folder / name)
            path = arguments.output / KNOTS
    told = {
        "futures": str(path),
        "particles": len(recording.futures),
        "knots": len(recording.futures.time_s),
        "first_end_s": float(recording.futures.end_s.min()),
        "last_end_s": float(recording.futures.end_s.max()),
    }
    _tell(arguments, told, _lines(told))
    return 0


def where(arguments: argparse.Namespace) -> int:
    """Tell where the target may be at a time."""
    from planner.futures.state_at import by_road, state_at

    with ExitStack() as stack:
        folder = _output(stack, arguments, run_files.WHERE)
        opened = _open(arguments)
        _refuse_time(arguments.at, opened)
        recording = _recording(arguments, opened, "recording futures", Recorder.planning)
        state = state_at(recording.futures, opened.network, arguments.at)
        roads = by_road(state, opened.network)
        if folder is not None:
            run_files.write_where(folder, opened, state, roads)
    elsewhere = state.elsewhere_probability
    told = {
        "time_s": arguments.at,
        "elsewhere_probability": elsewhere,
        "roads": [vars(road) for road in roads],
    }
    table = tables.where_table(roads, time_s=arguments.at, elsewhere_probability=elsewhere)
    _tell(arguments, told, [table])
    return 0


def _refuse_time(time_s: float, opened: Opened) -> None:
    horizon_s = opened.scenario.search.horizon_s
    if not 0 <= time_s <= horizon_s:
        raise InputError(
            f"--at {time_s:g}: futures are recorded from 0 to {horizon_s:g} s; choose "
            "a time in between, or a later search.horizon_s"
        )


def plan(arguments: argparse.Namespace) -> int:
    """Plan a search, evaluate it on fresh targets, and write the run."""
    method, watch = method_named(arguments.method), _Watch()
    with ExitStack() as stack:
        folder = _output(stack, arguments, run_files.RUN)
        opened = _open(arguments)
        recording = _planning_recording(arguments, opened)
        fresh = _evaluation_recording(arguments, opened)
        watch.lap("futures")
        trial = _trial(arguments, opened, method, recording, fresh)
        watch.lap("planning and evaluation")
        watch.took_s["planning"] = trial.took_s
        row, content = tables.row_of(trial), _plan_content(opened, trial)
        if folder is not None:
            problem = problem_of(opened, recording.futures, method=method)
            title = f"{opened.scenario.name}: {method.name}"
            run_files.write_run(folder, problem, trial.plan, content, row, title=title)
            watch.lap("files")
            record = _provenance(opened, content, recording, watch)
            record["planning"] = _planning_record(opened, trial)
            run_files.write_json(folder / run_files.PROVENANCE, record)
    shown: list[Any] = [tables.plan_table(row), tables.legs_table(trial.plan, opened.network)]
    hint = tables.particles_hint(trial.planned, trial.evaluated)
    same_belief = opened.scenario.truth == opened.scenario.target
    shown += [hint] if hint and same_belief and not arguments.futures else []
    if trial.stopped:
        shown.append("the search was stopped: this is the best plan so far")
    if arguments.futures is not None:
        shown.append("the fresh targets are drawn from the scenario's belief, not from --futures")
    shown += [f"written to {arguments.output}"] if arguments.output else []
    told = {key: content[key] for key in ("method", "planned", "evaluated")}
    told["directory"] = arguments.output and str(arguments.output)
    _tell(arguments, told, shown)
    return 0


def fly(arguments: argparse.Namespace) -> int:
    """Fly a plan against true targets and write what happened to each."""
    arguments.output = arguments.directory
    opened, stored = run_files.open_run(arguments.directory)
    with ExitStack() as stack:
        folder = _output(stack, arguments, (run_files.FLIGHTS,))
        assert folder is not None
        recording = _truths(arguments, opened)
        record = fly_plan(
            stored.plan,
            recording.futures,
            stored.sensor,
            horizon_s=stored.horizon_s,
            by_s=stored.by_s,
        )
        run_files.write_flights(folder / run_files.FLIGHTS, recording, record)
    path = arguments.directory / run_files.FLIGHTS
    told = run_files.flight_figures(record) | {"flights": str(path)}
    shown: list[Any] = [tables.flights_table(record.evaluation), f"written to {path}"]
    if arguments.route is not None:
        shown[0] = run_files.mission_line(record)
        told["found"] = bool(record.evaluation.found[0])
    _tell(arguments, told, shown)
    return 0


def certify(arguments: argparse.Namespace) -> int:
    """Bound how much better than a run's plan any plan can be, and write the proof beside it."""
    from planner.mission import certificate_file as files
    from planner.mission.certify import problem_of_run

    arguments.output = arguments.directory
    opened, stored = run_files.open_run(arguments.directory)
    if arguments.sets is not None and arguments.sets < 2:
        raise InputError(f"--sets {arguments.sets}: tells nothing of chance; give 10 or more")
    with ExitStack() as stack:
        folder = _output(stack, arguments, (files.PRICES, files.KNOTS, files.NET))
        assert folder is not None
        recording = _recording(arguments, opened, "recording futures", Recorder.planning)
        run_files.same_futures(arguments.directory, recording)
        problem = problem_of_run(opened, stored, recording.futures)
        certificate, limit = _certificate(arguments, opened, stored, problem)
        told = files.certificate_content(problem, certificate)
        if limit is not None:
            told |= {"true_optimum_limit": limit, "sets": arguments.sets}
        plan_file = arguments.directory / run_files.PLAN
        files.write_certificate(folder, problem, certificate, plan_file, told)
    shown = [tables.certificate_line(certificate, problem.by_s)]
    if limit is not None:
        shown.append(tables.limit_line(limit, arguments.sets, problem.by_s))
    _tell(arguments, told, [*shown, f"written to {arguments.directory}"])
    return 0


def _certificate(
    arguments: argparse.Namespace, opened: Opened, stored: StoredPlan, problem: Problem
) -> tuple[Certificate, float | None]:
    """Return the certificate, and the limit of the true optimum if other sets are asked for."""
    from planner.mission import certify as mission

    seconds = math.inf if arguments.time_limit is None else arguments.time_limit
    with first_asks() as asked:
        limits = mission.Limits(arguments.gap, arguments.work, seconds, asked)
        with progress("certifying") as shown:

            def told(step: int, value: float, bound: float, gap: float) -> None:
                note = f"value {value:,.6g}, bound {bound:,.6g}, gap {gap:.1%}"
                shown(step, arguments.work, note)

            certificate = mission.certify(problem, stored, limits, told)
        if arguments.sets is None:
            return certificate, None
        with progress("other sets") as shown:
            recorder = Recorder(opened, arguments.jobs)
            bounds = mission.bounds_of_sets(
                recorder, stored, limits, arguments.sets, lambda n: shown(n, arguments.sets)
            )
    enough = len(bounds) == arguments.sets and len(bounds) > 1
    return certificate, mission.limit_of(bounds, problem.by_s) if enough else None


def compare(arguments: argparse.Namespace) -> int:
    """Compare all methods on the same futures and the same fresh targets."""
    if arguments.instances:
        from planner.commands_instances import compare_instances

        return compare_instances(arguments)
    if arguments.scenario is None:
        raise InputError("compare: names no scenario; give one, or --instances")
    with ExitStack() as stack:
        path = _output_file(stack, arguments, force=arguments.force)
        opened = _open(arguments)
        recording = _recording(arguments, opened, "recording futures", Recorder.planning)
        fresh = _evaluation_recording(arguments, opened)
        rows = []
        with progress("methods") as told_progress:
            for done, method in enumerate(METHODS):
                told_progress(done, len(METHODS))
                rows.append(_row(arguments, opened, method, recording, fresh))
        if path is not None:
            run_files.write_compare(path, rows)
    told = [run_files.compare_cells(row) for row in rows]
    title = f"{opened.scenario.name}: {len(fresh.futures):,} fresh targets"
    shown: list[Any] = [tables.compare_table(rows, title), *tables.reasons(rows)]
    _tell(arguments, {"methods": told}, shown)
    return 0


def doctor(arguments: argparse.Namespace) -> int:
    """Examine the installation; 1 if something has to be mended."""
    from planner.report.doctor import examine

    findings = examine()
    told = {"findings": [vars(finding) for finding in findings]}
    _tell(arguments, told, [tables.doctor_table(findings)])
    return 0 if all(finding.fine for finding in findings) else 1


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


def _open(arguments: argparse.Namespace) -> Opened:
    overrides = list(arguments.set)
    if arguments.seed is not None:
        overrides.append(f"search.seed={arguments.seed}")
    overrides += _objective_overrides(arguments)
    if getattr(arguments, "free", False):
        if arguments.method != "best":
            raise InputError(f"--free: goes with --method best, not with {arguments.method}")
        overrides.append("search.free=true")
    if getattr(arguments, "tick", None) is not None:
        if arguments.method != "greedy":
            raise InputError(f"--tick {arguments.tick:g}: goes with --method greedy only")
        overrides.append(f"greedy.tick_s={arguments.tick}")
    if arguments.net_file is not None:
        net = str(arguments.net_file.resolve())
        overrides.append(f"network={{ net = {_toml_text(net)} }}")
    return open_scenario(arguments.scenario, preset=arguments.preset, overrides=overrides)


def _objective_overrides(arguments: argparse.Namespace) -> list[str]:
    objective, by_s = getattr(arguments, "objective", None), getattr(arguments, "by", None)
    if by_s is not None and objective != "probability":
        raise InputError(
            f"--by {by_s:g}: goes with --objective probability; give both, or leave it out"
        )
    named = {"search.objective": objective and _toml_text(objective), "search.by_s": by_s}
    return [f"{key}={value}" for key, value in named.items() if value is not None]


def _toml_text(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _output(stack: ExitStack, arguments: argparse.Namespace, names: Iterable[str]) -> Path | None:
    """Return a folder for new files, which move to the output when the stack closes."""
    if arguments.output is None:
        return None
    whole = results_written_whole(arguments.output, tuple(names), force=arguments.force)
    return stack.enter_context(whole)


def _output_file(stack: ExitStack, arguments: argparse.Namespace, *, force: bool) -> Path | None:
    """Return a file that takes the place of the output when the stack closes."""
    path: Path | None = arguments.output
    if path is None:
        return None
    if path.exists() and not force:
        raise OutputError(f"{path}: is there already; name another file, or --force to replace it")
    return stack.enter_context(written_whole(path))


def _recording(
    arguments: argparse.Namespace,
    opened: Opened,
    what: str,
    record: Callable[[Recorder], Recording],
) -> Recording:
    with progress(what) as told:
        return record(Recorder(opened, arguments.jobs, told))


def _planning_recording(arguments: argparse.Namespace, opened: Opened) -> Recording:
    if arguments.futures is not None:
        if opened.scenario.greedy.particles == "anew":
            raise InputError(
                'greedy.particles: "anew" draws from the belief at every step, which --futures '
                'takes the place of; use "once"'
            )
        return read_recording(arguments.futures, opened.network)
    return _recording(arguments, opened, "recording futures", Recorder.planning)


def _evaluation_recording(arguments: argparse.Namespace, opened: Opened) -> Recording:
    def record(recorder: Recorder) -> Recording:
        return recorder.evaluation(arguments.targets)

    return _recording(arguments, opened, "recording fresh targets", record)


def _truths(arguments: argparse.Namespace, opened: Opened) -> Recording:
    route, speed_mps, offset_m = arguments.route, arguments.target_speed, arguments.target_offset
    if (route is None) != (speed_mps is None) or (route is None and offset_m is not None):
        raise InputError(
            "--route: goes with --target-speed, and --target-offset with both; "
            "give a route and a speed, or none of the three"
        )
    seed = opened.scenario.search.seed if arguments.seed is None else arguments.seed

    def record(recorder: Recorder) -> Recording:
        if route is None:
            return recorder.truths(arguments.targets, seed=seed)
        return recorder.predefined(
            route.split(), speed_mps=speed_mps, offset_m=offset_m or 0.0, seed=seed
        )

    return _recording(arguments, opened, "recording true targets", record)


def _judges(arguments: argparse.Namespace, opened: Opened, method: Method) -> Futures | None:
    """Return other particles for a method that chooses between plans, if they can be drawn.

    Where all futures are enumerated there are no others.
    """
    enumerated = opened.scenario.search.sampling == "all"
    if not method.chooses or enumerated or getattr(arguments, "futures", None) is not None:
        return None
    return _recording(arguments, opened, "recording judges", Recorder.judging).futures


def _trial(
    arguments: argparse.Namespace,
    opened: Opened,
    method: Method,
    recording: Recording,
    fresh: Recording,
) -> Trial:
    judges, work = _judges(arguments, opened, method), opened.scenario.search.work
    limit_s = getattr(arguments, "time_limit", None)
    timed = opened.scenario.search.objective == "time"
    asking = (
        first_asks() if method.stops and hasattr(arguments, "time_limit") else nullcontext(bool)
    )
    with progress(f"planning: {method.name}") as shown, asking as asked:

        def told(value: float, done: int) -> None:
            best = f"{value:,.0f} s" if timed else f"{value:.1%} found"
            log.info("best so far %s after %d units of work", best, done)
            shown(min(done, work), work, best)

        limits = Limits(math.inf if limit_s is None else limit_s, asked, told)
        recorder = Recorder(opened, arguments.jobs)
        return try_method(
            method, recorder, recording.futures, fresh.futures, judges=judges, limits=limits
        )


def _plan_content(opened: Opened, trial: Trial) -> dict[str, Any]:
    scenario = opened.scenario
    return plan_content(
        trial.plan,
        opened.network,
        sensor=Sensor(scenario.sensor.radius_m, scenario.sensor.detects_in_transit),
        planned=trial.planned,
        evaluated=trial.evaluated,
        seed=scenario.search.seed,
    )


def _planning_record(opened: Opened, trial: Trial) -> dict[str, Any]:
    return {
        "work": opened.scenario.search.work,
        "work_done": trial.work,
        "stopped_early": trial.stopped,
    }


def _row(
    arguments: argparse.Namespace,
    opened: Opened,
    method: Method,
    recording: Recording,
    fresh: Recording,
) -> tables.MethodRow:
    try:
        return tables.row_of(_trial(arguments, opened, method, recording, fresh))
    except NotApplicableError as error:
        return tables.MethodRow(method.name, why_not=str(error))


def _provenance(
    opened: Opened, content: dict[str, Any], recording: Recording, watch: _Watch
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


def _lines(told: dict[str, Any]) -> list[str]:
    width = max(map(len, told))
    return [f"{key:{width}}  {value}" for key, value in told.items()]


def _tell(arguments: argparse.Namespace, told: dict[str, Any], shown: Sequence[Any]) -> None:
    if arguments.json:
        print_json(told)
        return
    out = tables.console()
    for thing in shown:
        out.print(thing)
