"""`planner new`: a call in words, written as a scenario file."""

import argparse
from contextlib import ExitStack
from datetime import datetime
from pathlib import Path

from planner.cli import call_arguments
from planner.cli.arguments import path, permit_of
from planner.cli.printing import print_result

SUMMARY = "write a call in words as a scenario file, and plan nothing"
DETAILS = call_arguments.DETAILS
EXAMPLES = (
    ('new berlin --last-seen "Am Studio" --at -2min --drone-at 52.43,13.52', ""),
    ("new x.osm --last-seen 52.43,13.53 --at 14:05 --drone-at 52.43,13.52", ""),
)
FILE = Path("call.toml")


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner new`."""
    call_arguments.add_call(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=path,
        default=FILE,
        metavar="FILE",
        help="the scenario file (default: %(default)s)",
    )
    parser.add_argument("--force", action="store_true", help="overwrite FILE")


def run(arguments: argparse.Namespace) -> int:
    """Write the scenario of a call."""
    from planner.cli.session import output_file

    call = call_arguments.call_of(arguments, datetime.now().astimezone())
    with ExitStack() as stack:
        file = output_file(stack, arguments)
        assert file is not None
        call_arguments.write_call(call, file, arguments.net, permit_of(arguments))
    written = [f"written to {arguments.output}", f"to plan it: planner plan {arguments.output}"]
    summary = {"understood": [*map(list, call.understood)], "file": str(arguments.output)}
    print_result(arguments, summary, [*call_arguments.lines_of(call), *written])
    return 0
