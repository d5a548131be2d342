"""`planner experiment`: its options; `batch` and `paper` do the work."""

import argparse

from planner.cli.arguments import add_backend, add_methods, add_permit, count, path
from planner.errors import InputError

SUMMARY = "run all combinations of factors, methods and seeds"
DETAILS = """\
Writes results.csv, results.parquet and timings.parquet. Each condition is
stored in DIR as soon as it is done; rerun the command to resume a stopped
experiment."""
EXAMPLES = (
    ("experiment figure8 --dry-run", "its conditions and their times"),
    ("experiment figure8 -o runs/8 --quick", "a small version to try it out"),
    ("experiment figure8 -o runs/8 --only method=greedy", ""),
    ("experiment paper -o runs/paper", "the whole paper, with a report"),
)

PAPER = "paper"  # the name that stands for all experiments of the paper


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner experiment`."""
    parser.add_argument(
        "experiment",
        metavar="FILE",
        help="an experiment file, the name of a shipped one (figure8), or `paper` for all of the "
        "paper's",
    )
    parser.add_argument("-o", "--output", type=path, metavar="DIR", help="folder for the results")
    parser.add_argument(
        "-j",
        "--jobs",
        type=count,
        metavar="N",
        help="conditions to run in parallel (default: one per core)",
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help="only the first and last level of each factor, two seeds, few particles and targets",
    )
    add_methods(parser, what="also plan")
    parser.add_argument(
        "--dry-run", action="store_true", help="list the conditions without running them"
    )
    add_permit(parser)
    add_backend(parser, what="run them", needs="the scenario at the same place")
    parser.add_argument(
        "--only",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="run only one level of a factor, e.g. method=greedy or seed=1; repeatable",
    )


def run(arguments: argparse.Namespace) -> int:
    """Run an experiment or all experiments of the paper, or list their conditions."""
    if arguments.experiment == PAPER and arguments.method:
        raise InputError("--method: goes with one experiment, not with paper")
    if arguments.experiment == PAPER:
        from planner.cli.paper import run_paper

        return run_paper(arguments)
    from planner.cli.batch import run_experiment

    return run_experiment(arguments)
