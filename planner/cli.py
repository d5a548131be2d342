"""The command line: parse, call, print."""

import argparse
import importlib
import json
import logging
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn

from planner.clock import seconds
from planner.errors import PlannerError
from planner.stopping import stopped_by_signals

Command = Callable[[argparse.Namespace], int]

BAD_INPUT = 2

DESCRIPTION = """\
Plan in which order a drone flies the roads to find a vehicle soonest on average.

A scenario tells what is known: the road network, where the vehicle may have
started, how fast it goes, where it may turn; where the drone is and what it sees.
Many possible futures of the vehicle are driven through SUMO and recorded; road
orders are flown against them, and the best are flown against fresh ones.
"""

EXAMPLES = """\
examples:
  planner plan grid5x5 -o runs/first            plan, evaluate, draw
  planner fly runs/first --targets 1000         fly it against fresh targets
  planner compare grid5x5                       all methods, one table
  planner experiment grid5x5/figure8 -o runs/8  a batch, which goes on if stopped
  planner where grid5x5 --at 0:30:00            where the vehicle may be by then
  planner plan grid5x5 --set uav.start.distance_m=120000 --set greedy.direction=both
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code: 0 well, 2 bad input.

    The process ends with 130 if Ctrl-C stops it.
    """
    with stopped_by_signals():
        arguments = _parser().parse_args(argv)
        with _log_lines(arguments.verbose):
            try:
                run: Command = arguments.run
                code = run(arguments)
                if sys.stdout is not None:  # it may have been closed from the start
                    sys.stdout.flush()
                return code
            except BrokenPipeError:
                return _unread()
            except (PlannerError, OSError, MemoryError) as error:
                return _refused(error)


def _refused(error: Exception) -> int:
    """Tell what is wrong, a line for each fault."""
    if isinstance(error, MemoryError):
        lines = [f"out of memory ({error or 'no more is free'}); try fewer particles or targets"]
    elif isinstance(error, OSError):
        lines = [f"{error.filename or 'standard output'}: {error.strerror or error}"]
    else:
        lines = str(error).splitlines()
    with suppress(OSError):
        for line in lines:
            print(f"planner: {line}", file=sys.stderr)
    return BAD_INPUT


def _unread() -> int:
    """Nobody reads on, as with ``| head``: end without a word, also when Python flushes."""
    sys.stdout = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115
    return 128 + 13


class _Once(logging.Filter):
    """Lets a warning through once: an experiment opens the same scenario again and again."""

    def __init__(self) -> None:
        super().__init__()
        self._said: set[str] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        text = record.getMessage()
        again = record.levelno >= logging.WARNING and text in self._said
        self._said.add(text)
        return not again


@contextmanager
def _log_lines(verbose: int) -> Iterator[None]:
    """Write the package's own log to stderr."""
    log = logging.getLogger("planner")
    lines = logging.StreamHandler()
    lines.setFormatter(logging.Formatter("planner: %(message)s"))
    lines.addFilter(_Once())
    log.addHandler(lines)
    log.setLevel((logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)])
    try:
        yield
    finally:
        log.removeHandler(lines)


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, as all else here does."""

    def error(self, message: str) -> NoReturn:
        command = self.prog.removeprefix("planner").strip()
        told = f"{command}: {message}" if command else message
        self.exit(BAD_INPUT, f"planner: {told}; {self.prog} --help tells more\n")


class _Version(argparse.Action):
    """Prints versions; they are looked up only when asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from planner.provenance import versions

        known = versions()
        print(f"planner {known['planner']}, SUMO {known['sumo']}")
        parser.exit()


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="planner",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--version", action=_Version, nargs=0, help="print the versions of planner and SUMO"
    )
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_build(commands)
    _add_futures(commands)
    _add_where(commands)
    _add_plan(commands)
    _add_fly(commands)
    _add_certify(commands)
    _add_compare(commands)
    _add_experiment(commands)
    _add_doctor(commands)
    return parser


def _command(
    commands: Any, name: str, summary: str, more: str = "", *, module: str = "commands"
) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=f"{summary[0].upper()}{summary[1:]}. {more}".strip(),
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
        command: Command = getattr(importlib.import_module(f"planner.{module}"), name)
        return command(arguments)

    return run


def _add_scenario(parser: argparse.ArgumentParser, *, optional: bool = False) -> None:
    parser.add_argument(
        "scenario",
        nargs="?" if optional else None,
        metavar="SCENARIO",
        help="a scenario.toml, its folder, the name of a shipped one (grid5x5, figure3, ...), "
        "or the run.json of an earlier run",
    )
    parser.add_argument(
        "-n", "--net-file", type=_path, metavar="FILE", help="another SUMO net (.net.xml)"
    )
    parser.add_argument("-s", "--seed", type=_seed, help="seed of all random draws")
    parser.add_argument("--preset", metavar="NAME", help="one of the scenario's [presets.NAME]")
    parser.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="override a field of the scenario, such as uav.start.distance_m=120000; repeatable",
    )
    parser.add_argument(
        "-j", "--jobs", type=_count, metavar="N", help="processes that run SUMO (default: cores)"
    )


def _add_targets(parser: argparse.ArgumentParser, *, default: int) -> None:
    parser.add_argument(
        "--targets",
        type=_count,
        default=default,
        metavar="N",
        help="fresh targets to fly against (default: %(default)s)",
    )


def _add_objective(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--objective",
        choices=("time", "probability"),
        help="least expected detection time, or most probably found by --by",
    )
    parser.add_argument(
        "--by", type=_seconds, metavar="TIME", help="the deadline, seconds or H:M:S since time 0"
    )


def _add_build(commands: Any) -> None:
    parser = _command(commands, "build", "build the scenario's network with netconvert")
    _add_scenario(parser)
    parser.add_argument(
        "-o", "--output", type=_path, metavar="FILE", help="write the .net.xml here as well"
    )


def _add_futures(commands: Any) -> None:
    parser = _command(
        commands,
        "futures",
        "record the particles' futures in SUMO",
        "Writes futures.parquet and particles.parquet.",
    )
    _add_scenario(parser)
    parser.add_argument(
        "-o", "--output", type=_path, metavar="DIR", help="write the files here as well"
    )
    parser.add_argument("--force", action="store_true", help="overwrite files in DIR")


def _add_where(commands: Any) -> None:
    parser = _command(commands, "where", "tell where the target may be at a time")
    _add_scenario(parser)
    parser.add_argument(
        "--at", type=_seconds, required=True, metavar="TIME", help="seconds or H:M:S"
    )
    parser.add_argument(
        "-o", "--output", type=_path, metavar="DIR", help="write where.csv and where.png here"
    )
    parser.add_argument("--force", action="store_true", help="overwrite files in DIR")


def _add_plan(commands: Any) -> None:
    parser = _command(
        commands,
        "plan",
        "plan a search and evaluate it on fresh targets",
        "Writes plan.json, evaluation.parquet, run.json, plan.png and plan.add.xml\n"
        "(the path as an overlay: sumo-gui -n NET -a plan.add.xml).",
    )
    _add_scenario(parser)
    parser.add_argument("-o", "--output", type=_path, metavar="DIR", help="folder of the run")
    parser.add_argument(
        "--method",
        default="best",
        metavar="NAME",
        help="how the plan is made; `planner compare` shows them all (default: %(default)s)",
    )
    parser.add_argument(
        "--free", action="store_true", help="let `best` leave the roads: turn, hover, cut across"
    )
    parser.add_argument(
        "--futures",
        type=_path,
        metavar="FILE",
        help="plan on these futures: a futures.parquet, or SUMO's FCD output (XML or Parquet)",
    )
    parser.add_argument(
        "--tick", type=_seconds, metavar="S", help="greedy: detect at ticks of so many seconds"
    )
    _add_objective(parser)
    parser.add_argument(
        "--time-limit",
        type=_seconds,
        metavar="S",
        help="stop the search after so many seconds, with the best plan so far, as Ctrl-C does",
    )
    _add_targets(parser, default=4000)
    parser.add_argument("--force", action="store_true", help="overwrite the run in DIR")


def _add_fly(commands: Any) -> None:
    parser = _command(
        commands,
        "fly",
        "fly a plan against true targets",
        "Writes flights.csv into the run's folder.",
    )
    parser.add_argument(
        "directory", type=_path, metavar="DIR", help="folder of a run that `plan` wrote"
    )
    _add_targets(parser, default=1000)
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
    parser.add_argument("-s", "--seed", type=_seed, help="seed of the targets")
    parser.add_argument("-j", "--jobs", type=_count, metavar="N", help="processes that run SUMO")
    parser.add_argument("--force", action="store_true", help="overwrite flights.csv")


def _add_certify(commands: Any) -> None:
    parser = _command(
        commands,
        "certify",
        "bound how much better than a run's plan any plan can be",
        "Adds a certificate to plan.json and writes prices.parquet, knots.parquet and net.json,\n"
        "with which tools/verify.py checks it. Ctrl-C ends the search with the bound so far.",
    )
    parser.add_argument(
        "directory", type=_path, metavar="DIR", help="folder of a run that `plan` wrote"
    )
    parser.add_argument(
        "--gap", type=_share, default=0.0, metavar="G", help="stop at this gap, such as 0.1"
    )
    parser.add_argument(
        "--time-limit", type=_seconds, metavar="S", help="stop after so many seconds for each set"
    )
    parser.add_argument(
        "--work", type=_count, default=600, metavar="N", help="price steps (default: %(default)s)"
    )
    parser.add_argument(
        "--sets",
        type=_count,
        metavar="K",
        help="bound so many other sets of particles as well, 10 or more, for a statement about "
        "the true optimum",
    )
    parser.add_argument("-j", "--jobs", type=_count, metavar="N", help="processes that run SUMO")
    parser.add_argument("--force", action="store_true", help="replace an earlier certificate")


def _add_compare(commands: Any) -> None:
    parser = _command(
        commands,
        "compare",
        "compare all methods on the same futures and the same fresh targets",
    )
    _add_scenario(parser, optional=True)
    parser.add_argument(
        "--instances",
        action="store_true",
        help="on the frozen instances instead, against the best plans known; then -o is a folder, "
        "and a comparison that was stopped goes on",
    )
    parser.add_argument("-o", "--output", type=_path, metavar="FILE", help="write the table as CSV")
    parser.add_argument("--force", action="store_true", help="overwrite FILE")
    _add_objective(parser)
    _add_targets(parser, default=4000)


def _add_experiment(commands: Any) -> None:
    parser = _command(
        commands,
        "experiment",
        "run an experiment: all combinations of factors, methods and seeds",
        "Writes results.csv, results.parquet and timings.parquet. What is finished is kept in DIR\n"
        "as it is done: called again, a stopped experiment goes on where it was.",
        module="commands_experiment",
    )
    parser.add_argument(
        "experiment",
        metavar="FILE",
        help="an experiment file, a shipped one (figure8), or `paper` for all of the paper's",
    )
    parser.add_argument("-o", "--output", type=_path, metavar="DIR", help="folder of the results")
    parser.add_argument(
        "-j", "--jobs", type=_count, metavar="N", help="conditions at a time (default: cores)"
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help="first and last level of each factor, one seed, few particles and targets",
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


def _seconds(text: str) -> float:
    try:
        return seconds(text)
    except PlannerError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _share(text: str) -> float:
    try:
        share = float(text)
    except ValueError:
        share = -1.0
    if not 0.0 <= share < float("inf"):
        raise argparse.ArgumentTypeError(f"should be a share from 0 on, such as 0.1, not {text!r}")
    return share


def _count(text: str) -> int:
    return _whole_number(text, 1)


def _seed(text: str) -> int:
    return _whole_number(text, 0)


def _whole_number(text: str, least: int) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) < 19 and int(text) >= least):
        raise argparse.ArgumentTypeError(f"should be a whole number from {least} on, not {text!r}")
    return int(text)


def _path(text: str) -> Path:
    if not text:
        raise argparse.ArgumentTypeError("is empty; name a file or a folder")
    return Path(text)


def print_json(content: Any) -> None:
    """Print plain data as JSON on stdout."""
    print(json.dumps(content, indent=1, allow_nan=False))
