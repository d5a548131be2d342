"""The arguments of each command; its code is loaded when it runs."""

import argparse
import importlib
from collections.abc import Callable
from typing import Any

from planner.cli.arguments import (
    add_jobs,
    add_objective,
    add_run,
    add_scenario,
    add_targets,
    count,
    moment,
    path,
    seed,
    share,
    span,
)
from planner.cli.examples import OF_COMMAND, told
from planner.search.methods import METHODS

Command = Callable[[argparse.Namespace], int]


def add_commands(commands: Any) -> None:
    """Give the parser all commands."""
    _add_build(commands)
    _add_futures(commands)
    _add_where(commands)
    _add_plan(commands)
    _add_fly(commands)
    _add_certify(commands)
    _add_compare(commands)
    _add_experiment(commands)
    _add_doctor(commands)


def _command(
    commands: Any, name: str, summary: str, more: str = "", *, module: str = "simple"
) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=f"{summary[0].upper()}{summary[1:]}.\n\n{more}".strip(),
        epilog=told(OF_COMMAND[name]),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=_later(name, module))
    parser.add_argument(
        "-v", "--verbose", action="count", default=0, help="tell more; twice: tell all"
    )
    parser.add_argument("--json", action="store_true", help="print the summary alone, as JSON")
    return parser


def _later(name: str, module: str) -> Command:
    """Return a command whose code is loaded when it runs, so that --help answers at once."""

    def run(arguments: argparse.Namespace) -> int:
        command: Command = getattr(importlib.import_module(f"planner.cli.{module}"), name)
        return command(arguments)

    return run


def _add_build(commands: Any) -> None:
    parser = _command(commands, "build", "build the scenario's network with netconvert")
    add_scenario(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=path,
        metavar="FILE",
        help="write the .net.xml here as well",
    )
    parser.add_argument("--force", action="store_true", help="overwrite FILE")


def _add_futures(commands: Any) -> None:
    parser = _command(
        commands,
        "futures",
        "record the particles' futures in SUMO",
        "Writes futures.parquet and particles.parquet.",
    )
    add_scenario(parser)
    parser.add_argument(
        "-o", "--output", type=path, metavar="DIR", help="write the files here as well"
    )
    parser.add_argument("--force", action="store_true", help="overwrite files in DIR")


def _add_where(commands: Any) -> None:
    parser = _command(commands, "where", "tell where the target may be at a time")
    add_scenario(parser)
    parser.add_argument(
        "--at",
        type=moment,
        required=True,
        metavar="TIME",
        help="seconds or H:M:S since the target was last seen",
    )
    parser.add_argument(
        "-o",
        "--output",
        type=path,
        metavar="DIR",
        help="write where.csv and where.png here",
    )
    parser.add_argument("--force", action="store_true", help="overwrite files in DIR")


def _add_plan(commands: Any) -> None:
    parser = _command(
        commands,
        "plan",
        "plan a search and evaluate it on fresh targets",
        "Writes plan.json, evaluation.parquet, run.json, plan.png and plan.add.xml\n"
        "(the path as an overlay: sumo-gui -n NET -a plan.add.xml); with --gap also what\n"
        "`planner certify` writes.",
        module="plan",
    )
    add_scenario(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=path,
        metavar="DIR",
        help="folder of the run; left out: nothing is saved",
    )
    parser.add_argument(
        "--method",
        default="best",
        metavar="NAME",
        help="how the plan is made, see below (default: %(default)s)",
    )
    parser.add_argument(
        "--free", action="store_true", help="let `best` leave the roads: turn, hover, cut across"
    )
    parser.add_argument(
        "--futures",
        type=path,
        metavar="FILE",
        help="plan on these futures: a futures.parquet, or SUMO's FCD output (XML or Parquet)",
    )
    parser.add_argument(
        "--tick",
        type=moment,
        metavar="S",
        help="greedy: detect at ticks of so many seconds",
    )
    add_objective(parser)
    parser.add_argument(
        "--gap",
        type=share,
        metavar="G",
        help="also bound how much better any plan can be, until the plan is this near, such as 0.1",
    )
    parser.add_argument(
        "--time-limit",
        type=span,
        metavar="S",
        help="stop the search after so many seconds, with the best plan (and bound) so far, as "
        "Ctrl-C does",
    )
    add_targets(parser, default=4000)
    parser.add_argument("--force", action="store_true", help="overwrite the run in DIR")
    methods = (f"  {method.name:<21} {method.summary}" for method in METHODS)
    parser.epilog = "\n".join(["methods:", *methods, "", str(parser.epilog)])


def _add_fly(commands: Any) -> None:
    parser = _command(
        commands,
        "fly",
        "fly a plan against true targets",
        "Writes flights.csv into the run's folder.",
    )
    add_run(parser)
    add_targets(parser, default=1000)
    parser.add_argument(
        "--route", metavar="EDGES", help='one target with this route, as "r0c0-r0c1 r0c1-r1c1 ..."'
    )
    parser.add_argument(
        "--target-speed", type=float, metavar="MPS", help="its speed in m/s, with --route"
    )
    parser.add_argument(
        "--target-offset",
        type=float,
        metavar="M",
        help="metres on its first edge where it starts, with --route (default: 0)",
    )
    parser.add_argument("-s", "--seed", type=seed, help="seed of the targets (default: the run's)")
    add_jobs(parser)
    parser.add_argument("--force", action="store_true", help="overwrite flights.csv")


def _add_certify(commands: Any) -> None:
    parser = _command(
        commands,
        "certify",
        "bound how much better than a run's plan any plan can be",
        "Adds a certificate to plan.json and writes prices.parquet, weights.parquet,\n"
        "motion.parquet and net.json, with which tools/verify.py checks it.\n"
        "Ctrl-C ends the search with the bound so far.",
        module="certify",
    )
    add_run(parser)
    parser.add_argument(
        "--gap",
        type=share,
        default=0.0,
        metavar="G",
        help="stop at this gap, such as 0.1",
    )
    parser.add_argument(
        "--time-limit",
        type=span,
        metavar="S",
        help="stop after so many seconds for each set",
    )
    parser.add_argument(
        "--work",
        type=count,
        metavar="N",
        help="price steps (default: 600, or any number with --time-limit)",
    )
    parser.add_argument(
        "--sets",
        type=count,
        metavar="K",
        help="bound so many other sets of particles as well, 10 or more, for a statement about "
        "the true optimum",
    )
    add_jobs(parser)
    parser.add_argument("--force", action="store_true", help="replace an earlier certificate")


def _add_compare(commands: Any) -> None:
    parser = _command(
        commands,
        "compare",
        "compare all methods on the same futures and the same fresh targets",
        module="compare",
    )
    add_scenario(parser, optional=True)
    parser.add_argument(
        "--instances",
        action="store_true",
        help="on the frozen instances instead, against the best plans known; then -o is a folder, "
        "and a comparison that was stopped goes on",
    )
    parser.add_argument(
        "--bound",
        action="store_true",
        help="also bound how much better any plan can be, for a column of gaps; takes a minute",
    )
    parser.add_argument(
        "--time-limit", type=span, metavar="S", help="stop bounding after so many seconds"
    )
    parser.add_argument("-o", "--output", type=path, metavar="FILE", help="write the table as CSV")
    parser.add_argument("--force", action="store_true", help="overwrite FILE")
    add_objective(parser)
    add_targets(parser, default=4000)


def _add_experiment(commands: Any) -> None:
    parser = _command(
        commands,
        "experiment",
        "run an experiment: all combinations of factors, methods and seeds",
        "Writes results.csv, results.parquet and timings.parquet. Each condition is kept in\n"
        "DIR as it is done: called again, a stopped experiment goes on where it was.",
        module="experiment",
    )
    parser.add_argument(
        "experiment",
        metavar="FILE",
        help="an experiment file, a shipped one (figure8), or `paper` for all of the paper's",
    )
    parser.add_argument("-o", "--output", type=path, metavar="DIR", help="folder of the results")
    parser.add_argument(
        "-j",
        "--jobs",
        type=count,
        metavar="N",
        help="conditions at a time (default: cores)",
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help="first and last level of each factor, two seeds, few particles and targets",
    )
    parser.add_argument("--dry-run", action="store_true", help="list the conditions, run none")
    parser.add_argument(
        "--backend",
        choices=("processes", "dask"),
        default="processes",
        help="what runs them: processes here, or Dask (default: %(default)s)",
    )
    parser.add_argument(
        "--address",
        metavar="ADDR",
        help="of a Dask scheduler, as tcp://host:8786; left out: a cluster is started here",
    )
    parser.add_argument(
        "--only",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="only one level of a factor, such as method=greedy or seed=1; repeatable",
    )


def _add_doctor(commands: Any) -> None:
    _command(commands, "doctor", "check this installation, with a remedy for each fault")
