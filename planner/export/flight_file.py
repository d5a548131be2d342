"""A flight as pilots and autopilots hold it: one list of waypoints, whatever the format."""

from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from math import hypot
from typing import NamedTuple

from planner.checked import number
from planner.errors import InputError


@dataclass(frozen=True)
class Waypoint:
    """A place that the aircraft flies to, straight from the one before."""

    lat_deg: float  # WGS 84
    lon_deg: float
    x_m: float  # in the net's plane
    y_m: float
    arrives_s: float  # seconds on the target's clock
    hold_s: float = 0.0  # seconds that it stays there
    street: str = ""  # along which it gets there; empty: across country


class Fix(NamedTuple):
    """Where the aircraft is at a moment, as a receiver would tell."""

    time_s: float  # seconds on the target's clock
    lat_deg: float  # WGS 84
    lon_deg: float
    height_m: float  # above where it takes off


@dataclass(frozen=True, kw_only=True)
class FlightFile:
    """All that a flight file says."""

    name: str
    waypoints: tuple[Waypoint, ...]  # the first one is where it takes off
    height_m: float  # above where it takes off, all the way
    speed_mps: float  # through the air
    comes_home: bool  # whether it lands where it took off
    sighted_at: datetime | None = None  # which moment second 0 is; None: nobody said
    attribution: str = ""  # whose data the net is
    # How it moves, from lift-off on; left out: evenly from waypoint to waypoint
    way: tuple[Fix, ...] = ()
    launch: Waypoint | None = None  # where it took off, if it begins in the air; None: it does not

    def __post_init__(self) -> None:
        if len(self.waypoints) < 2:
            raise InputError("waypoints: a flight needs two places at least; plan a longer search")
        number("height_m", self.height_m, above=0.0)
        number("speed_mps", self.speed_mps, above=0.0)
        for one in self.waypoints:
            number("lat_deg", one.lat_deg, least=-90.0)
            number("lon_deg", one.lon_deg, least=-180.0)
            if one.lat_deg > 90.0 or one.lon_deg > 180.0:
                raise InputError(f"lat_deg, lon_deg: {one.lat_deg}, {one.lon_deg} is nowhere")

    def utc(self, time_s: float) -> str | None:
        """Return a second of the target's clock as a moment in UTC, to the millisecond.

        None where nobody said when the target was seen: a moment would be invented.
        """
        if self.sighted_at is None:
            return None
        moment = self.sighted_at.astimezone(UTC) + timedelta(milliseconds=round(1000 * time_s))
        return f"{moment:%Y-%m-%dT%H:%M:%S}.{moment.microsecond // 1000:03d}Z"

    @property
    def lengths_m(self) -> list[float]:
        """How far each waypoint is from the one before, (W - 1,) metres."""
        places = [(one.x_m, one.y_m) for one in self.waypoints]
        return [hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(places)]

    @property
    def home(self) -> Waypoint:
        """Where it takes off."""
        return self.waypoints[0] if self.launch is None else self.launch

    @property
    def fixes(self) -> tuple[Fix, ...]:
        """Where it is at moments between which it moves evenly, but for decimetres."""
        if self.way:
            return self.way
        stays = self.stays
        return tuple(Fix(t, one.lat_deg, one.lon_deg, self.height_m) for one, t in stays)

    def parts(self, most: int) -> "list[FlightFile]":
        """Return it in parts of so many waypoints at most, two or more, each where one ended.

        Parts after the first one begin in the air; those before the last one end there.
        """
        step, last = most - 1, len(self.waypoints) - 1
        if last <= step:
            return [self]
        begins = range(0, last, step)
        return [
            replace(
                self,
                name=f"{self.name}, part {number} of {len(begins)}",
                waypoints=self._between(first, min(first + step, last)),
                comes_home=self.comes_home and first + step >= last,
                way=(),
                launch=self.home if first else self.launch,
            )
            for number, first in enumerate(begins, 1)
        ]

    def _between(self, first: int, last: int) -> tuple[Waypoint, ...]:
        """Return waypoints from one to another; what it held at the first is over."""
        begin, *others = self.waypoints[first : last + 1]
        gone = replace(begin, arrives_s=begin.arrives_s + begin.hold_s, hold_s=0.0)
        return (gone, *others)

    @property
    def stays(self) -> list[tuple[Waypoint, float]]:
        """Each waypoint with the second at which it is there; twice where it holds."""
        found: list[tuple[Waypoint, float]] = []
        for one in self.waypoints:
            found.append((one, one.arrives_s))
            if one.hold_s > 0.0:
                found.append((one, one.arrives_s + one.hold_s))
        return found


def whole_holds(flight: FlightFile) -> list[int]:
    """Return for how many whole seconds to hold at each waypoint; what is rounded is made up for.

    ArduPilot takes no fractions.
    """
    held, wanted, holds = 0, 0.0, []
    for one in flight.waypoints:
        wanted += one.hold_s
        holds.append(max(0, round(wanted) - held) if one.hold_s > 0.0 else 0)
        held += holds[-1]
    return holds
