"""The command line: parse, call, print."""

import argparse
import json
import logging
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn

from planner.cli.commands import Command, add_commands
from planner.cli.examples import OF_ALL, told
from planner.errors import PlannerError
from planner.interrupts import stopped_by_signals

BAD_INPUT = 2

DESCRIPTION = """\
Plan in which order a drone flies the roads to find a vehicle soonest on average.

A scenario tells what is known: the road network, where the vehicle may have
started, how fast it goes, where it may turn; where the drone is and what it sees.
Many possible futures of the vehicle are driven through SUMO and recorded; road
orders are flown against them, and the best are flown against fresh ones.
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
        """Tell whether a record is to be written."""
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
        """End the program with what is wrong and where help is."""
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
        epilog=told(OF_ALL),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--version", action=_Version, nargs=0, help="print the versions of planner and SUMO"
    )
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    add_commands(commands)
    return parser


def print_json(content: Any) -> None:
    """Print plain data as JSON on stdout."""
    print(json.dumps(content, indent=1, allow_nan=False))
