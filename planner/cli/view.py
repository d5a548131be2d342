"""`planner view`: a stored plan, flown in a window of sumo-gui."""

import argparse
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from planner.cli.arguments import add_jobs, add_run, count, moment, permit_of
from planner.cli.printing import print_result
from planner.clock import clock
from planner.errors import InputError

if TYPE_CHECKING:
    from planner.export.gui_window import Show
    from planner.mission.opening import OpenScenario
    from planner.mission.plan_file import StoredPlan

SUMMARY = "show a plan as it is flown, in a window of sumo-gui"
DETAILS = """\
The UAV flies among the particles that the plan was made on: green dots have not
been seen yet, grey ones have. The window's own buttons halt it and go on, its
delay makes it slower, and it halts at the end of the flight. Close it, or press
Ctrl-C. Without a moving picture: sumo-gui -c DIR/plan.sumocfg. In a browser:
DIR/page.html, see `planner page`."""
EXAMPLES = (
    ("view runs/first", "in about a minute"),
    ("view runs/first --speed 10 --from 300", "slower, from there on"),
    ("view runs/first --write", "what sumo-gui -c opens"),
)
LASTS_S = 60.0  # of a show, if its speed is not given
SLOWEST, FASTEST = 0.1, 10_000.0
NO_CONFIG = "{folder} has no plan.sumocfg yet; planner view {folder} --write adds it"
LEGEND = (
    "green: not seen yet; grey: seen; black: the UAV; yellow: what it sees now",
    "close the window, or press Ctrl-C, to end",
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner view`."""
    add_run(parser)
    parser.add_argument(
        "--from",
        dest="from_s",
        type=moment,
        default=0.0,
        metavar="TIME",
        help="begin there, in seconds or H:M:S after the target was last seen (default: 0)",
    )
    parser.add_argument(
        "--speed",
        type=_speed,
        metavar="X",
        help="so many times as fast as it is flown (default: all of it in a minute)",
    )
    parser.add_argument(
        "--particles",
        type=count,
        default=300,
        metavar="N",
        help="show at most so many of them (default: %(default)s)",
    )
    parser.add_argument(
        "--write",
        action="store_true",
        help="open no window; write plan.sumocfg, and what it shows, anew: for a run that has "
        "none, or whose net has moved",
    )
    add_jobs(parser)


def run(arguments: argparse.Namespace) -> int:
    """Show a run in a window until it is closed, or write what sumo-gui opens by itself."""
    from planner.mission.run_folder import refuse_no_run

    refuse_no_run(arguments.directory)
    return _write(arguments) if arguments.write else _show(arguments)


def _write(arguments: argparse.Namespace) -> int:
    from planner.cli.session import new_files
    from planner.export.gui_settings import write_for_gui
    from planner.mission.run_folder import CONFIG, GUI, open_run

    with ExitStack() as stack:
        folder = new_files(stack, arguments.directory, GUI, force=True)
        opened, stored = open_run(arguments.directory, permit_of(arguments))
        write_for_gui(folder, stored.plan, opened.network, opened.airspace)
    written = arguments.directory / CONFIG
    print_result(arguments, {"config": str(written)}, [f"written; sumo-gui -c {written} shows it"])
    return 0


def _show(arguments: argparse.Namespace) -> int:
    from planner.cli.session import particles_of_run
    from planner.export.gui_scene import Scene
    from planner.export.gui_settings import write_for_gui
    from planner.export.gui_window import refuse_no_display, show
    from planner.locks import temporary_folder
    from planner.mission.run_folder import CONFIG, open_run
    from planner.network.sumo import plain_names

    refuse_no_display()
    folder: Path = arguments.directory
    opened, stored = open_run(folder, permit_of(arguments))
    times = _shown(arguments, opened, stored)
    futures = particles_of_run(arguments, opened).futures
    scene = Scene.of(stored, futures, opened.network, most=arguments.particles)
    summary = {"particles": len(scene.futures), "from_s": times.from_s, "until_s": times.until_s}
    hint = [] if (folder / CONFIG).is_file() else [NO_CONFIG.format(folder=folder)]
    print_result(arguments, summary, [*LEGEND, *hint])
    path = opened.network.path
    with temporary_folder() as place, plain_names([path], path.parent) as links:
        write_for_gui(place, stored.plan, opened.network, opened.airspace, net=links[path])
        show(place / CONFIG, scene, times)
    return 0


def _shown(arguments: argparse.Namespace, opened: "OpenScenario", stored: "StoredPlan") -> "Show":
    """Return which part of the search is shown, and how fast."""
    from planner.export.gui_window import Show
    from planner.flight.pieces import flight_span

    horizon_s = opened.scenario.search.horizon_s
    take_off_s = opened.scenario.uav.take_off_s
    _, until_s = flight_span(stored.plan, take_off_s, horizon_s)
    if not 0.0 <= arguments.from_s < until_s:
        raise InputError(
            f"--from {clock(arguments.from_s)}: the flight is shown from 0 to {clock(until_s)}; "
            "choose a time in between"
        )
    speed = arguments.speed or max(1.0, (until_s - arguments.from_s) / LASTS_S)
    return Show.of(arguments.from_s, until_s, speed)


def _speed(text: str) -> float:
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not SLOWEST <= speed <= FASTEST:
        raise argparse.ArgumentTypeError(
            f"should be a number from {SLOWEST:g} to {FASTEST:g}, not {text!r}"
        )
    return speed
