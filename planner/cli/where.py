"""`planner where`: the belief at a given time, road by road."""

import argparse
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from planner.cli.arguments import add_scenario, moment, path
from planner.cli.printing import print_result
from planner.errors import InputError

if TYPE_CHECKING:
    from planner.futures.store import Recording
    from planner.mission.opening import OpenScenario

SUMMARY = "show where the target may be at a given time"
DETAILS = ""
EXAMPLES = (
    ("where grid5x5 --at 1800", "its most likely roads"),
    ("where grid5x5 --at 0:30:00 -o runs/where", "with a picture"),
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner where`."""
    add_scenario(parser)
    parser.add_argument(
        "--at",
        type=moment,
        required=True,
        metavar="TIME",
        help="seconds or H:M:S after the target was last seen",
    )
    parser.add_argument(
        "-o", "--output", type=path, metavar="DIR", help="write where.csv and where.png to DIR"
    )
    parser.add_argument("--all", action="store_true", help="list all roads, not only the likeliest")
    parser.add_argument("--force", action="store_true", help="overwrite files in DIR")


def run(arguments: argparse.Namespace) -> int:
    """Print where the target may be at a time, the most likely roads first."""
    from planner.cli.session import opened_scenario, output_folder
    from planner.futures.state_at import by_road, state_at
    from planner.report import where

    with ExitStack() as stack:
        folder = output_folder(stack, arguments, where.FILES)
        opened = opened_scenario(arguments)
        _check_time(arguments.at, opened.scenario.search.horizon_s)
        recording = _recorded(arguments, opened)
        state = state_at(recording.futures, opened.network, arguments.at)
        roads = by_road(state, opened.network)
        if folder is not None:
            where.write_where(folder, opened, state, roads)
    elsewhere = state.elsewhere_probability
    about = (roads, opened.network)
    when = {"time_s": arguments.at, "elsewhere_probability": elsewhere}
    most = len(roads) if arguments.all else where.MOST_ROWS
    blocks: list[Any] = [where.where_table(*about, **when, most=most)]
    if len(roads) > most:
        blocks.append(f"--all lists all {len(roads):,} roads")
    if arguments.output:
        blocks.append(f"written to {arguments.output}")
    print_result(arguments, where.where_content(*about, **when), blocks)
    return 0


def _recorded(arguments: argparse.Namespace, opened: "OpenScenario") -> "Recording":
    """Return the particles of the belief; of a run on other futures, those it was planned on."""
    from planner.cli.session import futures_of_run, planning_recorded, tell_own
    from planner.mission.own_futures import read_split

    own = futures_of_run(arguments)
    if own is None:
        return planning_recorded(arguments, opened)
    tell_own(arguments, own)
    return read_split(own, opened).planning


def _check_time(time_s: float, horizon_s: float) -> None:
    if not 0 <= time_s <= horizon_s:
        raise InputError(
            f"--at {time_s:g}: futures are recorded from 0 to {horizon_s:g} s; choose "
            "a time in that range, or a later search.horizon_s"
        )
