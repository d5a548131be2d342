"""The drone: when and where it takes off, how fast it flies, for how long, and where it lands."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner.checked import number, set_fields
from planner.errors import InputError
from planner.flight.law import Aircraft


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

    def __post_init__(self) -> None:
        names = ("x_m", "y_m", "take_off_s", "altitude_m")
        found: dict[str, Any] = {name: number(name, getattr(self, name)) for name in names}
        found["speed_mps"] = number("speed_mps", self.speed_mps, above=0.0)
        longest_s = number("max_flight_time_s", self.max_flight_time_s, least=0.0, ends=False)
        found["max_flight_time_s"] = longest_s
        found["link_m"] = number("link_m", self.link_m, above=0.0, ends=False)
        if self.return_to_m is not None:
            if np.shape(self.return_to_m) != (2,):
                raise InputError("return_to_m: should be x and y in metres, or None")
            found["return_to_m"] = tuple(number("return_to_m", one) for one in self.return_to_m)
        set_fields(self, found)

    @property
    def landing_s(self) -> float:
        """The latest time in the air, seconds on the target's clock."""
        return self.take_off_s + self.max_flight_time_s

    @property
    def fastest(self) -> "Uav":
        """The ideal UAV that is as fast over ground as this one can be anywhere: none beats it."""
        if self.aircraft is None:
            return self
        wind_mps = float(np.hypot(*self.aircraft.law.wind_mps))
        return replace(self, speed_mps=self.speed_mps + wind_mps, aircraft=None)

    def home_s(self, x_m: float, y_m: float) -> float:
        """Return the seconds of flight from a place to where it has to land; 0 if anywhere."""
        if self.return_to_m is None:
            return 0.0
        offset = np.subtract(self.return_to_m, (x_m, y_m))
        return float(np.hypot(*offset)) / self.speed_mps

    def resumed(self, time_s: float, x_m: float, y_m: float) -> "Uav":
        """Return the same UAV as it flies on from a place and time: it lands no later."""
        left_s = max(0.0, self.landing_s - time_s)
        return replace(self, x_m=x_m, y_m=y_m, take_off_s=time_s, max_flight_time_s=left_s)
