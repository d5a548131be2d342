"""`planner futures`: the recording alone."""

import argparse
import shutil
from contextlib import ExitStack

from planner.cli.arguments import add_scenario, path
from planner.cli.printing import print_result, summary_lines

SUMMARY = "simulate the particles in SUMO and record their futures"
DETAILS = "Writes futures.parquet, edges.parquet and particles.parquet."
EXAMPLES = (
    ("futures grid5x5", "record them into the cache"),
    ("futures grid5x5 --seed 7 -o runs/futures", "another sample, as tables"),
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner futures`."""
    add_scenario(parser)
    parser.add_argument(
        "-o", "--output", type=path, metavar="DIR", help="also write the files to DIR"
    )
    parser.add_argument("--force", action="store_true", help="overwrite files in DIR")


def run(arguments: argparse.Namespace) -> int:
    """Record the particles' futures and print how many there are."""
    from planner.cli.session import opened_scenario, output_folder, planning_recorded
    from planner.futures.store import FILES, KNOTS

    with ExitStack() as stack:
        folder = output_folder(stack, arguments, FILES)
        recording = planning_recorded(arguments, opened_scenario(arguments))
        stored = recording.path
        if folder is not None:
            for name in FILES:
                shutil.copyfile(stored.with_name(name), folder / name)
            stored = arguments.output / KNOTS
    summary = {
        "futures": str(stored),
        "particles": len(recording.futures),
        "knots": len(recording.futures.time_s),
        "first_end_s": float(recording.futures.end_s.min()),
        "last_end_s": float(recording.futures.end_s.max()),
    }
    print_result(arguments, summary, summary_lines(summary))
    return 0
