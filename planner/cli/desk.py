"""What the served page works on: one call at a time, planned by a process of its own.

A process, because it can be asked to stop, and killed, at any moment without harm to the server:
its files are whole whenever it ends, compiled code in it keeps nobody waiting, and its memory is
given back. What it says is kept, so that whoever comes later hears all of the call.
"""

import logging
import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import IO, Any

from planner.errors import InputError
from planner.guard import parsed_json
from planner.messages import as_line, as_written, suggestion
from planner.mission.run_folder import PAGE, PLAN
from planner.scenario.profiles import shipped_profiles

log = logging.getLogger(__name__)

Event = dict[str, Any]

PLANNER = (sys.executable, "-m", "planner")
PLACES, TIMES = ("last_seen", "drone_at"), ("at", "ready", "until", "battery")
WORDS = (*PLACES, *TIMES, "heading", "radius_m", "target")
NEEDED = ("last_seen", "at", "drone_at")
LONGEST = 200  # characters of a word
FLIGHT = "flight"  # the folder in a run's where `planner export` writes
OF_FLIGHT = {"flight.plan": "plan", "flight.kml": "kml", "flight.gpx": "gpx"}  # by format
FILES = (*OF_FLIGHT, PAGE, PLAN)  # that can be taken, and no others
PATIENCE_S = 5.0


class BusyError(Exception):
    """A call is being planned already."""


def words_of(content: Any) -> dict[str, str]:
    """Return the words of a call that came from outside, those that are said.

    None of them can name a file.

    Raises
    ------
    InputError
        If one is missing, is no word, or is not of a call.
    """
    if not isinstance(content, dict):
        raise InputError('a call should be an object; send {"last_seen": "52.43,13.52", ...}')
    for name, word in content.items():
        if name not in WORDS:
            raise InputError(f"{as_written(name)} is no word of a call; {suggestion(name, WORDS)}")
        if not isinstance(word, str) or len(word) > LONGEST or not word.isprintable():
            raise InputError(f"{name} should be text of one line, {LONGEST} characters at most")
    said = {name: word for name, word in content.items() if word.strip()}
    for name in NEEDED:
        if name not in said:
            raise InputError(f"{name} is missing; say it")
    target, profiles = said.get("target"), shipped_profiles()
    if target is not None and target not in profiles:
        raise InputError(f"{as_written(target)} is not a profile; {suggestion(target, profiles)}")
    return said


class Desk:
    """Plans calls, and keeps what is said of the last one.

    Parameters
    ----------
    net
        As `planner now` takes it.
    root
        Folder for the folders of runs.
    options
        Of `planner now`, for all calls.
    planner
        The program, before its arguments.
    """

    def __init__(
        self,
        net: str,
        root: Path,
        options: Sequence[str] = (),
        planner: Sequence[str] = PLANNER,
    ) -> None:
        self._net, self._root, self._options, self._planner = net, root, options, planner
        self.said: Mapping[str, str] = {}  # words of the last call
        self.folder: Path | None = None  # of the last run that has a plan
        self.plans = 0  # that have come, of all calls
        self.pages = 0  # that have come: of plans, and of guesses before them
        self._guess: Path | None = None  # the folder of a call that has no plan yet
        self._exported = 0  # how many had come when the flight was written
        self._events: list[Event] = []
        self._first = 0  # of these, of the last call
        self._changed = threading.Condition()
        self._exporting = threading.Lock()
        self._process: subprocess.Popen[str] | None = None
        self._exporter: subprocess.Popen[str] | None = None
        self._stops = False
        self.is_closed = False

    # Planning

    def begin(self, said: Mapping[str, str]) -> None:
        """Begin to plan a call.

        Raises
        ------
        BusyError
            If one is being planned.
        """
        with self._changed:
            if self._process is not None:
                raise BusyError("a call is being planned; stop it first")
            folder = self._new_folder()
            words = [f"--{name.replace('_', '-')}={word}" for name, word in said.items()]
            ends = ("-o", str(folder), "--events")
            errors = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115
            self._process = subprocess.Popen(
                [*self._planner, "now", self._net, *words, *self._options, *ends],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=errors,
                encoding="utf-8",
                start_new_session=True,  # Ctrl-C in the terminal is the server's
            )
            self.said, self._stops, self._first = said, False, len(self._events)
            self._say({"event": "call"})
            followed = (self._process, folder, errors)
        threading.Thread(target=self._follow, args=followed, daemon=True).start()
        threading.Thread(target=_clear_away, args=followed[:1], daemon=True).start()

    def stop(self) -> bool:
        """Ask for the best plan so far, the second time for an end; return whether that is heard.

        Before there is a plan, the first time ends it as well.
        """
        with self._changed:
            if self._process is None:
                return False
            self._stops = True
            self._process.send_signal(signal.SIGINT)
            return True

    def close(self) -> None:
        """End what is being planned, and those who listen."""
        with self._changed:
            started, self.is_closed = (self._process, self._exporter), True
            self._changed.notify_all()
        running = [process for process in started if process is not None]
        for process in running:
            process.terminate()
        for process in running:
            with suppress(subprocess.TimeoutExpired):
                process.wait(PATIENCE_S)

    def _new_folder(self) -> Path:
        stem = self._root / f"call-{datetime.now().astimezone():%Y%m%d-%H%M%S}"
        folder, number = stem, 1
        while folder.exists():
            number += 1
            folder = stem.with_name(f"{stem.name}-{number}")
        return folder

    def _follow(self, process: "subprocess.Popen[str]", folder: Path, errors: IO[str]) -> None:
        """Keep what the process says until it ends, and how it ended."""
        plans = 0
        assert process.stdout is not None
        with process.stdout as lines, errors:
            for line in lines:
                with suppress(ValueError):  # cut off, if the process was killed
                    plans += self._heard(parsed_json(line), folder)
            code = process.wait()
            errors.seek(0)
            said = [line.strip().removeprefix("planner: ") for line in errors]
        with self._changed:
            self._process = self._guess = None
            text = self._how_it_ended(code, [as_line(line) for line in said if line])
            if text:
                text += f"; the last plan stands, in {folder}" if plans else ""
                log.warning("%s", text)
            self._say({"event": "ended", "code": code, "text": text})

    def _heard(self, event: Event, folder: Path) -> bool:
        """Keep an event; return whether it is a plan, whose files are whole by now."""
        is_plan: bool = event["event"] == "plan"
        is_guess = event["event"] == "cloud" and (folder / PAGE).is_file()
        with self._changed:
            if is_guess:
                self._guess = folder
            if is_plan:
                self.folder, self.plans, self._guess = folder, self.plans + 1, None
            if is_plan or is_guess:
                self.pages += 1
                event["pages"] = self.pages
            self._say(event)
        return is_plan

    def _how_it_ended(self, code: int, said: Sequence[str]) -> str:
        """Return what is worth telling of an end; "" if all has been told."""
        if code == 0:
            return ""
        if self._stops or self.is_closed:
            return "stopped"
        if code < 0:
            return f"the planner was killed (signal {-code}); plan again"
        return "; ".join(said) or f"the planner ended (exit code {code}); plan again"

    # What is said

    def _say(self, event: Event) -> None:
        self._events.append(event)
        self._changed.notify_all()

    def begun(self) -> int:
        """Return the number of the last call's first event."""
        return self._first

    def heard(self, number: int, timeout_s: float) -> list[Event]:
        """Return the events from a number on; none if none comes in time, or any more."""
        with self._changed:
            self._changed.wait_for(lambda: self.is_closed or len(self._events) > number, timeout_s)
            return self._events[number:]

    # Files

    @property
    def page(self) -> Path | None:
        """The page of the last plan, or of where the target of a call may be that has none yet."""
        folder = self._guess or self.folder
        return None if folder is None else folder / PAGE

    def file(self, name: str) -> Path | None:
        """Return a file of the last plan, one of `FILES`; None while there is none.

        Raises
        ------
        InputError
            If the plan cannot be flown as a file, with the reason.
        """
        folder = self.folder
        if folder is None:
            return None
        if name not in OF_FLIGHT:
            return folder / name
        with self._exporting:
            if self._exported < self.plans:
                plans = self.plans  # a better one may come meanwhile
                self._export(folder)
                self._exported = plans
        return folder / FLIGHT / name

    def _export(self, folder: Path) -> None:
        command = ["export", str(folder), "--force", "--format", ",".join(OF_FLIGHT.values())]
        with subprocess.Popen(
            [*self._planner, *command],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,
        ) as self._exporter:
            _, errors = self._exporter.communicate()
        if self._exporter.returncode:
            said = [line.removeprefix("planner: ") for line in errors.splitlines()]
            raise InputError(as_line("; ".join(said) or "the files could not be written"))


def _clear_away(process: "subprocess.Popen[str]") -> None:
    """End what a killed planner has started, which would hold its output open."""
    if process.wait() < 0:
        with suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
