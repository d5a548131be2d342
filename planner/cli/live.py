"""What `planner fly --live` does: news is read as it comes, and waypoints are written."""

import argparse
import json
import select
import sys
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from planner.cli.news_arguments import heard_line, setting_of
from planner.cli.printing import console
from planner.clock import clock
from planner.errors import InputError
from planner.export.flyable import against
from planner.files import alone_at
from planner.guard import parsed_json
from planner.interrupts import first_interrupt_asks
from planner.mission.live import DECIDE_S, Live, Proposal, ends
from planner.mission.news_words import Setting, time_of
from planner.mission.online import Mission, Remembering
from planner.mission.places import waypoints
from planner.mission.run_folder import open_run, refuse_no_run
from planner.report import news_lines
from planner.search.methods import method_named

POLL_S = 0.2  # between two looks at the file
NAME = "live.jsonl"  # in the run's folder


def fly_live(arguments: argparse.Namespace) -> int:
    """Read news until the target is found, the flight is over, or somebody ends it."""
    refuse_no_run(arguments.directory)
    opened, stored = open_run(arguments.directory)
    written = arguments.output or arguments.directory / NAME
    recorder = Remembering(opened, arguments.jobs)
    live = Live(
        Mission(recorder, stored.plan, method_named("best")),
        against,
        decide_s=0.0 if arguments.auto else DECIDE_S,
    )
    mission = live.mission
    mission.warm_up()
    setting = setting_of(opened, stored, stored.plan.take_off_s, arguments.live.parent)
    told = _Told(written, arguments)
    with alone_at(written), first_interrupt_asks() as asked:
        told.begins(arguments.live, stored.plan.end_s)
        watch = _Watch(setting)
        for line in _lines(arguments.live, asked, watch, lambda: mission.plan.end_s):
            try:
                heard, now_s = watch.heard(line)
                told.say("; ".join(heard.said))
                if ends(heard):
                    break
                for proposal in live.hear(heard, now_s):
                    if told.decides(proposal):
                        live.take(proposal)
            except InputError as error:
                told.say(f"the plan there was stands: {error}")
    told.say(f"all plans taken are in {written}")
    return 0


class _Line(NamedTuple):
    number: int
    text: str


class _Watch:
    """Which time it is on the target's clock."""

    def __init__(self, setting: Setting) -> None:
        self._setting, self._begun_s = setting, time.monotonic()
        self._zero_s = setting.now_s
        if setting.sighted_at is not None:
            since_s = (datetime.now(UTC) - setting.sighted_at).total_seconds()
            self._zero_s = max(setting.now_s, since_s)

    @property
    def now_s(self) -> float:
        """Seconds on the target's clock: of the day, or as if it had taken off at the start."""
        return self._zero_s + time.monotonic() - self._begun_s

    def heard(self, line: _Line) -> Any:
        """Return what a line means, and when it is told."""
        try:
            said = parsed_json(line.text)
            setting = self._setting._replace(now_s=self.now_s)
            if isinstance(said, dict) and "now" in said:
                now_s = time_of("now", said.pop("now"), setting)
                self._zero_s += now_s - self.now_s
                setting = setting._replace(now_s=now_s)
            return heard_line(json.dumps(said), setting), setting.now_s
        except (ValueError, InputError) as error:
            raise InputError(f"line {line.number}: {error}") from error


def _lines(file: Path, asked: Any, watch: _Watch, ends_s: Any) -> Iterator[_Line]:
    """Yield the lines of a file as they are appended, until the flight is over or it is ended."""
    read, number = 0, 0
    while not asked() and watch.now_s < ends_s():
        content = file.read_bytes() if file.is_file() else b""
        whole = content.rfind(b"\n") + 1
        for text in content[read:whole].decode("utf-8", "replace").splitlines():
            number += 1
            if text.strip():
                yield _Line(number, text)
        if whole == read:
            time.sleep(POLL_S)
        read = max(read, whole)


class _Told:
    """Says what comes, asks, and writes what is taken."""

    def __init__(self, written: Path, arguments: argparse.Namespace) -> None:
        self._written, self._auto, self._json = written, arguments.auto, arguments.json
        self._out = console()

    def say(self, text: str) -> None:
        """Print a line."""
        if not self._json:
            self._out.print(text, soft_wrap=True)

    def begins(self, file: Path, end_s: float) -> None:
        """Say what is waited for."""
        self.say(f"reads {file}, until {clock(end_s)}; plans go to {self._written}; Ctrl-C ends")

    def decides(self, proposal: Proposal) -> bool:
        """Return whether a proposal is flown."""
        took = f"{proposal.took_s:.1f} s, by {proposal.by}"
        for line in proposal.wrong:
            self.say(f"the plan there was stands ({took}): {line}")
        if not proposal.is_new:
            if not proposal.wrong:
                self.say(f"the plan there was goes on ({took}): nothing better was found")
            return False
        (track,) = proposal.plan.tracks
        lead = proposal.found.lead
        gain = news_lines.saving(proposal.found, lead)
        self.say(f"from {clock(proposal.going_on.at_s)} ({took}): {gain}")
        is_quick = proposal.by != "best"
        if not self._auto and (is_quick or not self._yes()):
            if not is_quick:
                self.say("nobody said yes: the plan there was goes on")
            return False
        row = {
            "from_s": proposal.going_on.at_s,
            "by": proposal.by,
            "took_s": round(proposal.took_s, 3),
            "waypoints": waypoints(track, proposal.going_on.opened.network),
            "sensor_on": track.sensor_on.tolist(),
        }
        with self._written.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row, allow_nan=False) + "\n")
        if self._json:
            print(json.dumps(row, allow_nan=False), flush=True)
        return True

    def _yes(self) -> bool:
        if sys.stdin is None or not sys.stdin.isatty():
            return False
        self._out.print(f"fly it? y within {DECIDE_S:g} s ", end="")
        ready, _, _ = select.select([sys.stdin], [], [], DECIDE_S)
        return bool(ready) and sys.stdin.readline().strip().lower() in ("y", "yes")
