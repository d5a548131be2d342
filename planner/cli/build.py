"""`planner build`: the road network alone."""

import argparse
import shutil
from contextlib import ExitStack

from planner.cli.arguments import add_scenario, path
from planner.cli.printing import print_result, summary_lines

SUMMARY = "build a scenario's road network with netconvert"
DETAILS = ""
EXAMPLES = (("build grid5x5 -o grid.net.xml", "the network, to open in netedit"),)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner build`."""
    add_scenario(parser)
    parser.add_argument(
        "-o", "--output", type=path, metavar="FILE", help="also write the .net.xml to FILE"
    )
    parser.add_argument("--force", action="store_true", help="overwrite FILE")


def run(arguments: argparse.Namespace) -> int:
    """Build the network and print its size."""
    from planner.cli.session import opened_scenario, output_file

    with ExitStack() as stack:
        new = output_file(stack, arguments)
        network = opened_scenario(arguments).network
        if new is not None:
            shutil.copyfile(network.path, new)
    summary = {
        "net": str(arguments.output or network.path),
        "sha256": network.sha256,
        "nodes": len(network.node_ids),
        "roads": len(network.road_ids),
        "length_km": float(network.road_length_m.sum()) / 1000,
    }
    print_result(arguments, summary, summary_lines(summary))
    return 0
