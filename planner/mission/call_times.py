"""The words of a call that say with what the drone flies, and when."""

from collections.abc import Mapping
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

from planner.clock import rough, span, to_minute, to_second, when
from planner.errors import InputError
from planner.messages import as_written
from planner.mission.call_words import Faults, Words
from planner.scenario.aircraft_file import OF_TOWNS, shipped_aircraft, with_aircraft
from planner.scenario.uav import UavSection

TO_PLAN_S = 60.0  # until take-off, where nobody says when the drone is ready
LASTS_S = 1800.0  # how long is searched, where the aircraft has no limit
FARTHEST = timedelta(days=2)  # from now; what is farther away is another day, or a slip


class Aircraft(NamedTuple):
    """What flies."""

    keys: dict[str, Any]  # of [uav]: the aircraft, and its time in the air
    said: str  # as it was understood


class Times(NamedTuple):
    """When the target was seen, when the drone is ready, and when the search ends."""

    ago_s: float  # before the call
    ready_s: float  # after it
    horizon_s: float  # after the target was seen
    at: str  # as they were understood
    ready: str
    until: str


def aircraft(words: Words, faults: Faults) -> Aircraft | None:
    """Return what flies, and for how long; None if that is not understood."""
    given = words.aircraft or Path(OF_TOWNS)
    stand_in = UavSection.model_validate({"start": {"x_m": 0, "y_m": 0}})
    section = faults.tried("--aircraft", lambda: with_aircraft(stand_in, given))
    if section is None:
        return None
    is_shipped = str(given) in shipped_aircraft()
    keys: dict[str, Any] = {"aircraft": str(given) if is_shipped else given.resolve().as_posix()}
    lasts_s = section.max_flight_time_s
    if words.battery is not None:
        text = words.battery
        lasts_s = faults.tried("--battery", lambda: _battery_s(text))
        if lasts_s is None:
            return None
    if lasts_s is not None:
        keys["max_flight_time_s"] = lasts_s
    limit = "without a limit" if lasts_s is None else f"up to {rough(lasts_s)} in the air"
    name = given.name.removesuffix(".toml")
    return Aircraft(keys, f"{name}, {section.speed_mps:g} m/s, {limit}")


def times(words: Words, now: datetime, uav: Mapping[str, Any], faults: Faults) -> Times | None:
    """Return when all of it is; None if that is not understood.

    Parameters
    ----------
    uav
        Keys of ``[uav]``, as far as they are known.
    """
    at = faults.tried("--at", lambda: _past(words.at, now))
    ready = faults.tried("--ready", lambda: _ready(words.ready, now))
    until = None
    if words.until is not None:
        text = words.until
        until = faults.tried("--until", lambda: _soon(text, now))
    if at is None or ready is None or (until is None and words.until is not None):
        return None
    ago_s, ready_s = (now - at).total_seconds(), (ready - now).total_seconds()
    if until is None:
        lasts_s = uav.get("max_flight_time_s", LASTS_S)
        until = now + timedelta(seconds=max(ready_s, TO_PLAN_S) + lasts_s)
    if until.second or until.microsecond:  # odds are told at whole minutes
        until = until.replace(second=0, microsecond=0) + timedelta(minutes=1)
    horizon_s = (until - at).total_seconds()
    if horizon_s <= ago_s + ready_s:
        ends, begins = to_minute(until, now), to_second(ready, now)
        text = f"{ends} is not after the drone is ready, {begins}; give a later one"
        faults.add("--until", text)
        return None
    soon = "as soon as there is a plan" if words.ready is None else to_second(ready, now)
    seen = f"{to_second(at, now)}, {_ago(ago_s)}"
    return Times(ago_s, ready_s, horizon_s, seen, soon, to_minute(until, now))


def _past(text: str, now: datetime) -> datetime:
    at = when(text, now)
    if at > now:
        raise InputError(f"{to_second(at, now)} is still to come; give when it was seen")
    if now - at > FARTHEST:
        ago = _ago((now - at).total_seconds())
        raise InputError(f"{at.isoformat()} is {ago}, too long for a call; give a later one")
    return at.astimezone(now.tzinfo).replace(microsecond=0)


def _soon(text: str, now: datetime) -> datetime:
    soon = when(text, now)
    if soon - now > FARTHEST:
        at, away = to_second(soon, now), rough((soon - now).total_seconds())
        raise InputError(f"{at} is {away} away, too long for a call; give an earlier one")
    return soon


def _ready(text: str | None, now: datetime) -> datetime:
    ready = now if text is None else _soon(text, now)
    if ready < now:
        raise InputError(f"{to_second(ready, now)} has passed; leave it out")
    return ready.astimezone(now.tzinfo).replace(microsecond=0)


def _battery_s(text: str) -> float:
    lasts_s = span(text)
    if not 0.0 < lasts_s <= FARTHEST.total_seconds():
        raise InputError(f"{as_written(text)} is no time in the air; write how long, as 25min")
    return lasts_s


def _ago(seconds: float) -> str:
    return "now" if seconds < 1.0 else f"{rough(seconds)} ago"
