"""`planner build`: the road network alone."""

import argparse
import shutil
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from planner.cli.arguments import add_scenario, path
from planner.cli.printing import print_json, print_result, summary_lines
from planner.errors import InputError
from planner.messages import plain
from planner.xml_guard import kind_of_xml, opened_xml

if TYPE_CHECKING:
    from planner.scenario.sections import Scenario

SUMMARY = "build a scenario's road network with netconvert"
DETAILS = """\
SCENARIO may also be a net: a .net.xml (or .net.xml.gz), a .sumocfg or an
OpenStreetMap file."""
EXAMPLES = (
    ("build grid5x5 -o grid.net.xml", "the network, to open in netedit"),
    ("build --osm a.osm -o a.net.xml", "a town's roads for cars"),
    ("build grid5x5 --show", "the scenario with all its defaults"),
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner build`."""
    add_scenario(parser, optional=True)
    parser.add_argument(
        "--osm", type=path, metavar="FILE", help="build this OpenStreetMap file (.osm, .osm.gz)"
    )
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
    from planner.cli.nets import opened_net
    from planner.cli.session import output_file

    _take_osm(arguments)
    with ExitStack() as stack:
        new = output_file(stack, arguments)
        network, opened = opened_net(arguments)
        if new is not None:
            _copy(network.path, new, packed=arguments.output.suffix == ".gz")
    if arguments.show:
        if opened is None:
            raise InputError(f"{arguments.scenario}: is a net; --show goes with a scenario")
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
    told = dict(summary)
    if opened is None:  # what is one road to a sensor is not known yet
        del told["roads"]
    print_result(arguments, summary, summary_lines(told))
    return 0


def _take_osm(arguments: argparse.Namespace) -> None:
    """Let an OpenStreetMap file stand in the scenario's place."""
    if (arguments.osm is None) == (arguments.scenario is None):
        raise InputError("build: give a SCENARIO, a net, or --osm FILE; one of them")
    if arguments.osm is not None:
        if kind_of_xml(arguments.osm) != "osm":
            raise InputError(f"--osm {arguments.osm}: is no OpenStreetMap file in XML")
        arguments.scenario = str(arguments.osm)


def _copy(net: Path, new: Path, *, packed: bool) -> None:
    """Write a net, which may be packed, as it is to be."""
    import gzip

    with opened_xml(net) as file, new.open("wb") as out:
        if packed:
            with gzip.GzipFile(fileobj=out, mode="wb", filename="", mtime=0) as inside:
                shutil.copyfileobj(file, inside)
        else:
            shutil.copyfileobj(file, out)


def _show(arguments: argparse.Namespace, scenario: "Scenario") -> None:
    """Print a scenario as it stands in no file: whole, line by line however wide."""
    from planner.scenario.toml_text import scenario_text

    if arguments.json:
        print_json(scenario.as_dict())
        return
    for line in scenario_text(scenario).split("\n"):
        print(plain(line))
