"""The drone: when and where it takes off, how fast it flies, for how long, and where it lands."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner.arrays import Floats
from planner.checked import number, set_fields, whole
from planner.errors import InputError
from planner.flight.law import Aircraft, homeward_s


@dataclass(frozen=True)
class Uav:
    """One UAV and when and where it takes off."""

    x_m: float
    y_m: float
    take_off_s: float  # seconds on the target's clock
    speed_mps: float
    altitude_m: float = 0.0  # above ground; carried through to plan.json
    max_flight_time_s: float = np.inf
    return_to_m: tuple[float, float] | None = None  # x, y where it has to land; None: anywhere
    link_m: float = np.inf  # how far from its start its radio reaches; the airspace keeps it there
    # What its plans are timed by in the end; None: it is the paper's, at full speed at once
    aircraft: Aircraft | None = None
    sorties: int = 1  # how often it may fly, each time as long; 0: it flies no more
    swap_s: float = 0.0  # how long it stands on the ground in between
    in_air: bool = False  # whether it flies already when its flight begins
    # as it takes off for its next flights, where that is another way; None: as for the first
    again: "Uav | None" = None

    def __post_init__(self) -> None:
        names = ("x_m", "y_m", "take_off_s", "altitude_m")
        found: dict[str, Any] = {name: number(name, getattr(self, name)) for name in names}
        found["speed_mps"] = number("speed_mps", self.speed_mps, above=0.0)
        longest_s = number("max_flight_time_s", self.max_flight_time_s, least=0.0, ends=False)
        found["max_flight_time_s"] = longest_s
        found["sorties"] = whole("sorties", self.sorties, least=0)
        found["swap_s"] = number("swap_s", self.swap_s, least=0.0)
        found["link_m"] = number("link_m", self.link_m, above=0.0, ends=False)
        if self.return_to_m is not None:
            if np.shape(self.return_to_m) != (2,):
                raise InputError("return_to_m: should be x and y in metres, or None")
            found["return_to_m"] = tuple(number("return_to_m", one) for one in self.return_to_m)
        set_fields(self, found)

    def of_flight(self, number: int) -> "Uav":
        """Return the UAV as it begins one of its flights, from 0."""
        return self if number == 0 or self.again is None else self.again

    @property
    def landing_s(self) -> float:
        """The latest time in the air, seconds on the target's clock."""
        return self.take_off_s + self.max_flight_time_s

    @property
    def at_height(self) -> "Uav":
        """The same UAV once it has climbed: with the time that it has for flying to and fro."""
        if self.aircraft is None:
            return self
        law, kept_s = self.aircraft.law, self.aircraft.reserve_s
        left_s = self.max_flight_time_s - law.climb_s - law.descend_s - kept_s
        return replace(
            self, take_off_s=self.take_off_s + law.climb_s, max_flight_time_s=max(0.0, left_s)
        )

    @property
    def strays_m(self) -> float:
        """How far it may be from the line that it flies: it cuts corners."""
        corner_m = 0.0 if self.aircraft is None else self.aircraft.law.corner_m
        return corner_m if np.isfinite(corner_m) else 0.0

    @property
    def fastest(self) -> "Uav":
        """The ideal UAV that is as fast over ground as this one can be anywhere: none beats it."""
        if self.aircraft is None:
            return self
        wind_mps = float(np.hypot(*self.aircraft.law.wind_mps))
        return replace(self.at_height, speed_mps=self.speed_mps + wind_mps, aircraft=None)

    @property
    def turns_home_s(self) -> float:
        """How long corners on the way home delay it, seconds."""
        if self.aircraft is None:
            return 0.0
        law, headwind_mps = self.aircraft.law, self.aircraft.headwind_mps
        return float(homeward_s(np.zeros(1), law, headwind_mps, turns=True)[0])

    @property
    def home_mps(self) -> float:
        """How fast it comes home over ground; 0 if the wind is too strong."""
        headwind_mps = 0.0 if self.aircraft is None else self.aircraft.headwind_mps
        return max(0.0, self.speed_mps - headwind_mps)

    def homeward_s(self, xy_m: Floats) -> Floats:
        """Return the seconds of flight from places, (..., 2) metres, to where it has to land.

        0 if that is anywhere.
        """
        if self.return_to_m is None:
            return np.zeros(np.shape(xy_m)[:-1])
        offset = xy_m - np.array(self.return_to_m)
        away_m = np.hypot(offset[..., 0], offset[..., 1])
        if self.aircraft is None:
            return np.asarray(away_m / self.speed_mps)
        return homeward_s(away_m, self.aircraft.law, self.aircraft.headwind_mps)

    def home_s(self, x_m: float, y_m: float) -> float:
        """Return the same from one place."""
        return float(self.homeward_s(np.array([x_m, y_m])))

    def resumed(self, time_s: float, x_m: float, y_m: float) -> "Uav":
        """Return the same UAV as it flies on from a place and time: it lands no later."""
        left_s = max(0.0, self.landing_s - time_s)
        return replace(self, x_m=x_m, y_m=y_m, take_off_s=time_s, max_flight_time_s=left_s)
