"""What a line of news says under each key: times, spans, places, shares, numbers and targets.

What is not understood is refused in one line that names the key and the remedy.
"""

import math
import re
from collections.abc import Mapping
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from planner.clock import seconds, span, when
from planner.errors import InputError
from planner.messages import as_written, suggestion
from planner.network.georeference import coordinates
from planner.network.place_words import Where, on_road, where
from planner.network.road_network import RoadNetwork
from planner.telemetry.flown import Reading

NUMBER = r"(?:\d+(?:\.\d*)?|\.\d+)"


class Setting(NamedTuple):
    """Where and when words are said."""

    network: RoadNetwork
    sighted_at: datetime | None  # which moment time 0 is; None: nobody said
    now_s: float  # seconds on the target's clock
    folder: Path = Path()  # where relative paths start
    targets: tuple[str, ...] = ("the target",)  # what each is called, by number
    reading: Reading | None = None  # how recorded flights are understood; None: there are none


class Said:
    """The values of one line of news, by key.

    What is asked for raises an InputError if it is missing or makes no sense.
    """

    def __init__(self, line: Mapping[str, Any], setting: Setting) -> None:
        self._line, self._setting = line, setting

    def target(self) -> Any:
        """Return which target news is of, from 0 on; it is said by its name, or by its number."""
        names = self._setting.targets
        said = self._line.get("target")
        if len(names) == 1:
            return 0 if said is None or said in names else said
        if said is None:
            raise InputError(f"target: is missing; give which it is: {', '.join(names)}")
        if said in names:
            return names.index(said)
        number = int(said) if str(said).isdecimal() else 0  # as it is printed, from 1 on
        if not 1 <= number <= len(names):
            hint = f"{suggestion(str(said), names)}, or 1 to {len(names)}"
            raise InputError(f"target: {as_written(said)} is none of the targets; {hint}")
        return number - 1

    def called(self, target: Any) -> str:
        """Return of which target something is said; nothing where there is one."""
        names = self._setting.targets
        known = len(names) > 1 and target in range(len(names))
        return f": {names[target]}" if known else ""

    def place(self, *, moved: bool = True) -> Where:
        """Return the place; one in words is on a road of the net, unless it is not to be moved."""
        said = self._line.get("place")
        if isinstance(said, Mapping) and {*said} == {"x_m", "y_m"}:
            x_m, y_m = (_finite(f"place.{key}", said[key]) for key in ("x_m", "y_m"))
            return Where(x_m, y_m, coordinates(self._setting.network, np.array([x_m, y_m])))
        if not isinstance(said, str):
            raise InputError("place: should be a place in words, or { x_m, y_m }; give one")
        place = where(said, self._setting.network)
        if place.edges or not moved or self._setting.network.is_abstract:
            return place
        return on_road(said, place, self._setting.network)[0]

    def time(self, key: str) -> float:
        """Return a time, seconds on the target's clock."""
        return time_of(key, self._line.get(key), self._setting)

    def span(self, key: str) -> float:
        """Return how long something lasts, seconds."""
        value = self._line.get(key)
        if isinstance(value, str):
            return span(value)
        if value is None or _finite(key, value) < 0.0:
            raise InputError(f"{key}: is missing, or negative; give how long, as 90s or 2min")
        return _finite(key, value)

    def share(self, key: str) -> float:
        """Return a probability; in words it may be percent."""
        value = self._line.get(key)
        if isinstance(value, str):
            found = re.fullmatch(rf"({NUMBER})\s*(%?)", value.strip())
            value = float(found[1]) / (100.0 if found[2] else 1.0) if found else None
        if not isinstance(value, int | float) or isinstance(value, bool) or not 0 <= value <= 1:
            raise InputError(f"{key}: should be a probability; write 0.7 or 70 %")
        return float(value)

    def number(self, key: str, usual: float) -> float:
        """Return a finite number, or the usual one where nothing is said."""
        value = self._line.get(key, usual)
        is_number = isinstance(value, str) and re.fullmatch(NUMBER, value.strip())
        return float(value) if is_number else _finite(key, value)

    def flag(self, key: str) -> bool:
        """Return whether something is so; where nothing is said it is not."""
        value = self._line.get(key, False)
        if not isinstance(value, bool):
            raise InputError(f"{key}: should be true or false, not {as_written(value)}")
        return value


def _finite(key: str, value: object) -> float:
    """Return a finite number."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value):  # type: ignore[arg-type]
        raise InputError(f"{key}: should be a number, not {as_written(value)}")
    return float(value)  # type: ignore[arg-type]


def time_of(key: str, value: object, setting: Setting) -> float:
    """Return a time in words as seconds on the target's clock.

    Raises
    ------
    InputError
        If it is none, or a time of day where nobody said when time 0 was.
    """
    if value is None:
        raise InputError(f"{key}: is missing; give a time, as 1200, 0:20:00 or -5min")
    try:
        return seconds(value) if not str(value).startswith("-") else _ago(str(value), setting)
    except InputError:
        if not isinstance(value, str):
            raise
    if setting.sighted_at is None:
        raise InputError(
            f"{key}: {as_written(value)} is no time since the target was last seen, and the "
            "scenario does not say at which time of day that was (target.sighted_at); write "
            "1200, 0:20:00 or -5min"
        )
    now = setting.sighted_at + timedelta(seconds=setting.now_s)
    return (when(value, now) - setting.sighted_at).total_seconds()


def _ago(text: str, setting: Setting) -> float:
    return setting.now_s - span(text[1:])
