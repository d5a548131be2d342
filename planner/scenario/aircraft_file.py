"""What files say of how an aircraft flies: keys of [uav], for scenarios and for stored plans."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from planner.errors import Fault, InputError, ScenarioError
from planner.guard import read_toml
from planner.messages import as_written, suggestion
from planner.scenario.checks import uav_faults
from planner.scenario.faults import faults_of
from planner.scenario.uav import IDEAL, UavSection

SHIPPED = Path(__file__).with_name("aircraft")
OF_TOWNS = "multicopter"  # whose keys are taken on real nets, if nothing is said
TESTED = "multicopter"  # the one that is held against recorded flights
KEYS = (
    "speed_mps",
    "altitude_m",
    "acceleration_mps2",
    "corner_m",
    "climb_mps",
    "descend_mps",
    "hover",
    "min_speed_mps",
    "max_flight_time_s",
    "reserve_s",
    "wind",
    "link_m",
)

Table = dict[str, Any]


def shipped_aircraft() -> tuple[str, ...]:
    """Return the names of the aircraft that come with the package, sorted."""
    return tuple(sorted(path.stem for path in SHIPPED.glob("*.toml")))


def aircraft_written_out(
    table: Mapping[str, Any], folder: Path, faults: list[Fault], *, abstract: bool
) -> Table:
    """Return a scenario's [uav] with the keys of its aircraft, where it has none of its own.

    Parameters
    ----------
    folder
        Where the path of an aircraft's file starts.
    faults
        To which those of the aircraft are added.
    abstract
        Whether the net is one, on which the ideal aircraft flies if nothing is said; else
        `OF_TOWNS` does.
    """
    name = table.get("aircraft")
    if name is None:
        if abstract:
            return dict(table)
        name = OF_TOWNS
    if name == IDEAL:
        return dict(table)
    if not isinstance(name, str) or "\0" in name:
        known = ", ".join([*shipped_aircraft(), IDEAL])
        text = f"should be a name in quotes, not {as_written(name)}; known: {known}"
        faults.append(Fault("uav.aircraft", text))
        return {key: value for key, value in table.items() if key != "aircraft"}
    try:
        said, found = _said(_path(name, folder, (*shipped_aircraft(), IDEAL)))
    except InputError as error:
        faults.append(Fault("uav.aircraft", str(error)))
        said, found = {}, []
    faults += [Fault("uav.aircraft", f"{name}: {fault.key} {fault.text}") for fault in found]
    return {**said, **table, "aircraft": name}


def with_aircraft(uav: UavSection, place: Path) -> UavSection:
    """Return a scenario's [uav] as a file changes it.

    Parameters
    ----------
    place
        A ``.toml`` file with a table [uav], or the name of an aircraft that comes with the package.

    Raises
    ------
    ScenarioError
        With all faults of the file.
    InputError
        If there is no such file, or it is no TOML.
    """
    path = _path(str(place), Path(), shipped_aircraft())
    said, faults = _said(path)
    table = {**uav.model_dump(mode="json", exclude_none=True), **said, "aircraft": str(place)}
    section, errors = UavSection.attempt(table)
    assert section is not None
    faults += faults_of("uav", UavSection, errors) if errors else uav_faults(section)
    if faults:
        raise ScenarioError(str(path), faults)
    return section


def _said(path: Path) -> tuple[Table, list[Fault]]:
    """Return the keys that an aircraft's file has, and what is wrong with others in it."""
    tables = read_toml(path)
    faults = [
        Fault(key, f"is not of an aircraft; {suggestion(key, ('uav',))}", unknown=True)
        for key in tables
        if key != "uav"
    ]
    said = tables.get("uav", {})
    if not isinstance(said, dict) or not said:
        text = f"should be a table, not {as_written(said)}; give speed_mps"
        return {}, [*faults, Fault("uav", text)]
    faults += [
        Fault(f"uav.{key}", f"is no key of an aircraft; {suggestion(key, KEYS)}", unknown=True)
        for key in said
        if key not in KEYS
    ]
    return {key: value for key, value in said.items() if key in KEYS}, faults


def _path(name: str, folder: Path, known: Sequence[str]) -> Path:
    if name in shipped_aircraft():
        return SHIPPED / f"{name}.toml"
    if (folder / name).is_file():
        return folder / name
    hint = suggestion(name, known)
    raise InputError(f"{name}: is no file and no aircraft that comes with the planner; {hint}")
