"""`planner plan`: its options; `planning` does the work."""

import argparse
import textwrap

from planner.cli.arguments import (
    add_backend,
    add_objective,
    add_scenario,
    add_targets,
    moment,
    objective_overrides,
    path,
    share,
    span,
)
from planner.clock import clock
from planner.errors import InputError
from planner.search.methods import METHODS

SUMMARY = "plan a search and evaluate it on fresh targets"
DETAILS = """\
Writes plan.json, evaluation.parquet, run.json, plan.png, page.html (open it in
a browser, or send it to a phone) and what `sumo-gui -c DIR/plan.sumocfg` shows:
plan.sumocfg, plan.view.xml and plan.add.xml, the flight as an overlay. With
--gap it also writes the files of `planner certify`."""
EXAMPLES = (
    ("plan grid5x5 -o runs/first", "the roads in order"),
    ("plan grid5x5 --free -o runs/free", "may leave the roads"),
    ("plan grid5x5 --method greedy --preset paper", "as in the paper"),
    ("plan grid5x5 --gap 0.1 -o runs/near", "until the gap is 10 %"),
    ("plan grid5x5 --objective probability --by 0:30:00", ""),
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner plan`, and the list of methods below them."""
    add_scenario(parser)
    add_backend(parser, what="drive targets", needs="the net at the same place")
    parser.add_argument(
        "-o",
        "--output",
        type=path,
        metavar="DIR",
        help="folder for the run (default: save nothing)",
    )
    parser.add_argument(
        "--method",
        default="best",
        metavar="NAME",
        help="planning method, see below, or a planner of your own as path.py:function "
        "(default: %(default)s)",
    )
    parser.add_argument(
        "--free",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="whether `best` may leave the roads: turn around, hover, cut across; left out: it "
        "may in towns, not on abstract nets",
    )
    _add_futures(parser)
    add_objective(parser)
    _add_ends(parser)
    add_targets(parser)
    parser.add_argument("--force", action="store_true", help="overwrite the run in DIR")
    methods = (
        textwrap.fill(f"  {one.name:<21} {one.summary}", 80, subsequent_indent=24 * " ")
        for one in METHODS
    )
    parser.epilog = "\n".join(["methods:", *methods, "", str(parser.epilog)])


def _add_futures(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--futures",
        type=path,
        nargs="+",
        metavar="FILE",
        help="plan on these futures: a futures.parquet, or SUMO's FCD output (XML, CSV or "
        "Parquet); several files are several days, each as likely as any other",
    )
    parser.add_argument(
        "--begin",
        type=moment,
        metavar="TIME",
        help="the time in --futures that is time 0 of the search, in seconds or H:M:S",
    )
    parser.add_argument(
        "--tick", type=moment, metavar="S", help="greedy: check for detection every S seconds"
    )


def _add_ends(parser: argparse.ArgumentParser) -> None:
    """Add what ends a search."""
    parser.add_argument(
        "--gap",
        type=share,
        metavar="G",
        help="also bound the best possible plan, and search until the gap is at most G, e.g. 0.1",
    )
    parser.add_argument(
        "--time-limit",
        type=span,
        metavar="S",
        help="stop the search after S seconds and keep the best plan (and bound) so far, as "
        "Ctrl-C does",
    )


def run(arguments: argparse.Namespace) -> int:
    """Plan a search, evaluate it on fresh targets, and write the run."""
    from planner.cli.planning import plan_and_write

    return plan_and_write(arguments, _overrides(arguments))


def _overrides(arguments: argparse.Namespace) -> list[str]:
    """Return the scenario overrides that the command's own options stand for."""
    overrides = objective_overrides(arguments)
    if arguments.begin is not None and arguments.futures is None:
        raise InputError(
            f"--begin {clock(arguments.begin)}: goes with --futures only; leave it out"
        )
    if arguments.free is not None:
        option = "--free" if arguments.free else "--no-free"
        if arguments.method != "best":
            raise InputError(f"{option}: goes with --method best, not with {arguments.method}")
        overrides.append(f"search.free={str(arguments.free).lower()}")
    if arguments.tick is not None:
        if arguments.method != "greedy":
            raise InputError(f"--tick {arguments.tick:g}: goes with --method greedy only")
        overrides.append(f"greedy.tick_s={arguments.tick}")
    return overrides
