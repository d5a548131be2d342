"""`planner export`: a stored plan as files that pilots and autopilots fly."""

import argparse
from contextlib import ExitStack
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from planner.cli.arguments import add_jobs, add_origin, add_run, count, metres, path, permit_of
from planner.cli.printing import print_result
from planner.clock import rough
from planner.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.export.about import Worth
    from planner.export.by_hand import Judge
    from planner.export.from_run import RunFlight
    from planner.export.odds import Odds
    from planner.flight.track import Track
    from planner.mission.opening import OpenScenario
    from planner.mission.plan_file import StoredPlan

SUMMARY = "write a plan as files that pilots and autopilots fly"
DETAILS = """\
The flight is simplified, timed as a real aircraft flies it, and evaluated again
on fresh targets. Writes flight.plan (QGroundControl), flight.waypoints (Mission
Planner, ArduPilot only), flight.kml, flight.gpx, flight.geojson, flight.csv,
flight.fcd.xml and flight.edgedata.xml (SUMO), and flight.txt: read that first.
Heights are above the launch point. This is research software, not certified
for anything."""
EXAMPLES = (
    ("export runs/town", "into runs/town/flight"),
    ("export runs/town --autopilot px4 --format plan,kml", ""),
    ("export runs/town --aircraft multicopter", "times anew"),
    ("export runs/town --by-hand 12", "a pilot's stick"),
    ("export runs/town --params drone.param", "set as the times ask?"),
    ("export runs/first --origin 49.61,6.13 --check", "no more than told"),
)


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
        help="some of plan,waypoints,kml,gpx,geojson,csv,fcd,edgedata (default: all; waypoints "
        "is for ArduPilot only)",
    )
    parser.add_argument(
        "--autopilot",
        choices=("ardupilot", "px4"),
        default="ardupilot",
        help="who flies flight.plan (default: %(default)s)",
    )
    parser.add_argument(
        "--params",
        type=path,
        metavar="FILE",
        help="a vehicle's parameters (.param, .parm, .params): tell which are not those that the "
        "times rest on",
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
    parser.add_argument(
        "--split",
        action="store_true",
        help="write more than --max-waypoints to numbered files, each from where one ended",
    )
    parser.add_argument(
        "--by-hand",
        type=count,
        metavar="N",
        help="in at most N legs, along named streets, for a pilot with a stick",
    )
    add_origin(parser)


def run(arguments: argparse.Namespace) -> int:
    """Write the flight of a run, and print what it is worth as written."""
    from planner.cli.session import new_files
    from planner.export import about, checks, formats
    from planner.mission.run_folder import open_run, refuse_no_run

    most: int = arguments.max_waypoints
    wanted = formats.Wanted.of(
        arguments.format, arguments.autopilot, arguments.frame, most if arguments.split else None
    )
    refuse_no_run(arguments.directory)
    output: Path = arguments.output or arguments.directory / formats.FOLDER
    with ExitStack() as stack:
        folder = new_files(stack, output, formats.names_in(output), force=arguments.force)
        opened, stored = open_run(arguments.directory, permit_of(arguments))
        flights = [_flight(arguments, opened, one) for one in stored.each]
        limit = None if arguments.split else most
        said = [[*checks.faults(flight, most_waypoints=limit)] for flight in flights]
        names = stored.plan.names if len(flights) > 1 else ("",)
        near = [*checks.too_near(flights, names)]
        if any([*said, near]) and not arguments.check:
            raise _Refused(arguments.directory, [*checks.of_flights(names, said), *near])
        worth = _worth(arguments, opened, stored, flights)
        written = zip(flights, said, worth.flown, strict=True)
        summaries = [
            about.Summary(flight, wanted, (*wrong, *near), flown, _vehicle(arguments, flight))
            for flight, wrong, flown in written
        ]
        told = about.About(tuple(summaries))
        files = {**formats.texts(flights, wanted, worth.odds), formats.ABOUT: told.text}
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8", newline="\n")
    ends = f"written to {output}; read {formats.ABOUT} first"
    paths = [str(output / name) for name in files]
    late = _late_line(flights, datetime.now(UTC))
    lines = [*told.lines(names), *([late] if late else []), ends]
    print_result(arguments, told.as_dict() | {"files": paths}, lines)
    return 0


def _late_line(flights: "Sequence[RunFlight]", now: datetime) -> str:
    """Return that take-off was to be within the last 24 hours; nothing if not, or nobody knows."""
    sighted_at = flights[0].flight.sighted_at
    if sighted_at is None:
        return ""
    leaves_s = min(float(one.track.time_s[0]) for one in flights)
    late = now - sighted_at - timedelta(seconds=leaves_s)
    if not timedelta(seconds=1) <= late < timedelta(days=1):
        return ""
    return (
        f"Take-off was planned for {rough(late.total_seconds())} ago, and the odds are those of a "
        "flight on time: plan the call again, or `planner replan` with --uav-at."
    )


def _vehicle(arguments: argparse.Namespace, flight: "RunFlight") -> tuple[str, ...] | None:
    """Return how the parameters of a vehicle differ; None: none are given."""
    from planner.export.parameters import differences, parameters

    if arguments.params is None:
        return None
    wanted = parameters(flight.aircraft.law, arguments.autopilot)
    return tuple(differences(arguments.params, wanted))


def _flight(
    arguments: argparse.Namespace, opened: "OpenScenario", stored: "StoredPlan"
) -> "RunFlight":
    from planner.cli.progress import progress_bar
    from planner.export.from_run import Hand, hand_flight, run_flight
    from planner.scenario.aircraft_file import with_aircraft

    file = arguments.aircraft
    mine = opened.scenario.uavs[stored.plan.flights[0].uav]
    uav = None if file is None else with_aircraft(mine, file)
    if uav is not None and len(opened.scenario.uavs) > 1:  # each keeps to its height
        uav = uav.model_copy(update={"altitude_m": mine.altitude_m})
    if arguments.by_hand is not None:
        if arguments.tolerance is not None:
            raise InputError("--tolerance: is for an autopilot's flight; leave it or --by-hand out")
        judge = _judge(arguments, opened, stored)
        with progress_bar("choosing legs") as progress:
            hand = Hand(arguments.by_hand, judge, progress)
            return hand_flight(opened, stored, hand, uav=uav, origin=arguments.origin)
    return run_flight(
        opened,
        stored,
        uav=uav,
        origin=arguments.origin,
        tolerance_m=arguments.tolerance,
        autopilot=arguments.autopilot,
    )


def _judge(arguments: argparse.Namespace, opened: "OpenScenario", stored: "StoredPlan") -> "Judge":
    """Return the particles that the plan was made on, and what it was made for."""
    from planner.cli.session import particles_of_run
    from planner.export.by_hand import Judge

    return Judge(particles_of_run(arguments, opened).futures, stored.sensor, stored.objective)


class _Worth(NamedTuple):
    """What flights achieve on the same fresh targets."""

    flown: "list[Worth]"  # for each flight, what all are worth together
    odds: "Odds"  # of the flights that are written


def _worth(
    arguments: argparse.Namespace,
    opened: "OpenScenario",
    stored: "StoredPlan",
    flights: "Sequence[RunFlight]",
) -> _Worth:
    """Return what the plan, and the flights that are written, achieve on the same fresh targets."""
    from planner.cli.session import Drive, recorded
    from planner.detection.evaluate import evaluate
    from planner.export.about import Flown, Worth
    from planner.export.from_run import line_alone
    from planner.export.odds import Odds

    many: int = stored.evaluated["targets"]
    drive = Drive.of_truth("recording fresh targets", opened)
    truth = recorded(arguments, opened, drive, lambda one: one.evaluation(many)).futures

    def flown(tracks: "Sequence[Track]") -> list[Flown]:
        found = evaluate(tracks, truth, stored.sensor, stored.objective)
        return [Flown(found, track.end_s - float(track.time_s[0])) for track in tracks]

    tracks, lines = [flight.track for flight in flights], [line_alone(one) for one in flights]
    planned, written = flown(stored.plan.tracks), flown(tracks)
    on_s = [track.sensor_on for track in tracks]
    from_s, to_s = min(float(one.min()) for one in on_s), max(float(one.max()) for one in on_s)
    made = written[0].evaluation
    odds = Odds(truth, made.seen_at, flights[0].network, from_s, to_s, made.survival)
    alone: list[Flown | None] = [None] * len(tracks)
    if any(line is not None for line in lines):
        held = flown([line or track for track, line in zip(tracks, lines, strict=True)])
        alone = [None if line is None else one for line, one in zip(lines, held, strict=True)]
    return _Worth([Worth(*each) for each in zip(planned, written, alone, strict=True)], odds)


class _Refused(InputError):
    """A flight has faults, each a line of its own."""

    def __init__(self, directory: Path, said: list[str]) -> None:
        super().__init__(str(directory))
        self._lines = [f"{directory}: {line}" for line in said]
        self._lines[-1] += "; or only have it told: --check"

    def __str__(self) -> str:
        from planner.messages import plain

        return "\n".join(map(plain, self._lines))
