"""Files that say how an aircraft flies, for plans that were made without: some keys of [uav]."""

from pathlib import Path
from typing import Any

from planner.errors import Fault, InputError, ScenarioError
from planner.guard import read_toml
from planner.messages import as_written, suggestion
from planner.scenario.checks import uav_faults
from planner.scenario.faults import faults_of
from planner.scenario.sections import UavSection

SHIPPED = Path(__file__).with_name("aircraft")
KEYS = (
    "speed_mps",
    "altitude_m",
    "acceleration_mps2",
    "corner_m",
    "climb_mps",
    "descend_mps",
    "max_flight_time_s",
    "reserve_s",
    "wind",
)


def shipped_aircraft() -> tuple[str, ...]:
    """Return the names of the aircraft that come with the package, sorted."""
    return tuple(sorted(path.stem for path in SHIPPED.glob("*.toml")))


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
    path = _path(place)
    tables = read_toml(path)
    faults = [
        Fault(key, f"is not of an aircraft; {suggestion(key, ('uav',))}", unknown=True)
        for key in tables
        if key != "uav"
    ]
    said = tables.get("uav", {})
    if not isinstance(said, dict) or not said:
        faults.append(Fault("uav", f"should be a table, not {as_written(said)}; give speed_mps"))
        raise ScenarioError(str(path), faults)
    faults += [
        Fault(f"uav.{key}", f"is no key of an aircraft; {suggestion(key, KEYS)}", unknown=True)
        for key in said
        if key not in KEYS
    ]
    section, found = _changed(uav, {key: value for key, value in said.items() if key in KEYS})
    if faults or found:
        raise ScenarioError(str(path), [*faults, *found])
    assert section is not None
    return section


def _changed(uav: UavSection, said: dict[str, Any]) -> tuple[UavSection | None, list[Fault]]:
    table = {**uav.model_dump(mode="json", exclude_none=True), **said}
    section, errors = UavSection.attempt(table)
    if errors or section is None:
        return section, [*faults_of("uav", UavSection, errors)]
    return section, [*uav_faults(section)]


def _path(place: Path) -> Path:
    if str(place) in shipped_aircraft():
        return SHIPPED / f"{place}.toml"
    if place.is_file():
        return place
    known = suggestion(str(place), shipped_aircraft())
    raise InputError(f"{place}: is no file and no aircraft that comes with the planner; {known}")
