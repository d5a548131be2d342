"""What the UAV carries to see the target with."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Sensor:
    """A perfect sensor: it sees every target within its radius while it is on."""

    radius_m: float
    detects_in_transit: bool = True  # False: only above the roads that the plan names
