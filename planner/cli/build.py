"""`planner build`: the road network alone."""

import argparse
import shutil
from contextlib import ExitStack
from typing import TYPE_CHECKING

from planner.cli.arguments import add_scenario, path
from planner.cli.printing import print_json, print_result, summary_lines
from planner.messages import plain

if TYPE_CHECKING:
    from planner.scenario.sections import Scenario

SUMMARY = "build a scenario's road network with netconvert"
DETAILS = ""
EXAMPLES = (
    ("build grid5x5 -o grid.net.xml", "the network, to open in netedit"),
    ("build grid5x5 --show", "the scenario with all its defaults"),
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner build`."""
    add_scenario(parser)
    parser.add_argument(
        "-o", "--output", type=path, metavar="FILE", help="also write the .net.xml to FILE"
    )
    parser.add_argument("--force", action="store_true", help="overwrite FILE")
    parser.add_argument(
        "--show",
        action="store_true",
        help="print the whole scenario as TOML, with its defaults and what each key means",
    )


def run(arguments: argparse.Namespace) -> int:
    """Build the network and print its size."""
    from planner.cli.session import opened_scenario, output_file

    with ExitStack() as stack:
        new = output_file(stack, arguments)
        opened = opened_scenario(arguments)
        network = opened.network
        if new is not None:
            shutil.copyfile(network.path, new)
    if arguments.show:
        _show(arguments, opened.scenario)
        return 0
    summary = {
        "net": str(arguments.output or network.path),
        "sha256": network.sha256,
        "nodes": len(network.node_ids),
        "roads": len(network.road_ids),
        "edges": len(network.edge_ids),
        "length_km": float(network.road_length_m.sum()) / 1000,
        **network.credit,
    }
    print_result(arguments, summary, summary_lines(summary))
    return 0


def _show(arguments: argparse.Namespace, scenario: "Scenario") -> None:
    """Print a scenario as it stands in no file: whole, line by line however wide."""
    from planner.scenario.toml_text import scenario_text

    if arguments.json:
        print_json(scenario.as_dict())
        return
    for line in scenario_text(scenario).split("\n"):
        print(plain(line))
