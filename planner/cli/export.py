"""`planner export`: a stored plan as files that pilots and autopilots fly."""

import argparse
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from planner.cli.arguments import add_jobs, add_origin, add_run, count, metres, path
from planner.cli.printing import print_result
from planner.errors import InputError

if TYPE_CHECKING:
    from planner.export.about import Flown
    from planner.export.from_run import RunFlight
    from planner.mission.opening import OpenScenario
    from planner.mission.plan_file import StoredPlan

SUMMARY = "write a plan as files that pilots and autopilots fly"
DETAILS = """\
The flight is simplified, timed as a real aircraft flies it, and evaluated again
on fresh targets. Writes flight.plan (QGroundControl), flight.waypoints (Mission
Planner, ArduPilot only), flight.kml, flight.gpx, flight.geojson, flight.csv,
flight.fcd.xml (SUMO), and flight.txt: read that first. Heights are above the
launch point. This is research software, not certified for anything."""
EXAMPLES = (
    ("export runs/town", "into runs/town/flight"),
    ("export runs/town --autopilot px4 --format plan,kml", ""),
    ("export runs/town --aircraft multicopter", "times anew"),
    ("export runs/first --origin 49.61,6.13 --check", "no more than told"),
)
FOLDER = "flight"  # in the run's


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner export`."""
    add_run(parser)
    _add_files(parser)
    _add_flight(parser)
    parser.add_argument(
        "--check",
        action="store_true",
        help="only tell what is wrong with the flight, and write it all the same",
    )
    add_jobs(parser)
    parser.add_argument("--force", action="store_true", help="overwrite the files in DIR")


def _add_files(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-o",
        "--output",
        type=path,
        metavar="DIR",
        help="folder for the files (default: flight, in the run's)",
    )
    parser.add_argument(
        "--format",
        metavar="LIST",
        help="some of plan,waypoints,kml,gpx,geojson,csv,fcd (default: all; waypoints is for "
        "ArduPilot only)",
    )
    parser.add_argument(
        "--autopilot",
        choices=("ardupilot", "px4"),
        default="ardupilot",
        help="who flies flight.plan (default: %(default)s)",
    )
    parser.add_argument(
        "--frame",
        choices=("relative", "terrain"),
        default="relative",
        help="autopilots' heights are above the launch point, or above terrain that they know of "
        "(default: %(default)s)",
    )


def _add_flight(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--aircraft",
        type=path,
        metavar="FILE",
        help="the aircraft that flies it: a .toml with keys of [uav], or multicopter (default: "
        "the scenario's)",
    )
    parser.add_argument(
        "--tolerance",
        type=metres,
        metavar="M",
        help="how far it may be off the plan at any time, to have fewer waypoints (default: a "
        "sixth of the detection radius, at most 10)",
    )
    parser.add_argument(
        "--max-waypoints",
        type=count,
        default=600,
        metavar="N",
        help="how many an autopilot takes (default: %(default)s)",
    )
    add_origin(parser)


def run(arguments: argparse.Namespace) -> int:
    """Write the flight of a run, and print what it is worth as written."""
    from planner.cli.session import new_files
    from planner.export import about, checks, formats
    from planner.mission.run_folder import open_run, refuse_no_run

    wanted = formats.Wanted.of(arguments.format, arguments.autopilot, arguments.frame)
    refuse_no_run(arguments.directory)
    output: Path = arguments.output or arguments.directory / FOLDER
    with ExitStack() as stack:
        names = (*formats.FILES.values(), formats.ABOUT)
        folder = new_files(stack, output, names, force=arguments.force)
        opened, stored = open_run(arguments.directory)
        flight = _flight(arguments, opened, stored)
        said = [*checks.faults(flight, most_waypoints=arguments.max_waypoints)]
        if said and not arguments.check:
            raise _Refused(arguments.directory, said)
        worth = _worth(arguments, opened, stored, flight)
        summary = about.Summary(flight, wanted, tuple(said), *worth)
        files = {**formats.texts(flight, wanted), formats.ABOUT: summary.text}
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8", newline="\n")
    written = [str(output / name) for name in files]
    blocks = [*summary.blocks, f"written to {output}; read {formats.ABOUT} first"]
    print_result(arguments, summary.as_dict() | {"files": written}, blocks)
    return 0


def _flight(
    arguments: argparse.Namespace, opened: "OpenScenario", stored: "StoredPlan"
) -> "RunFlight":
    from planner.export.from_run import run_flight
    from planner.scenario.aircraft_file import with_aircraft

    file = arguments.aircraft
    return run_flight(
        opened,
        stored,
        uav=None if file is None else with_aircraft(opened.scenario.uav, file),
        origin=arguments.origin,
        tolerance_m=arguments.tolerance,
        autopilot=arguments.autopilot,
    )


def _worth(
    arguments: argparse.Namespace,
    opened: "OpenScenario",
    stored: "StoredPlan",
    flight: "RunFlight",
) -> "tuple[Flown, Flown]":
    """Return what the plan, and the flight that is written, achieve on the same fresh targets."""
    from planner.cli.session import Drive, recorded
    from planner.detection.evaluate import evaluate
    from planner.export.about import Flown

    many = int(stored.evaluated["targets"])
    drive = Drive.of_truth("recording fresh targets", opened)
    truth = recorded(arguments, opened, drive, lambda one: one.evaluation(many)).futures
    plan = stored.plan
    of_plan, of_flight = (
        evaluate(tracks, truth, stored.sensor, stored.objective)
        for tracks in (plan.tracks, (flight.track,))
    )
    return Flown(of_plan, plan.end_s - plan.take_off_s), Flown(of_flight, flight.lasts_s)


class _Refused(InputError):
    """A flight has faults, each a line of its own."""

    def __init__(self, directory: Path, said: list[str]) -> None:
        super().__init__(str(directory))
        self._lines = [f"{directory}: {line}" for line in said]
        self._lines[-1] += "; or only have it told: --check"

    def __str__(self) -> str:
        from planner.messages import plain

        return "\n".join(map(plain, self._lines))
