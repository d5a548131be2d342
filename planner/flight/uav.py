"""The drone: when and where it takes off, how fast it flies, for how long, and where it lands."""

from dataclasses import dataclass, replace

import numpy as np


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

    @property
    def landing_s(self) -> float:
        """The latest time in the air, seconds on the target's clock."""
        return self.take_off_s + self.max_flight_time_s

    def home_s(self, x_m: float, y_m: float) -> float:
        """Return the seconds of flight from a place to where it has to land; 0 if anywhere."""
        if self.return_to_m is None:
            return 0.0
        offset = np.subtract(self.return_to_m, (x_m, y_m))
        return float(np.hypot(*offset)) / self.speed_mps

    def resumed(self, time_s: float, x_m: float, y_m: float) -> "Uav":
        """Return the same UAV as it flies on from a place and time: it lands no later."""
        left_s = self.landing_s - time_s
        return replace(self, x_m=x_m, y_m=y_m, take_off_s=time_s, max_flight_time_s=left_s)
