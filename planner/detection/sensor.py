"""What the UAV carries to see the target with."""

from dataclasses import dataclass

from planner.checked import flag, number, set_fields


@dataclass(frozen=True)
class Sensor:
    """A perfect sensor: it sees every target within its radius while it is on."""

    radius_m: float
    detects_in_transit: bool = True  # False: only above the roads that the plan names

    def __post_init__(self) -> None:
        radius_m = number("radius_m", self.radius_m, above=0.0)
        in_transit = flag("detects_in_transit", self.detects_in_transit)
        set_fields(self, {"radius_m": radius_m, "detects_in_transit": in_transit})
