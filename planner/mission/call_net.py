"""The net of a call, and what else a call takes from the scenario that has it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from planner.errors import InputError, ScenarioError
from planner.network.net_file import is_net_file
from planner.network.read import open_network
from planner.network.road_network import RoadNetwork
from planner.scenario.sections import OF_SUMO, NetworkSection
from planner.scenario.source import Tables, read_source

OF_NET = ("network", "airspace", "sensor")  # sections that a call takes from a scenario
PATHS = ("nodes", "edges", "connections", "signals", "net", "osm", "within", "no_fly", "fence")


def net_of(net: str) -> tuple[Tables, RoadNetwork]:
    """Return the sections that are the net's, with paths that hold anywhere, and the net itself.

    Parameters
    ----------
    net
        A net's file, or a scenario that has the net.

    Raises
    ------
    InputError
        If the net's section is faulty, or the net cannot be read.
    ScenarioError
        If the scenario cannot be read.
    """
    if net.startswith(OF_SUMO) or is_net_file(Path(net)):
        name = net if net.startswith(OF_SUMO) else Path(net).resolve().as_posix()
        tables: Tables = {"network": {"net": name}}
        folder = Path()
    else:
        source = read_source(net)
        if source.faults:
            raise ScenarioError(net, source.faults)
        folder = source.folder
        tables = {
            key: _absolute(source.tables[key], folder)
            for key in OF_NET
            if isinstance(source.tables.get(key), dict)
        }
    section, errors = NetworkSection.attempt(tables.get("network", {}))
    if errors or section is None:
        raise InputError(f"{net}: its [network] is faulty; `planner check {net}` says where")
    return tables, open_network(section, folder)


def _absolute(table: Mapping[str, Any], folder: Path) -> Tables:
    """Return a section with paths that hold from anywhere."""
    relative = {
        key: value
        for key, value in table.items()
        if key in PATHS and isinstance(value, str) and not value.startswith(OF_SUMO)
    }
    return {
        **table,
        **{key: (folder / value).resolve().as_posix() for key, value in relative.items()},
    }
