"""`planner fly`: a stored plan meets true targets."""

import argparse
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING, Any

from planner.cli.arguments import add_jobs, add_run, add_targets, seed
from planner.cli.printing import print_result
from planner.errors import InputError

if TYPE_CHECKING:
    from planner.futures.store import Recording
    from planner.mission.recorder import Recorder

SUMMARY = "fly a plan against true targets"
DETAILS = "Writes flights.csv to the run's folder."
EXAMPLES = (
    ("fly runs/first --targets 1000", "when is each one found?"),
    ('fly runs/first --route "r0c0-r0c1 r0c1-r0c2" --target-speed 20', ""),
)
OTHER_TARGETS = (
    "these targets are drawn from the scenario's belief; the plan was made on --futures, "
    "which may differ"
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner fly`."""
    add_run(parser)
    add_targets(parser, default=1000)
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
        "-s", "--seed", type=seed, help="seed of the true targets (default: the run's)"
    )
    add_jobs(parser)
    parser.add_argument("--force", action="store_true", help="overwrite flights.csv")


def run(arguments: argparse.Namespace) -> int:
    """Fly a plan against true targets and write what happened to each."""
    from planner.cli.session import Drive, new_files, recorded
    from planner.mission.fly import fly
    from planner.mission.run_folder import FLIGHTS, open_run, own_futures, refuse_no_run
    from planner.report import run_files, tables

    _check_route(arguments)
    refuse_no_run(arguments.directory)
    with ExitStack() as stack:
        names = (FLIGHTS,)
        folder = new_files(stack, arguments.directory, names, force=arguments.force)
        opened, stored = open_run(arguments.directory)  # which no other command replaces now
        seed = opened.scenario.search.seed if arguments.seed is None else arguments.seed
        record = partial(_true_targets, arguments=arguments, seed=seed)
        drive = Drive.of_truth("recording true targets", opened)
        recording = recorded(arguments, opened, drive, record)
        flown = fly(stored.plan, recording.futures, stored.sensor, stored.objective)
        run_files.write_flights(folder / FLIGHTS, recording, flown)
    written = arguments.directory / FLIGHTS
    summary = run_files.flight_figures(flown) | {"flights": str(written)}
    note = [] if own_futures(arguments.directory) is None else [OTHER_TARGETS]
    first: Any = tables.flights_table(flown.evaluation, in_town=not opened.network.is_abstract)
    if arguments.route is not None:
        first = run_files.mission_line(flown)
        summary["found"] = bool(flown.evaluation.found[0])
    print_result(arguments, summary, [first, *note, f"written to {written}"])
    return 0


def _check_route(arguments: argparse.Namespace) -> None:
    route, speed_mps, offset_m = arguments.route, arguments.target_speed, arguments.target_offset
    if (route is None) != (speed_mps is None) or (route is None and offset_m is not None):
        raise InputError(
            "--route: goes with --target-speed, and --target-offset with both; "
            "give a route and a speed, or none of the three"
        )


def _true_targets(recorder: "Recorder", *, arguments: argparse.Namespace, seed: int) -> "Recording":
    if arguments.route is None:
        return recorder.truths(arguments.targets, seed=seed)
    return recorder.predefined(
        arguments.route.split(),
        speed_mps=arguments.target_speed,
        offset_m=arguments.target_offset or 0.0,
        seed=seed,
    )
