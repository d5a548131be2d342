"""The UAVs of a scenario: one table [uav], or a list of tables [[uav]]; and at which heights."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from planner.errors import Fault

APART_M = 15.0  # in height, that UAVs keep from each other wherever they are
ALTITUDE = "altitude_m"

Table = Mapping[str, Any]


def uav_tables(said: Any) -> list[tuple[str, Any]]:
    """Return the table of each UAV by its key: ``uav`` if there is one, else ``uav[0]`` and on.

    A list of one is that one; what is neither a table nor a list is one, and for others to refuse.
    """
    if not isinstance(said, list):
        return [("uav", said)]
    if len(said) == 1:
        return [("uav", said[0])]
    return [(f"uav[{number}]", table) for number, table in enumerate(said)]


def named_for(key: str, faults: Sequence[Fault] | Iterator[Fault]) -> Iterator[Fault]:
    """Yield faults of a UAV with its own key, wherever they name ``uav``."""
    for fault in faults:
        own = replace(fault, text=fault.text.replace("uav.", f"{key}."))
        yield replace(own, key=key + fault.key[3:]) if fault.is_about("uav") else own


def with_heights(said: Sequence[Any], full: Sequence[Any], usual_m: float) -> list[Any]:
    """Return the UAVs' tables, each with a height of its own where it does not say one.

    Such a UAV flies at the usual height of its aircraft, or as many times `APART_M` higher as keep
    it apart from all others.

    Parameters
    ----------
    said
        What the scenario says of each UAV.
    full
        The same with the keys of their aircraft.
    usual_m
        The height of an aircraft that says none.
    """
    tables = [dict(table) if isinstance(table, dict) else table for table in full]
    taken = [
        float(one[ALTITUDE])
        for one in said
        if isinstance(one, dict) and isinstance(one.get(ALTITUDE), int | float)
    ]
    for one, table in zip(said, tables, strict=True):
        if not isinstance(one, dict) or ALTITUDE in one:
            continue
        height_m = table.get(ALTITUDE, usual_m)
        if not isinstance(height_m, int | float):
            continue  # for others to refuse
        while any(abs(height_m - other_m) < APART_M for other_m in taken):
            height_m += APART_M
        table[ALTITUDE] = height_m
        taken.append(float(height_m))
    return tables
