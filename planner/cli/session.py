"""What commands do around their work: open the scenario, record targets, find room for files."""

import argparse
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path

from planner.cli.arguments import scenario_overrides
from planner.cli.progress import progress_bar
from planner.errors import OutputError
from planner.files import alone_in, results_written_whole, written_whole
from planner.futures.futures import Futures
from planner.futures.store import Recording
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.recorder import Recorder, needs_holdout
from planner.search.methods import Method


def opened_scenario(arguments: argparse.Namespace, overrides: Sequence[str] = ()) -> OpenScenario:
    """Return the scenario that was named, changed by its own options and by further overrides."""
    overrides = [*scenario_overrides(arguments), *overrides]
    return open_scenario(arguments.scenario, preset=arguments.preset, overrides=overrides)


def new_files(stack: ExitStack, folder: Path, names: Iterable[str], *, force: bool) -> Path:
    """Return a temporary folder whose files move to the given one when the stack closes.

    Raises
    ------
    OutputError
        If one of the named files is there already and may not be replaced, or another command
        is writing there.
    """
    stack.enter_context(alone_in(folder))
    return stack.enter_context(results_written_whole(folder, tuple(names), force=force))


def output_folder(
    stack: ExitStack, arguments: argparse.Namespace, names: Iterable[str]
) -> Path | None:
    """Return `new_files` for the folder of --output; None without that option."""
    if arguments.output is None:
        return None
    return new_files(stack, arguments.output, names, force=arguments.force)


def output_file(stack: ExitStack, arguments: argparse.Namespace) -> Path | None:
    """Return a temporary file that becomes --output when the stack closes; None without it."""
    path: Path | None = arguments.output
    if path is None:
        return None
    if path.exists() and not arguments.force:
        raise OutputError(f"{path}: already exists; name another file, or --force to replace it")
    return stack.enter_context(written_whole(path, replace=arguments.force))


SHORTER = "fewer (--set search.particles=200 --targets 300) take less"


def recorded(
    arguments: argparse.Namespace,
    opened: OpenScenario,
    title: str,
    record: Callable[[Recorder], Recording],
) -> Recording:
    """Return what a recorder records, and show the progress under a title."""
    with progress_bar(title, SHORTER) as progress:
        return record(Recorder(opened, arguments.jobs, progress))


def planning_recorded(arguments: argparse.Namespace, opened: OpenScenario) -> Recording:
    """Return the particles to plan with."""
    return recorded(arguments, opened, "recording futures", Recorder.planning)


def evaluation_recorded(arguments: argparse.Namespace, opened: OpenScenario) -> Recording:
    """Return the fresh targets that plans are evaluated on."""

    def record(recorder: Recorder) -> Recording:
        return recorder.evaluation(arguments.targets)

    return recorded(arguments, opened, "recording fresh targets", record)


def holdout_recorded(
    arguments: argparse.Namespace, opened: OpenScenario, method: Method
) -> Futures | None:
    """Return holdout particles for a method that chooses between plans; None if it needs none."""
    if not needs_holdout(method, opened):
        return None
    return recorded(arguments, opened, "recording holdout particles", Recorder.holdout).futures
