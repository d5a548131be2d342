"""`planner view`: a stored plan in sumo-gui, moving."""

import argparse

from planner.cli.arguments import add_jobs, add_run, count
from planner.cli.printing import print_result

SUMMARY = "watch a plan and where the target may be in sumo-gui"
DETAILS = """\
Opens a window in which the drone, its sensor's disc and possible targets move;
those it has seen turn grey. For the roads and their order alone:
sumo-gui -c DIR/plan.sumocfg. `planner page` needs no SUMO to look at."""
EXAMPLES = (
    ("view runs/town", "until the flight ends"),
    ("view runs/town --targets 100", "fewer dots, quicker"),
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner view`."""
    add_run(parser)
    parser.add_argument(
        "--targets",
        type=count,
        default=300,
        metavar="N",
        help="how many possible targets to show at most (default: %(default)s)",
    )
    add_jobs(parser)


def run(arguments: argparse.Namespace) -> int:
    """Show a run in sumo-gui."""
    from planner.cli.page import fresh_of_run
    from planner.detection.evaluate import evaluate
    from planner.export.sumo_gui_moving import Scene, show_moving
    from planner.mission.run_folder import open_run, refuse_no_run
    from planner.page.targets import picked

    refuse_no_run(arguments.directory)
    opened, stored = open_run(arguments.directory)
    fresh = fresh_of_run(arguments, opened, stored).futures
    targets = fresh.take(picked(len(fresh), arguments.targets))
    seen_at = evaluate(stored.plan.tracks, targets, stored.sensor, stored.objective).seen_at
    scene = Scene(opened.network, stored.plan, targets, seen_at, stored.sensor.radius_m)
    show_moving(scene)
    print_result(arguments, {"targets": len(targets)}, ["the flight has ended, or its window"])
    return 0
