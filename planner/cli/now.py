"""`planner now`: a call in words, planned while the clock runs."""

import argparse
import json
import os
import select
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.cli import call_arguments
from planner.cli.arguments import add_jobs, path, permit_of
from planner.cli.printing import console, print_json
from planner.cli.progress import progress_lines
from planner.interrupts import first_interrupt_asks, undone_if_stopped
from planner.progress import Progress

if TYPE_CHECKING:
    from planner.mission.call import Call
    from planner.mission.now_events import Cloud, Event, FirstPlan

SUMMARY = "plan a call in words while the clock runs"
DETAILS = (
    call_arguments.DETAILS
    + """

Shows where the target may be at once, a first plan soon, and better ones as
they come, until no more are tried. A key, or Ctrl-C, ends with the best. Open
DIR/page.html in a browser: it turns into the next one by itself. DIR holds the
best so far: the files of `planner plan`, and scenario.toml, from which
`planner plan` makes the same plan again. Planning takes time: the drone takes
off when the plan is there, or when it is ready, whichever is later."""
)
EXAMPLES = (
    ('now berlin --last-seen "Am Studio" --at -2min --drone-at 52.43,13.52', ""),
    ("now x.osm --last-seen 52.43,13.53 --at 14:05 --drone-at 52.43,13.52", ""),
)
EVERY_S = 0.5  # between two lines of progress for a program


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner now`."""
    call_arguments.add_call(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=path,
        metavar="DIR",
        help="folder for the run (default: runs/call- and the time)",
    )
    parser.add_argument("--force", action="store_true", help="overwrite the run in DIR")
    parser.add_argument(
        "--events",
        action="store_true",
        help="print all that comes as it comes, each a line of JSON, for programs",
    )
    add_jobs(parser)


def run(arguments: argparse.Namespace) -> int:
    """Plan a call, and hand each plan to those who listen as it comes."""
    from planner.export.formats import names_in_run
    from planner.files import alone_in, results_written_whole
    from planner.mission.now import events
    from planner.mission.now_events import FirstPlan, How
    from planner.mission.run_folder import RUN
    from planner.scenario.source import FILE

    call = call_arguments.call_of(arguments, datetime.now().astimezone())
    if arguments.output is None:
        arguments.output = Path("runs", f"call-{call.called_at:%Y%m%d-%H%M%S}")
    folder, names, permit = arguments.output, (*RUN, FILE), permit_of(arguments)
    with ExitStack() as stack:
        stack.enter_context(alone_in(folder))
        stack.callback(_settle, folder)
        earlier = (*names, *names_in_run(folder))
        with results_written_whole(folder, earlier, force=arguments.force) as new:
            call_arguments.write_call(call, new / FILE, arguments.net, permit)
        listeners: list[Callable[[Event], None]] = [
            _Files(arguments, names),
            _teller(call, arguments),
        ]
        ask = _Ask(stack)

        def elapsed_s() -> float:
            return (datetime.now().astimezone() - call.called_at).total_seconds()

        no_plan_yet = stack.enter_context(ExitStack())
        no_plan_yet.enter_context(undone_if_stopped(partial(_tell_of_call, folder)))
        progress = _progress_told if arguments.events else progress_lines
        how = How(elapsed_s, ask, arguments.jobs, progress, permit)
        for event in events(call, folder / FILE, how):
            if isinstance(event, FirstPlan):
                no_plan_yet.close()
                ask.listen()
            for listener in listeners:
                listener(event)
    return 0


def _tell_of_call(folder: Path) -> None:
    """Say what a folder holds whose call was stopped before its first plan."""
    said = (
        f"planner: {folder} holds the call, without a plan yet; `planner plan {folder}` makes one\n"
    )
    os.write(2, said.encode())


def _teller(call: "Call", arguments: argparse.Namespace) -> "Callable[[Event], None]":
    """Return who tells of what comes: to a person, to a program, or to one at the end."""
    if arguments.events:
        return _Told(call, arguments)
    return _Summary(call, arguments) if arguments.json else _Shown(call, arguments)


class _Ask:
    """Tells whether somebody wants the best plan so far, from when there is one."""

    def __init__(self, stack: ExitStack) -> None:
        self._stack, self._ways = stack, list[Callable[[], bool]]()

    def listen(self) -> None:
        """Take Ctrl-C, or a key, for the wish from now on."""
        if not self._ways:
            ways = (first_interrupt_asks(), _key_pressed())
            self._ways += map(self._stack.enter_context, ways)

    def __call__(self) -> bool:
        return any(way() for way in self._ways)


@contextmanager
def _key_pressed() -> Iterator[Callable[[], bool]]:
    """Give a function that tells whether a key was pressed, where there is a terminal."""
    with suppress(ImportError):
        import termios
        import tty

        if sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty():
            terminal = sys.stdin.fileno()
            before = termios.tcgetattr(terminal)

            def restore() -> None:
                termios.tcsetattr(terminal, termios.TCSAFLUSH, before)

            with undone_if_stopped(restore):
                tty.setcbreak(terminal)
                try:
                    yield lambda: bool(select.select([terminal], [], [], 0.0)[0])
                finally:
                    restore()
            return
    yield bool


class _Files:
    """Writes what comes: the page of the guess, then each plan's files, all of them or none.

    While better ones may come, an open page looks for them; a program is told of them instead.
    """

    def __init__(self, arguments: argparse.Namespace, names: tuple[str, ...]) -> None:
        self._arguments, self._names, self._folder = arguments, names, arguments.output

    def __call__(self, event: "Event") -> None:
        from planner.mission import now_events as now

        if isinstance(event, now.FirstPlan):
            self._write_plan(event)
        elif isinstance(event, now.Cloud):
            self._write_guess(event)

    def _write_guess(self, event: "Cloud") -> None:
        from planner.files import written_whole
        from planner.mission.run_folder import PAGE
        from planner.page.guess import page_of_guess

        if event.guess is not None:
            with written_whole(self._folder / PAGE) as new:
                text = self._reloading(page_of_guess(event.opened, event.guess))
                new.write_text(text, encoding="utf-8", newline="\n")

    def _write_plan(self, event: "FirstPlan") -> None:
        from planner.cli.planning import write_event
        from planner.files import results_written_whole
        from planner.mission.run_folder import PAGE
        from planner.scenario.source import FILE

        with results_written_whole(self._folder, self._names, force=True) as new:
            (new / FILE).write_text(event.call.text(), encoding="utf-8")
            write_event(new, self._arguments, event)
            text = (new / PAGE).read_text(encoding="utf-8")
            (new / PAGE).write_text(self._reloading(text), encoding="utf-8", newline="\n")

    def _reloading(self, text: str) -> str:
        from planner.page.document import reloading

        return text if self._arguments.events else reloading(text)


def _settle(folder: Path) -> None:
    """Have a page of a folder, if there is one, no longer look for a better one."""
    from planner.files import written_whole
    from planner.mission.run_folder import PAGE
    from planner.page.document import settled

    with suppress(FileNotFoundError):
        text = (folder / PAGE).read_text(encoding="utf-8")
        if settled(text) != text:
            with written_whole(folder / PAGE) as new:
                new.write_text(settled(text), encoding="utf-8", newline="\n")


class _Shown:
    """Prints what comes, each with when that was."""

    def __init__(self, call: "Call", arguments: argparse.Namespace) -> None:
        self._folder, self._out = arguments.output, console()
        self._by_s: float | None = None
        self._say("\n".join(call_arguments.lines_of(call)))

    def _say(self, text: str) -> None:
        self._out.print(text, soft_wrap=True)

    def __call__(self, event: "Event") -> None:
        from planner.export.formats import names_in_run
        from planner.mission import now_events as now
        from planner.mission.run_folder import PAGE
        from planner.report import call_screen

        text, screen = _said(event)
        self._say(call_screen.beside(call_screen.since(event.elapsed_s), text))
        if isinstance(event, now.Cloud) and event.guess is not None:
            self._say(f"        to look at, in a browser: {self._folder / PAGE}")
        if screen:
            self._screen(screen)
        exported = (self._folder / name for name in names_in_run(self._folder))
        if isinstance(event, now.BetterPlan) and any(file.exists() for file in exported):
            self._say("        the flight that was exported is of an earlier plan; export again:")
            self._say(f"        planner export {self._folder} --force")

    def _screen(self, lines: Iterable[str]) -> None:
        for line in lines:
            self._say(f"        {line}")
        self._say(f"        files: {self._folder}; the same plan: planner plan {self._folder}")


def _said(event: "Event") -> tuple[str, list[str]]:
    """Return what there is to say of an event: one line, and a screen below it, where it has one.

    The line may be longer than a terminal is wide.
    """
    from planner.mission import now_events as now
    from planner.report import call_screen

    match event:
        case now.Cloud():
            return call_screen.cloud_line(event), []
        case now.FirstPlan():
            return call_screen.plan_line(event), [*call_screen.screen(event)]
        case now.NoBetter():
            return call_screen.no_better_line(event), []
        case now.Outlook():
            return "what the odds depend on", [*call_screen.screen(event.plan, event)]
        case now.Done():
            return call_screen.done_line(event), []


class _Told:
    """Prints what comes as lines of JSON: for programs that follow it."""

    def __init__(self, call: "Call", arguments: argparse.Namespace) -> None:
        understood = [*map(list, call.understood)]
        _tell(event="understood", said=understood, directory=str(arguments.output))

    def __call__(self, event: "Event") -> None:
        from planner.mission import now_events as now

        text, screen = _said(event)
        kinds = {now.Cloud: "cloud", now.NoBetter: "no-better", now.Outlook: "outlook"}
        kind = "done" if isinstance(event, now.Done) else kinds.get(type(event), "plan")
        _tell(event=kind, elapsed_s=event.elapsed_s, text=text, screen=screen)


def _progress_told(title: str) -> Progress:
    """Return a callback that prints how far the work has come, now and then, and its end."""
    said_s = -EVERY_S

    def update(done: int, total: int, _note: str = "", /) -> None:
        nonlocal said_s
        now_s = time.monotonic()
        if done >= total or now_s - said_s >= EVERY_S:
            said_s = now_s
            _tell(event="progress", title=title, done=done, total=total)

    return update


def _tell(**content: Any) -> None:
    print(json.dumps(content, allow_nan=False).replace("\x7f", "\\u007f"), flush=True)


class _Summary:
    """Prints the best plan at the end, for programs."""

    def __init__(self, call: "Call", arguments: argparse.Namespace) -> None:
        self._call, self._arguments, self._plans = call, arguments, 0

    def __call__(self, event: "Event") -> None:
        from planner.mission import now_events as now
        from planner.mission import plan_file

        self._plans += isinstance(event, now.FirstPlan)
        if isinstance(event, now.Done):
            summary = {
                "understood": [*map(list, self._call.understood)],
                "plans": self._plans,
                "elapsed_s": event.elapsed_s,
                "take_off_s": event.plan.take_off_s,
                "evaluated": plan_file.figures(event.plan.trial.evaluated),
                "stopped": event.stopped,
                "directory": str(self._arguments.output),
            }
            print_json(summary)
