"""News, as `planner replan` takes it, and what it means for a run."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from planner.cli.arguments import metres, path, share
from planner.errors import InputError
from planner.guard import parsed_json, read_text
from planner.mission.debrief import Wanted, reading_of
from planner.mission.heard import Heard
from planner.mission.news_values import Setting
from planner.mission.news_words import heard, sentence
from planner.mission.opening import OpenScenario
from planner.mission.plan_file import StoredPlan
from planner.scenario.news import MOST_NEWS

LARGEST_NEWS = 64 << 20  # bytes


def add_news(parser: argparse.ArgumentParser) -> None:
    """Add what has come in."""
    parser.add_argument(
        "--report",
        action="append",
        default=[],
        metavar="TEXT",
        help='"seen at PLACE at 14:20, 70 %% sure, within 200 m", of several targets "red seen at '
        '...", or "nothing at PLACE from 14:10 to 14:20, 80 %%"; repeatable',
    )
    parser.add_argument(
        "--news", type=path, metavar="FILE", help="news as lines of JSON (docs/formats.md)"
    )
    parser.add_argument(
        "--searched",
        type=path,
        metavar="TRACK",
        help="a flight of somebody else that has not found it: GPX, CSV, FCD, .tlog or .bin",
    )
    parser.add_argument(
        "--radius-m", type=metres, metavar="R", help="with --searched: how far its sensor sees"
    )
    parser.add_argument(
        "--detects",
        type=share,
        metavar="P",
        help="with --searched: how probably one pass sees a target (default: 1)",
    )
    parser.add_argument(
        "--found",
        action="append",
        default=[],
        metavar="NAME",
        help="which of several targets is found: its name, or its number from 1; repeatable",
    )
    parser.add_argument(
        "--same-source",
        action="store_true",
        help="the report is from who gave the last one, which it replaces",
    )
    parser.add_argument(
        "--insist",
        action="store_true",
        help="have a report count that hardly can be true by what is believed",
    )


def setting_of(opened: OpenScenario, stored: StoredPlan, at_s: float, folder: Path) -> Setting:
    """Return where and when news of a run is said."""
    reading = replace(reading_of(opened, stored, Wanted()), sensor_from_m=0.0)
    sighted_at = opened.scenario.target.sighted_at
    names = opened.scenario.target_names
    return Setting(opened.network, sighted_at, at_s, folder, names, reading)


def heard_of(arguments: argparse.Namespace, setting: Setting) -> Heard:
    """Return what all that was said means.

    Raises
    ------
    InputError
        Naming the option, or the file and its line.
    """
    found = Heard(same_source=arguments.same_source, insist=arguments.insist)
    if arguments.found and len(setting.targets) == 1:
        raise InputError("--found: there is one target; once it is found there is nothing to plan")
    for text in arguments.report:
        with named("--report"):
            found = found.then(heard(sentence(text), setting))
    for name in arguments.found:
        with named("--found"):
            found = found.then(heard({"kind": "found", "target": name}, setting))
    if arguments.news is not None:
        for one in news_of_file(arguments.news, setting):
            found = found.then(one)
    if arguments.searched is not None:
        if arguments.radius_m is None:
            raise InputError("--searched: goes with --radius-m, how far its sensor sees; give both")
        line: dict[str, Any] = {"kind": "searched", "track": str(arguments.searched.resolve())}
        line |= {"radius_m": arguments.radius_m}
        line |= {} if arguments.detects is None else {"detects": arguments.detects}
        with named("--searched"):
            found = found.then(heard(line, setting))
    elif arguments.radius_m is not None or arguments.detects is not None:
        raise InputError("--radius-m, --detects: go with --searched; give it, or neither of them")
    return found


def news_of_file(file: Path, setting: Setting) -> Iterator[Heard]:
    """Yield what each line of a file means."""
    lines = read_text(file, LARGEST_NEWS).splitlines()
    if sum(bool(text.strip()) for text in lines) > MOST_NEWS:
        raise InputError(
            f"{file}: has more than {MOST_NEWS} pieces of news; leave those out that say least"
        )
    for number, text in enumerate(lines, 1):
        if text.strip():
            with named(f"{file}: line {number}"):
                yield heard(line_of(text), setting._replace(folder=file.parent))


def line_of(text: str) -> dict[str, Any]:
    """Return what a line of JSON holds."""
    try:
        line = parsed_json(text)
    except ValueError as error:
        raise InputError(f"is no JSON ({error}); write one object a line") from error
    if not isinstance(line, dict):
        raise InputError('is no object; write {"kind": "report", ...}')
    return line


@contextmanager
def named(where: str) -> Iterator[None]:
    """Name where a fault is that is found meanwhile."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{where}: {error}") from error
