"""`planner fly`: a stored plan meets true targets."""

import argparse
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING, Any

from planner.cli.arguments import (
    add_jobs,
    add_origin,
    add_run,
    count,
    metres,
    moment,
    path,
    permit_of,
    seed,
    span,
)
from planner.cli.printing import print_result
from planner.errors import InputError

if TYPE_CHECKING:
    from planner.futures.store import Recording
    from planner.mission.fly import MissionRecord
    from planner.mission.opening import OpenScenario
    from planner.mission.recorder import Recorder

SUMMARY = "fly a plan against true targets"
DETAILS = """\
Writes flights.csv to the run's folder. With --track it is the flight that was
recorded: what it was worth beside its plan, on the same targets, and where the
target can still be, if it was not seen; files are then written with -o only.
With --live it is flown now, and planned anew whenever news comes in."""
EXAMPLES = (
    ("fly runs/first --targets 1000", "when is each one found?"),
    ('fly runs/first --route "r0c0-r0c1 r0c1-r0c2" --target-speed 20', ""),
    ("fly runs/town --track flown.gpx", "what was flown; where is it still?"),
    ("fly runs/town --track flown.csv --takes-off-at 0:02:00 -o out", ""),
)
TARGETS = 1000
LOOKALIKES = 0.0  # a rate that nobody can give: alarms are cars that look like the target


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner fly`."""
    add_run(parser)
    parser.add_argument(
        "--targets",
        type=count,
        metavar="N",
        help=f"number of fresh targets to fly against (default: {TARGETS}; with --track those that "
        "the plan was evaluated on)",
    )
    parser.add_argument(
        "--route",
        metavar="EDGES",
        help='fly against one target with this route, e.g. "r0c0-r0c1 r0c1-r1c1 ..."',
    )
    parser.add_argument(
        "--target-speed", type=float, metavar="MPS", help="with --route: its speed in m/s"
    )
    parser.add_argument(
        "--target-offset",
        type=float,
        metavar="M",
        help="with --route: where it starts, in metres along the first edge (default: 0)",
    )
    parser.add_argument(
        "-s",
        "--seed",
        type=seed,
        help="seed of the true targets (default: the run's; with --track it takes others than the "
        "plan was evaluated on)",
    )
    _add_track(parser)
    _add_live(parser)
    _add_alarms(parser)
    add_jobs(parser)
    parser.add_argument("--force", action="store_true", help="overwrite the files")


def _add_live(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--live",
        type=path,
        metavar="FILE",
        help="read news as it is appended to FILE, a line of JSON each, plan anew, and append what "
        "is to be flown to live.jsonl in the run's folder, or to -o FILE",
    )
    parser.add_argument(
        "--auto",
        action="store_true",
        help="with --live: fly new plans that pass all checks, without a person's yes",
    )


def _add_alarms(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--alarms",
        nargs="?",
        const=LOOKALIKES,
        type=_per_second,
        metavar="1/600",
        help="with so many false alarms a second of search: the plan flown late, and planned anew; "
        "without a rate, in traffic, alarms are cars that look like it (sensor.lookalike)",
    )
    parser.add_argument(
        "--alarm-s",
        type=span,
        metavar="S",
        help="with --alarms: how long it takes to dismiss one (default: 120, or sensor.check_s)",
    )
    parser.add_argument(
        "--sequences",
        type=count,
        metavar="N",
        help="with --alarms: how many flights (default: 16)",
    )


def _per_second(text: str) -> float:
    """Return how often something happens, written as 1/600 or 0.002."""
    many, _, seconds = text.partition("/")
    try:
        rate = float(many) / float(seconds or 1.0)
    except (ValueError, ZeroDivisionError):
        rate = 0.0
    if not 0.0 < rate <= 1.0:
        raise argparse.ArgumentTypeError(f"should be a rate, as 1/600 a second, not {text!r}")
    return rate


def _add_track(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--track",
        type=path,
        metavar="FILE",
        help="a flight that was recorded: GPX, CSV, SUMO's FCD, or an autopilot's .tlog or .bin "
        "(these two with pymavlink)",
    )
    parser.add_argument(
        "--takes-off-at",
        type=moment,
        metavar="TIME",
        help="with --track: when it took off, in seconds or H:M:S after the target was last seen "
        "(default: by its times of day and target.sighted_at, or its own seconds)",
    )
    parser.add_argument(
        "--sensor-from",
        type=metres,
        metavar="M",
        help="with --track: from which height above its lowest point the sensor counts (default: "
        "nearly uav.altitude_m)",
    )
    parser.add_argument(
        "--break-after",
        type=span,
        metavar="S",
        help="with --track: between points farther apart in time nothing counts as seen "
        "(default: 10)",
    )
    parser.add_argument(
        "--at",
        type=moment,
        metavar="TIME",
        help="with --track: when it can still be where (default: at the flight's end)",
    )
    parser.add_argument(
        "--aircraft",
        type=path,
        metavar="FILE",
        help="with --track: the aircraft that flew it, as `export` takes it (default: the "
        "scenario's)",
    )
    add_origin(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=path,
        metavar="DIR",
        help="with --track: write flights.csv, where.csv and where.png to DIR; with --live, a FILE",
    )


def run(arguments: argparse.Namespace) -> int:
    """Fly a plan against true targets and write what happened to each."""
    _check_route(arguments)
    if arguments.track is not None:
        return _debriefed(arguments)
    if arguments.live is not None:
        from planner.cli.live import fly_live

        return fly_live(arguments)
    if arguments.alarms is not None:
        from planner.cli.alarmed import fly_alarmed

        return fly_alarmed(arguments)
    _refuse_what_goes_with_others(arguments)
    return _fly(arguments)


def _fly(arguments: argparse.Namespace) -> int:
    """Fly a plan against targets that SUMO drives."""
    from planner.cli.session import Drive, new_files, recorded
    from planner.mission.fly import fly
    from planner.mission.run_folder import FLIGHTS, open_run, refuse_no_run
    from planner.mission.several import refuse_several
    from planner.report.run_files import write_flights

    refuse_no_run(arguments.directory)
    with ExitStack() as stack:
        folder = new_files(stack, arguments.directory, (FLIGHTS,), force=arguments.force)
        # No other command replaces it now.
        opened, stored = open_run(arguments.directory, permit_of(arguments))
        if arguments.route is not None:
            refuse_several(opened, "--route")
        seed = opened.scenario.search.seed if arguments.seed is None else arguments.seed
        record = partial(_true_targets, arguments=arguments, seed=seed)
        drive = Drive.of_truth("recording true targets", opened)
        recording = recorded(arguments, opened, drive, record)
        flown = fly(stored.plan, recording.futures, stored.sensor, stored.objective)
        write_flights(folder / FLIGHTS, recording, flown, opened.scenario.target_names)
    _print_flown(arguments, opened, recording, flown)
    return 0


def _print_flown(
    arguments: argparse.Namespace,
    opened: "OpenScenario",
    recording: "Recording",
    flown: "MissionRecord",
) -> None:
    """Print what happened to each target, or to all of them."""
    from planner.mission.run_folder import FLIGHTS, OTHER_TARGETS, own_futures
    from planner.report import run_files, tables

    written = arguments.directory / FLIGHTS
    summary = run_files.flight_figures(flown) | {"flights": str(written)}
    note = [] if own_futures(arguments.directory) is None else [OTHER_TARGETS]
    in_town, names = not opened.network.is_abstract, opened.scenario.target_names
    first: list[Any] = [tables.flights_table(flown.evaluation, in_town=in_town)]
    if arguments.route is not None:
        first = [run_files.mission_line(flown, in_town=in_town)]
        summary["found"] = bool(flown.evaluation.found[0])
    elif flown.evaluation.objective.sought > 1:
        told = run_files.several_blocks(flown, recording.futures, names, in_town=in_town)
        first = [*told] if len(recording.futures) <= len(names) else [*first, *told]
    print_result(arguments, summary, [*first, *note, f"written to {written}"])


def _debriefed(arguments: argparse.Namespace) -> int:
    from planner.cli.debriefing import debriefed

    if arguments.route is not None:
        raise InputError("--track: is held against many targets; leave --route out")
    return debriefed(arguments)


def _refuse_what_goes_with_others(arguments: argparse.Namespace) -> None:
    """Refuse options of the other ways to fly."""
    if arguments.alarm_s is not None or arguments.sequences is not None:
        raise InputError("--alarm-s, --sequences: go with --alarms; give it, or neither of them")
    if arguments.auto:
        raise InputError("--auto: goes with --live; give both, or leave it out")
    for name in (
        "takes_off_at",
        "sensor_from",
        "break_after",
        "at",
        "aircraft",
        "origin",
        "output",
    ):
        if getattr(arguments, name) is not None:
            raise InputError(f"--{name.replace('_', '-')}: goes with --track; give both, or none")


def _check_route(arguments: argparse.Namespace) -> None:
    route, speed_mps, offset_m = arguments.route, arguments.target_speed, arguments.target_offset
    if (route is None) != (speed_mps is None) or (route is None and offset_m is not None):
        raise InputError(
            "--route: goes with --target-speed, and --target-offset with both; "
            "give a route and a speed, or none of the three"
        )


def _true_targets(recorder: "Recorder", *, arguments: argparse.Namespace, seed: int) -> "Recording":
    if arguments.route is None:
        return recorder.truths(arguments.targets or TARGETS, seed=seed)
    return recorder.predefined(
        arguments.route.split(),
        speed_mps=arguments.target_speed,
        offset_m=arguments.target_offset or 0.0,
        seed=seed,
    )
