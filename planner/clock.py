"""Times as people and SUMO write them, H:M:S, D:H:M:S or a moment: read and written."""

import datetime
import re
from contextlib import suppress

from planner.errors import InputError
from planner.messages import as_written

UNITS_S = {
    "": 1.0,
    **dict.fromkeys(("s", "sec", "second", "seconds"), 1.0),
    **dict.fromkeys(("m", "min", "mins", "minute", "minutes"), 60.0),
    **dict.fromkeys(("h", "hour", "hours"), 3600.0),
}
LONGEST_S = 1e9  # from now to a moment that is said in words; 31 years
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


def when(text: str, now: datetime.datetime) -> datetime.datetime:
    """Return the moment that a text means: "14:05", "-7min", "+3min", or a date and a time.

    A time of day is the one nearest to now; what does not say in which zone it is, is in now's.

    Parameters
    ----------
    now
        With its offset from UTC.

    Raises
    ------
    InputError
        If it means none.
    """
    said = text.strip()
    if said.casefold() == "now":
        return now
    if said[:1] in ("+", "-"):
        ahead_s = span(said[1:])
        if ahead_s > LONGEST_S:
            raise InputError(f"{as_written(text)} is out of reach; write a few minutes, as -7min")
        return now + datetime.timedelta(seconds=-ahead_s if said[0] == "-" else ahead_s)
    day = re.fullmatch(r"(\d{1,2})[:.](\d{2})(?:[:.](\d{2}))?", said, re.ASCII)
    if day is not None and int(day[1]) < 24 and int(day[2]) < 60 and int(day[3] or 0) < 60:
        today = now.replace(
            hour=int(day[1]), minute=int(day[2]), second=int(day[3] or 0), microsecond=0
        )
        days = (today + datetime.timedelta(days=some) for some in (0, -1, 1))
        return min(days, key=lambda moment: abs(moment - now))
    with suppress(ValueError):
        found = datetime.datetime.fromisoformat(said)
        return moment(found if found.tzinfo else found.replace(tzinfo=now.tzinfo))
    raise InputError(
        f"{as_written(text)} is no time; write 14:05, -7min, or 2026-05-01T14:05:00+02:00"
    )


def span(text: str) -> float:
    """Return the seconds of a duration in words: "25min", "90 s", "1h", "1:30:00" or seconds.

    Raises
    ------
    InputError
        If it is none.
    """
    found = re.fullmatch(r"(\d+\.?\d*)\s*([a-z]*)", text.strip().casefold(), re.ASCII)
    if found is not None and found[2] in UNITS_S:
        return float(found[1]) * UNITS_S[found[2]]
    try:
        lasts_s = seconds(text)
    except InputError:
        lasts_s = -1.0
    if lasts_s < 0.0:
        raise InputError(f"{as_written(text)} is no duration; write 25min, 90s or 1:30:00")
    return lasts_s


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


def to_second(moment: datetime.datetime, now: datetime.datetime | None = None) -> str:
    """Return a moment as a watch shows it, H:M:S, for what somebody has to do then.

    Parameters
    ----------
    now
        In whose zone it is told, with the date if that is not today's; None: in its own, without.
    """
    return _of_day(moment, now, "%H:%M:%S")


def to_minute(moment: datetime.datetime, now: datetime.datetime | None = None) -> str:
    """Return a moment by which something is so, H:M: the next whole minute.

    Parameters
    ----------
    now
        As `to_second` takes it.
    """
    past_s = moment.second + moment.microsecond / 1e6
    return _of_day(moment + datetime.timedelta(seconds=-past_s % 60.0), now, "%H:%M")


def _of_day(moment: datetime.datetime, now: datetime.datetime | None, form: str) -> str:
    there = moment if now is None else moment.astimezone(now.tzinfo)
    is_today = now is None or there.date() == now.date()
    return there.strftime(form if is_today else f"%Y-%m-%d {form}")


def rough(time_s: float) -> str:
    """Return a duration in words, to the digits that an estimate has."""
    if time_s < 100:
        return f"{max(1, round(time_s)):,} s"
    minutes = time_s / 60
    return f"{minutes:,.0f} min" if minutes < 100 else f"{minutes / 60:,.1f} h"
