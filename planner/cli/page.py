"""`planner page`: a stored plan as one page for a browser."""

import argparse
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from planner.cli.arguments import add_jobs, add_run, path, permit_of
from planner.cli.printing import print_result
from planner.search.methods import METHODS, method_named

if TYPE_CHECKING:
    from planner.detection.evaluation import Evaluation
    from planner.futures.futures import Futures
    from planner.futures.store import Recording
    from planner.mission.opening import OpenScenario
    from planner.mission.plan_file import StoredPlan
    from planner.page.shown import Shown
    from planner.search.methods import Method

SUMMARY = "show a plan in one page for a browser, without a network"
DETAILS = """\
Writes page.html, which `planner plan -o` writes as well: the odds, the map with
the flight and where the target may be at any time, and all legs. It needs no
network and no other file: send it to a phone."""
EXAMPLES = (
    ("page runs/town", "into runs/town/page.html"),
    ("page runs/town --compare lawnmower,rate", "beside other flights"),
)
COMPARED = (method_named("best-crossing"),)  # takes no time, and any pilot can do it


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner page`."""
    add_run(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=path,
        metavar="FILE",
        help="where to write it (default: page.html, in the run's folder)",
    )
    parser.add_argument(
        "--compare",
        type=_methods,
        default=COMPARED,
        metavar="LIST",
        help="other methods whose odds to show, such as lawnmower,rate, or none (default: "
        "best-crossing)",
    )
    add_jobs(parser)
    parser.add_argument("--force", action="store_true", help="overwrite FILE")


def run(arguments: argparse.Namespace) -> int:
    """Write the page of a run."""
    from planner.cli.session import output_file
    from planner.files import written_whole
    from planner.mission.run_folder import PAGE, open_run, refuse_no_run
    from planner.page.page import page

    folder: Path = arguments.directory
    refuse_no_run(folder)
    with ExitStack() as stack:
        new = output_file(stack, arguments) or stack.enter_context(written_whole(folder / PAGE))
        opened, stored = open_run(folder, permit_of(arguments))
        new.write_text(page(_shown(arguments, opened, stored)), encoding="utf-8", newline="\n")
    written = arguments.output or folder / PAGE
    print_result(arguments, {"page": str(written)}, [f"written to {written}"])
    return 0


def _shown(arguments: argparse.Namespace, opened: "OpenScenario", stored: "StoredPlan") -> "Shown":
    from planner.cli.session import particles_of_run
    from planner.detection.evaluate import evaluate
    from planner.page.shown import Shown

    planning = particles_of_run(arguments, opened)
    fresh = _fresh_of_run(arguments, opened, stored)
    evaluated = evaluate(stored.plan.tracks, fresh.futures, stored.sensor, stored.objective)
    methods = [method for method in arguments.compare if method.name != stored.plan.method]
    others = compared(arguments, opened, methods, planning.futures, fresh.futures)
    return Shown(opened, stored.plan, fresh.futures, evaluated, others)


def _fresh_of_run(
    arguments: argparse.Namespace, opened: "OpenScenario", stored: "StoredPlan"
) -> "Recording":
    """Return the targets that the plan of a run was evaluated on."""
    from planner.cli.session import Drive, recorded
    from planner.mission.own_futures import read_split
    from planner.mission.run_folder import own_futures

    own = own_futures(arguments.directory)
    kept_out = None if own is None else read_split(own, opened).kept_out
    if kept_out is not None:
        return kept_out
    many: int = stored.evaluated["targets"]
    drive = Drive.of_truth("recording fresh targets", opened)
    return recorded(arguments, opened, drive, lambda one: one.evaluation(many))


def compared(
    arguments: argparse.Namespace,
    opened: "OpenScenario",
    methods: "Iterable[Method]",
    planning: "Futures",
    fresh: "Futures",
) -> "dict[str, Evaluation]":
    """Return what other methods' flights are worth on fresh targets, by what they are called.

    Methods that cannot work on the scenario are left out.
    """
    from planner.cli.session import holdout_recorded
    from planner.cli.trials import attempt_of
    from planner.errors import NotApplicableError

    found = {}
    for method in methods:
        holdout = holdout_recorded(arguments, opened, method)
        try:
            made = attempt_of(arguments, opened, method, planning, holdout=holdout)
        except NotApplicableError:
            continue
        found[f"{method.name}: {method.summary}"] = made.met(fresh).evaluated
    return found


def _methods(text: str) -> "tuple[Method, ...]":
    if text == "none":
        return ()
    names = [method.name for method in METHODS]
    try:
        return tuple(METHODS[names.index(name.strip())] for name in text.split(","))
    except ValueError:
        known = ", ".join(names)
        raise argparse.ArgumentTypeError(f"should be some of {known}, or none") from None
