"""`planner where`: the belief at a given time, road by road."""

import argparse
from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from planner.cli.arguments import add_scenario, moment, path
from planner.cli.printing import print_result
from planner.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.futures.futures import Futures
    from planner.futures.state_at import RoadState, State
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
        futures, network = _recorded(arguments, opened).futures, opened.network
        found = [
            _Whereabouts(name, state, by_road(state, network))
            for name, rows in _each(opened, futures)
            for state in [state_at(rows, network, arguments.at)]
        ]
        if folder is not None:
            roads = [replace(road, target=name) for name, _, each in found for road in each]
            every = state_at(futures, network, arguments.at)
            every = replace(every, weight=every.weight / len(found))  # of any one, on average
            where.write_where(folder, opened, every, roads)
    contents, blocks = [], list[Any]()
    for name, state, each in found:
        when = {"time_s": arguments.at, "elsewhere_probability": state.elsewhere_probability}
        most = len(each) if arguments.all else where.MOST_ROWS
        called = name or "the target"
        blocks.append(where.where_table(each, network, **when, most=most, called=called))
        if len(each) > most:
            blocks.append(f"--all lists all {len(each):,} roads")
        named = {"target": name} if name else {}
        contents.append(named | where.where_content(each, network, **when))
    if arguments.output:
        blocks.append(f"written to {arguments.output}")
    whole = contents[0] if len(contents) == 1 else {"targets": contents}
    print_result(arguments, whole, blocks)
    return 0


class _Whereabouts(NamedTuple):
    """Where one of the targets may be."""

    name: str  # "" if it is the only one
    state: "State"
    roads: "list[RoadState]"


def _each(opened: "OpenScenario", futures: "Futures") -> "Iterator[tuple[str, Futures]]":
    """Yield the particles of each target that is still searched for, by its name."""
    names = opened.scenario.target_names
    if len(names) == 1:
        yield "", futures
        return
    for number, name in enumerate(names):
        if (rows := futures.target == number).any():
            yield name, futures.take(rows)


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
