"""The UAVs of a scenario: at which heights those fly that do not say so."""

from collections.abc import Sequence
from typing import Any

APART_M = 15.0  # in height, that UAVs keep from each other wherever they are
ALTITUDE = "altitude_m"


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
    taken = [height for one in said if (height := _height_m(one)) is not None]
    for one, table in zip(said, tables, strict=True):
        if not isinstance(one, dict) or ALTITUDE in one:
            continue  # it is said, or for others to refuse
        height_m = _height_m({ALTITUDE: usual_m, **table})
        if height_m is None:
            continue
        above = (height_m + APART_M * number for number in range(2 * len(taken) + 1))
        free = [m for m in above if all(abs(m - other_m) >= APART_M for other_m in taken)]
        # Each of the others keeps two of these heights from being free, at most.
        table[ALTITUDE] = min(free, default=height_m)
        taken.append(table[ALTITUDE])
    return tables


def _height_m(table: Any) -> float | None:
    """Return the height that a table says, None if it says none that is a number."""
    height_m = table.get(ALTITUDE) if isinstance(table, dict) else None
    is_number = isinstance(height_m, int | float) and not isinstance(height_m, bool)
    return height_m if is_number else None
