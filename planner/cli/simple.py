"""What the plain commands of the command line do: open, work, write, print."""

import argparse
import shutil
from contextlib import ExitStack
from typing import Any

from planner.cli.session import lines, opened_of, output, output_file, recorded, tell
from planner.errors import InputError
from planner.futures.store import KNOTS, PARTICLES, Recording
from planner.mission.fly import fly as fly_plan
from planner.mission.opening import OpenScenario
from planner.mission.recorder import Recorder
from planner.report import run_files, tables


def build(arguments: argparse.Namespace) -> int:
    """Build the network and tell what it is."""
    with ExitStack() as stack:
        path = output_file(stack, arguments, force=arguments.force)
        network = opened_of(arguments).network
        if path is not None:
            shutil.copyfile(network.path, path)
    told = {
        "net": str(arguments.output or network.path),
        "sha256": network.sha256,
        "nodes": len(network.node_ids),
        "roads": len(network.road_ids),
        "length_km": float(network.road_length_m.sum()) / 1000,
    }
    tell(arguments, told, lines(told))
    return 0


def futures(arguments: argparse.Namespace) -> int:
    """Record the particles' futures and tell what they are."""
    with ExitStack() as stack:
        folder = output(stack, arguments, (KNOTS, PARTICLES))
        recording = recorded(
            arguments, opened_of(arguments), "recording futures", Recorder.planning
        )
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
    tell(arguments, told, lines(told))
    return 0


def where(arguments: argparse.Namespace) -> int:
    """Tell where the target may be at a time."""
    from planner.futures.state_at import by_road, state_at

    with ExitStack() as stack:
        folder = output(stack, arguments, run_files.WHERE)
        opened = opened_of(arguments)
        _refuse_time(arguments.at, opened)
        recording = recorded(arguments, opened, "recording futures", Recorder.planning)
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
    tell(arguments, told, [table])
    return 0


def _refuse_time(time_s: float, opened: OpenScenario) -> None:
    horizon_s = opened.scenario.search.horizon_s
    if not 0 <= time_s <= horizon_s:
        raise InputError(
            f"--at {time_s:g}: futures are recorded from 0 to {horizon_s:g} s; choose "
            "a time in between, or a later search.horizon_s"
        )


def fly(arguments: argparse.Namespace) -> int:
    """Fly a plan against true targets and write what happened to each."""
    arguments.output = arguments.directory
    opened, stored = run_files.open_run(arguments.directory)
    with ExitStack() as stack:
        folder = output(stack, arguments, (run_files.FLIGHTS,))
        assert folder is not None
        recording = _truths(arguments, opened)
        record = fly_plan(
            stored.plan,
            recording.futures,
            stored.sensor,
            stored.objective,
        )
        run_files.write_flights(folder / run_files.FLIGHTS, recording, record)
    path = arguments.directory / run_files.FLIGHTS
    told = run_files.flight_figures(record) | {"flights": str(path)}
    shown: list[Any] = [tables.flights_table(record.evaluation), f"written to {path}"]
    if arguments.route is not None:
        shown[0] = run_files.mission_line(record)
        told["found"] = bool(record.evaluation.found[0])
    tell(arguments, told, shown)
    return 0


def doctor(arguments: argparse.Namespace) -> int:
    """Examine the installation; 1 if something has to be mended."""
    from planner.report.doctor import examine

    findings = examine()
    told = {"findings": [vars(finding) for finding in findings]}
    tell(arguments, told, [tables.doctor_table(findings)])
    return 0 if all(finding.fine for finding in findings) else 1


def _truths(arguments: argparse.Namespace, opened: OpenScenario) -> Recording:
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

    return recorded(arguments, opened, "recording true targets", record)
