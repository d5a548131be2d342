"""What commands do around their work: open the scenario, record targets, find room for files."""

import argparse
import logging
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from planner.belief.particles import Driving
from planner.cli.arguments import permit_of, scenario_overrides
from planner.cli.backends import backend_of, recorder_of
from planner.cli.progress import progress_bar
from planner.clock import rough
from planner.errors import InputError, OutputError
from planner.files import alone_at, alone_in, results_written_whole, written_whole
from planner.futures.cost import cost_of
from planner.futures.futures import Futures
from planner.futures.record import Note
from planner.futures.store import Recording
from planner.messages import counted
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.own_futures import OwnFutures, read_split
from planner.mission.planning import needs_holdout
from planner.mission.recorder import Recorder
from planner.mission.run_folder import PROVENANCE, own_futures
from planner.progress import Progress, silent
from planner.search.methods import Method

log = logging.getLogger(__name__)

LONG_S = 30.0  # what takes longer is announced


def opened_scenario(arguments: argparse.Namespace, overrides: Sequence[str] = ()) -> OpenScenario:
    """Return the scenario that was named, changed by its own options and by further overrides."""
    backend_of(arguments)  # at fault, it is said before a net is read
    overrides = [*scenario_overrides(arguments), *overrides]
    return open_scenario(
        arguments.scenario,
        preset=arguments.preset,
        overrides=overrides,
        permit=permit_of(arguments),
    )


def futures_of_run(arguments: argparse.Namespace) -> OwnFutures | None:
    """Return the futures that the run was planned on whose run.json is the scenario.

    None if it is another scenario, or the run was planned on its belief.

    Raises
    ------
    InputError
        If their file is gone.
    """
    record = Path(arguments.scenario)
    if record.name != PROVENANCE or not record.is_file():
        return None
    own = own_futures(record.parent)
    for path in own.paths if own is not None else ():
        if not path.is_file():
            raise InputError(
                f"{record}: the run was planned on {path}, which is gone; put it back, or name "
                "the scenario in place of the run"
            )
    return own


def tell_belief(arguments: argparse.Namespace) -> None:
    """Say that a command draws from the belief, where the scenario is a run on other futures."""
    own = futures_of_run(arguments)
    if own is not None:
        log.warning(
            "%s: the run was planned on %s; this command draws from its scenario's belief",
            arguments.scenario,
            ", ".join(map(str, own.paths)),
        )


def tell_own(arguments: argparse.Namespace, own: OwnFutures) -> None:
    """Say that the futures of a run stand in the place of its scenario's belief."""
    log.warning(
        "%s: takes the futures that the run was planned on, %s; name the scenario in place of "
        "the run to draw from its belief",
        arguments.scenario,
        ", ".join(map(str, own.paths)),
    )


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
    stack.enter_context(alone_at(path))
    return stack.enter_context(written_whole(path, replace=arguments.force))


@dataclass(frozen=True)
class Drive:
    """What targets are driven for, and how they drive."""

    title: str  # of the progress
    driving: Driving
    shorter: str  # what makes it take less
    begins: Callable[[int], None] | None = None  # called with how many, before the first

    @classmethod
    def of_belief(cls, title: str, opened: OpenScenario) -> "Drive":
        """Return that of particles, drawn from what is known."""
        shorter = f"fewer (--set search.particles={opened.scenario.search.particles // 2}) take"
        return cls(title, opened.scenario.target.driving, f"{shorter} less")

    @classmethod
    def of_truth(cls, title: str, opened: OpenScenario) -> "Drive":
        """Return that of true targets."""
        return cls(title, opened.scenario.truth.driving, "fewer (--targets 300) take less")


def recorded(
    arguments: argparse.Namespace,
    opened: OpenScenario,
    drive: Drive,
    record: Callable[[Recorder], Recording],
) -> Recording:
    """Return what a recorder records; what takes long is announced, and its progress shown."""
    with progress_bar(drive.title) as progress:
        return record(announcing(arguments, opened, drive, progress))


def announcing(
    arguments: argparse.Namespace,
    opened: OpenScenario,
    drive: Drive,
    progress: Progress = silent,
    *,
    sets: int = 1,
) -> Recorder:
    """Return a recorder that says what is to come before it drives the first target, if any.

    Parameters
    ----------
    sets
        How many sets of targets will be recorded, all as large as the first.
    """
    begun = False

    def on_progress(done: int, total: int, note: str = "", /) -> None:
        nonlocal begun
        if not begun:
            begun = True
            if drive.begins is not None:
                drive.begins(total)
            _announce(arguments, opened, drive, total, sets)
        progress(done, total, note)

    return recorder_of(arguments, opened, on_progress)


def _announce(
    arguments: argparse.Namespace, opened: OpenScenario, drive: Drive, many: int, sets: int
) -> None:
    workers = backend_of(arguments).size(arguments.jobs)
    horizon_s = opened.scenario.search.horizon_s
    each = cost_of(opened.network, many, driving=drive.driving, horizon_s=horizon_s)
    cost = each.times(sets)
    if cost.wall_s(workers) > LONG_S:
        log.warning(
            "%s: %s, about %s with %s; %s",
            drive.title,
            counted(cost.runs, "SUMO run"),
            rough(cost.wall_s(workers)),
            counted(workers, "process", "processes"),
            drive.shorter,
        )


def planning_recorded(arguments: argparse.Namespace, opened: OpenScenario) -> Recording:
    """Return the particles to plan with."""
    drive = Drive.of_belief("recording futures", opened)
    return recorded(arguments, opened, drive, Recorder.planning)


def particles_of_run(arguments: argparse.Namespace, opened: OpenScenario) -> Recording:
    """Return the particles that the run in ``arguments.directory`` was planned on."""
    own = own_futures(arguments.directory)
    return planning_recorded(arguments, opened) if own is None else read_split(own, opened).planning


def evaluation_recorded(
    arguments: argparse.Namespace,
    opened: OpenScenario,
    *,
    begins: Callable[[int], None] | None = None,
    note: Note | None = None,
) -> Recording:
    """Return the fresh targets that plans are evaluated on.

    Parameters
    ----------
    begins
        Called with how many there are before the first one is driven, if any is.
    note
        As `Recorder.evaluation` takes it.
    """
    drive = replace(Drive.of_truth("recording fresh targets", opened), begins=begins)

    def record(recorder: Recorder) -> Recording:
        return recorder.evaluation(arguments.targets, note=note)

    return recorded(arguments, opened, drive, record)


def holdout_recorded(
    arguments: argparse.Namespace,
    opened: OpenScenario,
    method: Method,
    *,
    begins: Callable[[int], None] | None = None,
) -> Futures | None:
    """Return holdout particles for a method that chooses between plans; None if it needs none.

    Parameters
    ----------
    begins
        Called with how many there are before the first one is driven, if any is.
    """
    if not needs_holdout(method, opened):
        return None
    drive = replace(Drive.of_belief("recording holdout particles", opened), begins=begins)
    return recorded(arguments, opened, drive, Recorder.holdout).futures
