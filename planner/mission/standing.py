"""How a mission stands in the middle of it: what is said of its UAVs, beside what was planned."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from planner.mission.joined import Joined


@dataclass(frozen=True)
class OfUav:
    """What is said of a UAV; what is not, is as its plan has it."""

    late_s: float = 0.0  # for how long it has stood still until now
    xy_m: tuple[float, float] | None = None  # where it is, metres
    left_s: float | None = None  # how long it can be in the air from now on
    lost_s: float | None = None  # when it was lost, seconds on the target's clock


@dataclass(frozen=True)
class Standing:
    """How a mission stands in the middle of it."""

    at_s: float  # now, seconds on the target's clock
    late_s: float = 0.0  # as `OfUav` has it, of the only UAV; so are the two that follow
    xy_m: tuple[float, float] | None = None
    left_s: float | None = None
    uavs: Mapping[int, OfUav] = field(default_factory=dict)  # what is said of some, by number
    joined: tuple[Joined, ...] = ()  # who has joined, and flies from now on as well

    @property
    def of_only(self) -> OfUav:
        """What is said of a UAV that is not named."""
        return OfUav(self.late_s, self.xy_m, self.left_s)
