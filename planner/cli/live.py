"""What `planner fly --live` does: news is read as it comes, and waypoints are written."""

import argparse
import json
import select
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from planner.cli.arguments import permit_of
from planner.cli.news_arguments import line_of, named, setting_of
from planner.cli.printing import console
from planner.clock import clock
from planner.errors import InputError
from planner.export.flyable import against
from planner.files import alone_at
from planner.interrupts import first_interrupt_asks
from planner.mission.heard import Heard
from planner.mission.live import BEST, DECIDE_S, Live, Offer, ends
from planner.mission.news_values import Setting, time_of
from planner.mission.news_words import heard
from planner.mission.online import Mission, Remembering
from planner.mission.places import waypoints
from planner.mission.run_folder import open_run, refuse_no_run
from planner.report import news_lines

POLL_S = 0.2  # between two looks at the file
NAME = "live.jsonl"  # in the run's folder


def fly_live(arguments: argparse.Namespace) -> int:
    """Read news until all targets are found, the flight is over, or somebody ends it."""
    refuse_no_run(arguments.directory)
    opened, stored = open_run(arguments.directory, permit_of(arguments))
    written: Path = arguments.output or arguments.directory / NAME
    mission = Mission(Remembering(opened, arguments.jobs), stored.plan, BEST)
    mission.warm_up()
    live = Live(mission, against, decide_s=0.0 if arguments.auto else DECIDE_S)
    watch = _Watch(setting_of(opened, stored, stored.plan.take_off_s, arguments.live.parent))
    listener = _Listener(written, auto=arguments.auto, as_json=arguments.json)
    with alone_at(written), first_interrupt_asks() as asked:
        until = clock(stored.plan.end_s)
        listener.say(f"reads {arguments.live} until {until}; plans go to {written}; Ctrl-C ends")

        def is_over() -> bool:
            return asked() or watch.now_s >= mission.plan.end_s

        for line in _lines(arguments.live, is_over):
            try:
                meant, now_s = watch.heard(line)
                listener.say("; ".join(meant.said))
                if ends(meant, mission.opened):
                    break
                live.hear(meant, now_s, listener.decides)
            except InputError as error:
                listener.say(f"the plan there was stands: {error}")
    taken = f"all plans taken are in {written}" if written.exists() else "no plan was taken"
    listener.say(taken)
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

    def heard(self, line: _Line) -> tuple[Heard, float]:
        """Return what a line means, and when it is told."""
        with named(f"line {line.number}"):
            said = line_of(line.text)
            setting = self._setting._replace(now_s=self.now_s)
            if "now" in said:
                now_s = time_of("now", said.pop("now"), setting)
                self._zero_s += now_s - self.now_s
                setting = setting._replace(now_s=now_s)
            return heard(said, setting), setting.now_s


def _lines(file: Path, is_over: Callable[[], bool]) -> Iterator[_Line]:
    """Yield the lines of a file as they are appended, until it is over.

    A file that is written anew has new lines as well: those that were not there as often before.
    """
    read, before = Counter[str](), b""
    while not is_over():
        content = file.read_bytes() if file.is_file() else b""
        if content == before:
            time.sleep(POLL_S)
            continue
        before, known = content, read.copy()
        whole = content[: content.rfind(b"\n") + 1].decode("utf-8", "replace")
        for number, text in enumerate(whole.splitlines(), 1):
            if known[text]:
                known[text] -= 1
            elif text.strip():
                read[text] += 1
                yield _Line(number, text)


class _Listener:
    """Tells a person, or a program, what comes, and writes what is taken."""

    def __init__(self, written: Path, *, auto: bool, as_json: bool) -> None:
        self._written, self._auto, self._json = written, auto, as_json
        self._out = console()

    def say(self, text: str) -> None:
        """Print a line."""
        if not self._json:
            self._out.print(text, soft_wrap=True)

    def decides(self, offer: Offer) -> bool:
        """Return whether an offer is flown; one that is, is written."""
        self.say(news_lines.offer_line(offer))
        if not offer.is_new:
            return False
        if not self._auto:
            if offer.is_quick:  # the best one comes before anybody has looked at it
                return False
            if not self._yes():
                self.say("nobody said yes: the plan there was goes on")
                return False
        self._write(offer)
        return True

    def _write(self, offer: Offer) -> None:
        rows = [json.dumps(row, allow_nan=False) for row in _rows(offer)]
        text = "\n".join(rows)
        with self._written.open("a", encoding="utf-8") as file:
            file.write(text + "\n")
        if self._json:
            print(text, flush=True)

    def _yes(self) -> bool:
        if sys.stdin is None or not sys.stdin.isatty():
            return False
        self._out.print(f"fly it? y within {DECIDE_S:g} s ", end="")
        ready, _, _ = select.select([sys.stdin], [], [], DECIDE_S)
        return bool(ready) and sys.stdin.readline().strip().lower() in ("y", "yes")


def _rows(offer: Offer) -> Iterator[dict[str, Any]]:
    """Yield what is written of a plan that is taken: each flight, and whose it is."""
    opened, plan = offer.going_on.opened, offer.plan
    several = len(opened.scenario.uavs) > 1 or len(plan.tracks) > 1
    for flight, track in zip(plan.flights, plan.tracks, strict=True):
        yield {
            "from_s": offer.going_on.at_s,
            **({"uav": f"UAV {flight.uav + 1}", "flight": flight.number} if several else {}),
            "by": offer.found.attempt.method,
            "took_s": round(offer.took_s, 3),
            "waypoints": waypoints(track, opened.network),
            "sensor_on": track.sensor_on.tolist(),
        }
