"""The command line: parse, call, exit codes. Each command has a file of its own beside this one."""

import argparse
import io
import logging
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn, Protocol

from planner.errors import LostError, PlannerError, is_short_of_memory
from planner.interrupts import stopped_by_signals
from planner.locks import sweep
from planner.messages import as_line

BAD_INPUT = 2
LOST = 1  # a process that did part of the work died each time
UNREAD = 128 + 13  # the reader has gone, as with ``| head``: silence

DESCRIPTION = """\
Plan the order in which a drone flies the roads so that it finds a vehicle as
soon as possible on average.

A scenario describes what is known: the road network, where the vehicle may have
started, how fast it drives and where it may turn, where the drone starts and
what it can see. SUMO simulates many possible futures of the vehicle. Road
orders are flown against these futures, and the best ones against fresh targets.
"""

Examples = tuple[tuple[str, str], ...]  # what is typed, and what that is for

EXAMPLES: Examples = (
    ("plan grid5x5 -o runs/first", "plan, evaluate and draw"),
    ("plan grid5x5 --gap 0.1 -o runs/near", "until within 10 % of a bound"),
    ("fly runs/first --targets 1000", "fly it against fresh targets"),
    ("compare grid5x5", "all methods in one table"),
    ("experiment figure8 -o runs/8", "a batch that can be resumed"),
    ("where grid5x5 --at 0:30:00", "where the vehicle may be by then"),
    ("plan grid5x5 --set uav.start.distance_m=120000 --set uav.speed_mps=50", ""),
)

# All that `planner --help` needs; a command's file repeats its summary and a test compares them.
COMMANDS = (
    ("build", "build a scenario's road network with netconvert"),
    ("check", "measure a net, tell what work on it costs and what is odd"),
    ("futures", "simulate the particles in SUMO and record their futures"),
    ("new", "write a call in words as a scenario file, and plan nothing"),
    ("now", "plan a call in words while the clock runs"),
    ("where", "show where the target may be at a given time"),
    ("validate", "check the belief against true vehicles of runs that no particle has seen"),
    ("plan", "plan a search and evaluate it on fresh targets"),
    ("fly", "fly a plan against true targets"),
    ("replan", "plan the rest of a flight anew with what has come in"),
    ("ask", "which question about the target saves most time"),
    ("export", "write a plan as files that pilots and autopilots fly"),
    ("page", "show a plan in one page for a browser, without a network"),
    ("serve", "serve the page as an instrument: tap the map, plan, take the files"),
    ("view", "show a plan as it is flown, in a window of sumo-gui"),
    ("certify", "bound the gap between a run's plan and the best possible plan"),
    ("compare", "compare all methods on the same futures and fresh targets"),
    ("instances", "export the frozen instances as plain files, or score submitted plans"),
    ("check-planner", "hold a planner of your own against what every planner owes"),
    ("experiment", "run all combinations of factors, methods and seeds"),
    ("doctor", "check this installation and suggest a remedy for each fault"),
)


class Command(Protocol):
    """What the file of a command holds."""

    @property
    def SUMMARY(self) -> str:
        """One line of `planner --help`."""

    @property
    def DETAILS(self) -> str:
        """What else the command's own --help says of it; may be empty."""

    @property
    def EXAMPLES(self) -> Examples:
        """The end of the command's own --help."""

    def arguments(self, parser: argparse.ArgumentParser, /) -> None:
        """Add the command's arguments to a parser."""

    def run(self, arguments: argparse.Namespace, /) -> int:
        """Run the command and return its exit code."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code: 0 on success, 2 on bad input, 1 if processes died.

    The process ends with 130 if Ctrl-C stops it.
    """
    if argv is None and not sys.warnoptions:
        # What a library has to say of its own code helps nobody who types a command.
        warnings.simplefilter("ignore")
    with stopped_by_signals():
        _show_what_cannot_be_encoded()
        words = sys.argv[1:] if argv is None else list(argv)
        try:
            return _run(words)
        except BrokenPipeError:
            _forget_output()
            return UNREAD
        except (PlannerError, OSError, MemoryError) as error:
            if isinstance(error, OSError):
                _forget_output()
            return _refused(error)
        except ImportError as error:
            if is_short_of_memory(error):
                return _refused(MemoryError(str(error)))
            raise


def _run(words: Sequence[str]) -> int:
    try:
        arguments = parser_for(words).parse_args(words)
        with _log_lines(arguments.verbose):
            sweep()
            run: Callable[[argparse.Namespace], int] = arguments.run
            code = run(arguments)
    except SystemExit:  # of --help and --version, which have printed
        _flush_output()
        raise
    _flush_output()
    return code


def _flush_output() -> None:
    if sys.stdout is not None:  # it may have been closed from the start
        sys.stdout.flush()


def parser_for(words: Sequence[str]) -> argparse.ArgumentParser:
    """Return a parser that lists all commands and has the arguments of the one that was typed."""
    parser = _Parser(
        prog="planner",
        description=DESCRIPTION,
        epilog=_examples_text(EXAMPLES),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--version", action=_Version, nargs=0, help="print the versions of planner and SUMO"
    )
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    typed = next((word for word in words if not word.startswith("-")), None)
    for name, summary in COMMANDS:
        if name == typed:
            _add_arguments(commands, name, command_named(name))
        else:
            commands.add_parser(name, help=summary)
    return parser


def command_named(name: str) -> Command:
    """Return the command of that name; its file is loaded only now, which keeps --help quick."""
    if name not in dict(COMMANDS):
        raise ValueError(name)
    command: Command = import_module(f"planner.cli.{name.replace('-', '_')}")
    return command


def _add_arguments(commands: Any, name: str, command: Command) -> None:
    summary = command.SUMMARY
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=f"{summary[0].upper()}{summary[1:]}.\n\n{command.DETAILS}".strip(),
        epilog=_examples_text(command.EXAMPLES),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=command.run)
    parser.add_argument(
        "-v", "--verbose", action="count", default=0, help="more log output (-vv: debug)"
    )
    parser.add_argument("--json", action="store_true", help="print only a summary, as JSON")
    command.arguments(parser)


def _examples_text(examples: Examples) -> str:
    """Return examples as lines, with what they are for in a column of its own."""
    widest = max((len(typed) for typed, why in examples if why), default=0)
    lines = (f"  planner {typed:<{widest}}   {why}".rstrip() for typed, why in examples)
    return "\n".join(["examples:", *lines])


class _Parser(argparse.ArgumentParser):
    """Reports a fault in one line, as the rest of the program does."""

    def error(self, message: str) -> NoReturn:
        """End the program with what is wrong and where to find help."""
        command = self.prog.removeprefix("planner").strip()
        fault = f"{command}: {message}" if command else message
        self.exit(BAD_INPUT, f"planner: {as_line(fault)}; see {self.prog} --help\n")

    def _print_message(self, message: str, file: Any = None) -> None:
        """Print a message; argparse's own way is silent about an output that takes nothing."""
        if file is sys.stdout and file is not None:
            file.write(message)
        else:
            super()._print_message(message, file)


class _Version(argparse.Action):
    """Prints versions; they are looked up only when asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from planner.provenance import versions

        known = versions()
        print(f"planner {known['planner']}, SUMO {known['sumo']}")
        parser.exit()


def _refused(error: Exception) -> int:
    """Print what is wrong, one line per fault."""
    if isinstance(error, MemoryError):
        lines = [f"out of memory ({error or 'no more is free'}); try fewer particles or targets"]
    elif isinstance(error, OSError):
        lines = [f"{error.filename or 'standard output'}: {error.strerror or error}"]
    else:
        lines = str(error).split("\n")
    with suppress(OSError):
        for line in lines:
            print(f"planner: {as_line(line)}", file=sys.stderr)
    return LOST if isinstance(error, LostError) else BAD_INPUT


def _forget_output() -> None:
    """Have Python's own flush at the end fail no more, where the output takes nothing."""
    sys.stdout = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115


class _Once(logging.Filter):
    """Lets a warning through once: an experiment opens the same scenario again and again."""

    def __init__(self) -> None:
        super().__init__()
        self._said: set[str] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether a record is to be written."""
        text = record.getMessage()
        again = record.levelno >= logging.WARNING and text in self._said
        self._said.add(text)
        return not again


class _Plain(logging.Formatter):
    """Writes records in one line each, without what a terminal obeys."""

    def formatMessage(self, record: logging.LogRecord) -> str:
        """Return the line of a record."""
        record.message = as_line(record.message)
        return super().formatMessage(record)


def _show_what_cannot_be_encoded() -> None:
    """Have characters that the terminal's encoding lacks written by their numbers."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


@contextmanager
def _log_lines(verbose: int) -> Iterator[None]:
    """Write the package's own log to stderr."""
    log = logging.getLogger("planner")
    lines = logging.StreamHandler()
    lines.setFormatter(_Plain("planner: %(message)s"))
    lines.addFilter(_Once())
    log.addHandler(lines)
    log.setLevel((logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)])
    try:
        yield
    finally:
        log.removeHandler(lines)
