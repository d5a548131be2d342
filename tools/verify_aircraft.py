"""What a scenario says of how a UAV's aircraft flies, beside what plan.json says, for verify.py.

Bounds rest on the scenario alone. docs/formats.md has the fields.
"""

import math
from collections.abc import Iterator
from typing import Any

from verify_files import Fields, RefusedError

RATES = ("acceleration_mps2", "corner_m", "climb_mps", "descend_mps")
REAL = ("acceleration_mps2", "climb_mps", "descend_mps", "reserve_s", "wind")  # one is enough


def value(section: Fields, key: str) -> Any:
    """Return what a scenario says of a UAV; null and nothing said are the same."""
    return section.any(key) if key in section else None


def is_real(section: Fields) -> bool:
    """Tell whether a scenario says how a UAV flies; else it is the ideal one."""
    return not _hovers(section) or any(value(section, key) is not None for key in REAL)


def climb_s(section: Fields) -> float:
    """Return how long a UAV climbs before it searches."""
    rate_mps = _rate(section, "climb_mps")
    return 0.0 if rate_mps is None else section.number("altitude_m", 0.0) / rate_mps


def strays_m(section: Fields) -> float:
    """Return how far a UAV may be beside its line."""
    corner_m = _rate(section, "corner_m") if is_real(section) else None
    return 0.0 if corner_m is None else corner_m


def wind_mps(section: Fields) -> tuple[float, float]:
    """Return where the air moves to, east and north."""
    if value(section, "wind") is None:
        return 0.0, 0.0
    wind = section.part("wind")
    mps, angle = wind.number("speed_mps", 0.0), math.radians(wind.number("from_deg"))
    return -mps * math.sin(angle), -mps * math.cos(angle)


def flown_as_said(flight: Fields, section: Fields) -> Iterator[tuple[str, Any, Any]]:
    """Yield what plan.json says of a flight's aircraft beside the scenario: name, claimed, found.

    Raises
    ------
    RefusedError
        If one of them says how the aircraft flies and the other does not.
    """
    if ("aircraft" in flight) != is_real(section):
        raise RefusedError(f"{flight.where}: has an aircraft if, and only if, the scenario has one")
    if "aircraft" not in flight:
        return
    aircraft = flight.part("aircraft")
    for key in RATES:
        yield f"{key} of the scenario", aircraft.maybe(key), _rate(section, key)
    hovers = _hovers(section)
    yield "hover of the scenario", aircraft.flag("hover"), hovers
    least_mps = None if hovers else value(section, "min_speed_mps") or 0.0
    yield "min_speed_mps of the scenario", aircraft.maybe("min_speed_mps"), least_mps
    said = zip(("east", "north"), aircraft.items("wind_mps", 2), wind_mps(section), strict=True)
    for way, claimed, found in said:
        yield f"wind to the {way} of the scenario", claimed, found
    lands = value(section, "return_to") is not None
    yield "landing of the scenario", flight.any("landing") is not None, lands


def _hovers(section: Fields) -> bool:
    return value(section, "hover") is None or section.flag("hover")


def _rate(section: Fields, key: str) -> float | None:
    return None if value(section, key) is None else section.above_zero(key)
