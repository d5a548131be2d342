"""What commands share: open, record, try a method, find room for files, tell."""

import argparse
import logging
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from planner.cli import print_json
from planner.errors import InputError, OutputError
from planner.files import results_written_whole, written_whole
from planner.futures.futures import Futures
from planner.futures.store import Recording
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.recorder import Recorder, needs_holdout
from planner.mission.trial import Limits, Trial, try_method
from planner.report import tables
from planner.report.progress import progress
from planner.search.methods import Method

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Targets:
    """The recorded targets of a scenario, each set for one use."""

    planning: Recording
    fresh: Recording
    holdout: Futures | None = None


def opened_of(arguments: argparse.Namespace) -> OpenScenario:
    """Return the scenario that is named, with the overrides of the options."""
    overrides = list(arguments.set)
    if arguments.seed is not None:
        overrides.append(f"search.seed={arguments.seed}")
    overrides += _objective_overrides(arguments)
    if getattr(arguments, "free", False):
        if arguments.method != "best":
            raise InputError(f"--free: goes with --method best, not with {arguments.method}")
        overrides.append("search.free=true")
    if getattr(arguments, "tick", None) is not None:
        if arguments.method != "greedy":
            raise InputError(f"--tick {arguments.tick:g}: goes with --method greedy only")
        overrides.append(f"greedy.tick_s={arguments.tick}")
    if arguments.net_file is not None:
        net = str(arguments.net_file.resolve())
        overrides.append(f"network={{ net = {_toml_text(net)} }}")
    return open_scenario(arguments.scenario, preset=arguments.preset, overrides=overrides)


def _objective_overrides(arguments: argparse.Namespace) -> list[str]:
    objective, by_s = getattr(arguments, "objective", None), getattr(arguments, "by", None)
    if by_s is not None and objective != "probability":
        raise InputError(
            f"--by {by_s:g}: goes with --objective probability; give both, or leave it out"
        )
    named = {"search.objective": objective and _toml_text(objective), "search.by_s": by_s}
    return [f"{key}={value}" for key, value in named.items() if value is not None]


def _toml_text(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def output(stack: ExitStack, arguments: argparse.Namespace, names: Iterable[str]) -> Path | None:
    """Return a folder for new files, which move to the output when the stack closes."""
    if arguments.output is None:
        return None
    whole = results_written_whole(arguments.output, tuple(names), force=arguments.force)
    return stack.enter_context(whole)


def output_file(stack: ExitStack, arguments: argparse.Namespace, *, force: bool) -> Path | None:
    """Return a file that takes the place of the output when the stack closes."""
    path: Path | None = arguments.output
    if path is None:
        return None
    if path.exists() and not force:
        raise OutputError(f"{path}: is there already; name another file, or --force to replace it")
    return stack.enter_context(written_whole(path))


def recorded(
    arguments: argparse.Namespace,
    opened: OpenScenario,
    what: str,
    record: Callable[[Recorder], Recording],
) -> Recording:
    """Return what a recorder records, and show how far it is."""
    with progress(what) as told:
        return record(Recorder(opened, arguments.jobs, told))


def evaluation_recorded(arguments: argparse.Namespace, opened: OpenScenario) -> Recording:
    """Return the fresh targets that plans are evaluated on."""

    def record(recorder: Recorder) -> Recording:
        return recorder.evaluation(arguments.targets)

    return recorded(arguments, opened, "recording fresh targets", record)


def holdout_recorded(
    arguments: argparse.Namespace, opened: OpenScenario, method: Method
) -> Futures | None:
    """Return other particles for a method that chooses between plans, if they can be drawn."""
    if not needs_holdout(method, opened) or getattr(arguments, "futures", None) is not None:
        return None
    return recorded(arguments, opened, "recording holdout particles", Recorder.holdout).futures


def trial_of(
    arguments: argparse.Namespace,
    opened: OpenScenario,
    method: Method,
    targets: Targets,
    limits: Limits | None = None,
) -> Trial:
    """Return what a method makes of a scenario, and show how far it is while it plans."""
    limits, search = limits or Limits(), opened.scenario.search
    work = limits.more * search.work
    with progress(f"planning: {method.name}") as shown:

        def told(value: float, done: int) -> None:
            best = f"{value:,.0f} s" if search.objective == "time" else f"{value:.1%} found"
            log.info("best so far %s after %d units of work", best, done)
            shown(min(done, work), work, best)

        return try_method(
            method,
            Recorder(opened, arguments.jobs),
            targets.planning.futures,
            targets.fresh.futures,
            holdout=targets.holdout,
            limits=replace(limits, told=told),
        )


def lines(told: dict[str, Any]) -> list[str]:
    """Return a line for each entry, the values below each other."""
    width = max(map(len, told))
    return [f"{key:{width}}  {value}" for key, value in told.items()]


def tell(arguments: argparse.Namespace, told: dict[str, Any], shown: Sequence[Any]) -> None:
    """Print what there is to tell: plain data for --json, else what is to be shown."""
    if arguments.json:
        print_json(told)
        return
    out = tables.console()
    for thing in shown:
        out.print(thing)
