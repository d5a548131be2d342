"""Sets of true targets that all plans of an experiment meet, enumerated instead of drawn."""

from dataclasses import dataclass
from typing import Any

POINTS = 20  # at which a range of speeds or distances is taken, each standing for as much of it


@dataclass(frozen=True)
class TargetSet:
    """True targets, weighted by their probability: no chance is left in them but the plan's.

    Every route is taken; a range of speeds or distances at the middles of ``points`` equally
    probable parts; a list whole, or so too where fewer points than usual are asked for.
    """

    name: str
    truth: tuple[str, ...] = ()  # overrides of the scenario's truth, such as truth.speed_mps=...
    route: str = ""  # edges with a space between, of the one route; empty: all
    points: int = POINTS
    parks: bool = False  # stops for good on the way, anywhere on it
    detects: float = 1.0  # as `sensor.detects`, in place of the scenario's if it is below 1
    by_route: bool = False  # keep the figures of each route

    def as_dict(self) -> dict[str, Any]:
        """Return what makes the set, as plain values."""
        return {**vars(self), "truth": list(self.truth)}
