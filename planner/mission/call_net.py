"""The net of a call, what a call takes from its scenario, and where targets can go on it."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from planner.belief.ways import quiet_streets, ways_out
from planner.errors import InputError, ScenarioError
from planner.network.net_file import is_net_file
from planner.network.read import open_network
from planner.network.road_network import RoadNetwork
from planner.scenario.profiles import written_out
from planner.scenario.sections import OF_SUMO, NetworkSection
from planner.scenario.source import Tables, read_source

OF_NET = ("network", "airspace", "sensor", "traffic")  # sections that a call takes from a scenario
PATHS = (
    *("nodes", "edges", "connections", "signals", "net", "osm", "within", "no_fly", "fence"),
    *("sumocfg", "routes", "additional"),
)


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


def at_home(profile: str, network: RoadNetwork) -> tuple[Tables, str]:
    """Return what a profile does otherwise on a net that has no such place to go to, and why.

    Returns
    -------
    tuple
        Keys of the target, and what to say of them; {} and "" where it can go wherever it goes.
    """
    places = {
        "leaves": (ways_out(network), "it stays on this net, which no road leaves"),
        "somewhere": (quiet_streets(network), "it heads for no quiet street, as there is none"),
    }
    lacks = {goes: why for goes, (there, why) in places.items() if not len(there.edge)}
    whole = written_out("target", {"profile": profile}, Path(), [])
    parts = whole.get("mix", [whole])
    goes = [part.get("goes") for part in parts] if isinstance(parts, list) else []
    said = "; ".join(why for place, why in lacks.items() if place in goes)
    if not said:
        return {}, ""
    left = [
        {key: value for key, value in part.items() if whole.get(key) != value}
        for part, place in zip(parts, goes, strict=True)
        if not (isinstance(place, str) and place in lacks)
    ]
    return ({"mix": left} if left else {"goes": _anywhere(lacks)}), said


def _anywhere(lacks: Collection[str]) -> str:
    return "turns" if "somewhere" in lacks else "somewhere"


def _absolute(table: Mapping[str, Any], folder: Path) -> Tables:
    """Return a section with paths that hold from anywhere."""

    def absolute(value: Any) -> Any:
        if isinstance(value, list):
            return [absolute(one) for one in value]
        if isinstance(value, str) and not value.startswith(OF_SUMO):
            return (folder / value).resolve().as_posix()
        return value

    return {key: absolute(value) if key in PATHS else value for key, value in table.items()}
