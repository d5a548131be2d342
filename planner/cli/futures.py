"""`planner futures`: the recording alone."""

import argparse
import logging
import shutil
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from planner.cli.arguments import add_backend, add_scenario, path
from planner.cli.printing import print_result, summary_lines

if TYPE_CHECKING:
    from planner.futures.clock_error import ClockError
    from planner.futures.store import Recording
    from planner.mission.opening import OpenScenario

log = logging.getLogger(__name__)

SUMMARY = "simulate the particles in SUMO and record their futures"
DETAILS = "Writes futures.parquet, edges.parquet and particles.parquet."
EXAMPLES = (
    ("futures grid5x5", "record them into the cache"),
    ("futures grid5x5 --seed 7 -o runs/futures", "another sample, as tables"),
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner futures`."""
    add_scenario(parser)
    add_backend(parser, what="drive targets", needs="the net at the same place")
    parser.add_argument(
        "-o", "--output", type=path, metavar="DIR", help="also write the files to DIR"
    )
    parser.add_argument("--force", action="store_true", help="overwrite files in DIR")


def run(arguments: argparse.Namespace) -> int:
    """Record the particles' futures and print how many there are."""
    from planner.cli.session import opened_scenario, output_folder, planning_recorded, tell_belief
    from planner.futures.store import FILES, KNOTS

    with ExitStack() as stack:
        folder = output_folder(stack, arguments, FILES)
        opened = opened_scenario(arguments)
        tell_belief(arguments)
        _tell_guess(opened)
        recording = planning_recorded(arguments, opened)
        stored = recording.path
        if folder is not None:
            for name in FILES:
                shutil.copyfile(stored.with_name(name), folder / name)
            stored = arguments.output / KNOTS
    summary: dict[str, Any] = {
        "futures": str(stored),
        "particles": len(recording.futures),
        "knots": len(recording.futures.time_s),
        "first_end_s": float(recording.futures.end_s.min()),
        "last_end_s": float(recording.futures.end_s.max()),
    }
    ends = {key: f"{summary[key]:.1f}" for key in ("first_end_s", "last_end_s")}
    fates = recording.futures.fates
    fared = {} if fates is None else fates.as_json()
    shown = {key: f"{of:.3f}" if isinstance(of, float) else of for key, of in fared.items()}
    lines = summary_lines(summary | ends | shown)
    if fared:
        summary["traffic"] = fared
    error = _clock_error(opened, recording)
    if error is not None:
        summary["clock"] = error.as_json()
        lines.append(str(error))
    if arguments.output is not None:
        lines.append(f"written to {arguments.output}")
    print_result(arguments, summary, lines)
    return 0


def _tell_guess(opened: "OpenScenario") -> None:
    """Say at once how far the cloud will reach, where there is a kinematic clock."""
    if not opened.network.is_abstract:
        from planner.mission.guess import planning_guess, told_reach
        from planner.mission.recorder import Recorder

        guess = planning_guess(Recorder(opened))
        if guess is not None:
            log.warning(told_reach(guess, opened.scenario.search.horizon_s))


def _clock_error(opened: "OpenScenario", recording: "Recording") -> "ClockError | None":
    """Return how far the kinematic clock is off on the scenario's net; None if it has none."""
    if opened.network.is_abstract:
        return None
    from planner.mission.guess import planning_clock_error
    from planner.mission.recorder import Recorder

    return planning_clock_error(Recorder(opened), recording.futures)
