"""Times as people and SUMO write them, H:M:S, D:H:M:S or a moment: read and written."""

import datetime
import re
from contextlib import suppress

from planner.errors import InputError
from planner.messages import as_written

EARLIEST_YEAR, LATEST_YEAR = 1900, 3000  # in between, no zone and no horizon overflow anything


def seconds(value: object) -> float:
    """Return the seconds of a number of seconds, or of a text "H:M:S" or "D:H:M:S".

    Raises
    ------
    InputError
        If it is neither.
    """
    if isinstance(value, datetime.time):  # TOML reads 01:30:00 without quotes as a time of day
        value = value.isoformat()
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if isinstance(value, str):
        parts = re.fullmatch(
            r"(?:(\d{1,9}):)?(\d{1,9}):([0-5]?\d):([0-5]?\d(?:\.\d*)?)", value.strip(), re.ASCII
        )
        if parts is not None:
            hours = int(parts[1] or 0) * 24.0 + int(parts[2])
            return hours * 3600.0 + int(parts[3]) * 60.0 + float(parts[4])
        if re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", value.strip()):
            return float(value)
    raise InputError(
        f'should be seconds or "H:M:S", not {as_written(value)}; write 5400 or "1:30:00"'
    )


def moment(value: object) -> datetime.datetime:
    """Return the moment of an offset date-time, as TOML has it or as a text of RFC 3339.

    Raises
    ------
    InputError
        If it is neither, or does not say how far its zone is from UTC.
    """
    example = "write 2026-05-01T14:05:00+02:00"
    if isinstance(value, str):
        with suppress(ValueError):
            value = datetime.datetime.fromisoformat(value.strip())
    if not isinstance(value, datetime.datetime):
        raise InputError(f"should be a date and a time, not {as_written(str(value))}; {example}")
    if not EARLIEST_YEAR < value.year < LATEST_YEAR:
        raise InputError(f"the year {value.year} is out of reach; {example}")
    if value.tzinfo is None:
        raise InputError(
            f"{value.isoformat()} does not say in which zone; add its offset from UTC, as in "
            f"{value.isoformat()}+02:00, or Z for UTC"
        )
    return value


def sumo_seconds(text: str) -> float:
    """Return the seconds of a time as SUMO writes it: seconds, "H:M:S" or "D:H:M:S".

    Raises
    ------
    InputError
        If it is none of these.
    """
    parts = re.fullmatch(r"([+-]?)(\d{1,9}):(.+)", text.strip())
    if parts is not None and parts[3].count(":") == 2:
        later_s = int(parts[2]) * 86400.0 + seconds(parts[3])
        return -later_s if parts[1] == "-" else later_s
    if parts is not None and parts[1]:
        later_s = seconds(text.strip()[1:])
        return -later_s if parts[1] == "-" else later_s
    return seconds(text)


def clock(time_s: float) -> str:
    """Return a time as H:MM:SS, to the nearest second."""
    sign, whole = ("-", -round(time_s)) if round(time_s) < 0 else ("", round(time_s))
    minutes, second = divmod(whole, 60)
    hours, minute = divmod(minutes, 60)
    return f"{sign}{hours}:{minute:02d}:{second:02d}"


def rough(time_s: float) -> str:
    """Return a duration in words, to the digits that an estimate has."""
    if time_s < 100:
        return f"{max(1, round(time_s)):,} s"
    minutes = time_s / 60
    return f"{minutes:,.0f} min" if minutes < 100 else f"{minutes / 60:,.1f} h"
