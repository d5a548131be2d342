"""The drone of a scenario: when and where it takes off, and how its aircraft flies."""

from typing import Annotated, Any, ClassVar

from pydantic import Field

from planner.scenario.uav_values import InAir, UavLanding, UavStart, Wind
from planner.scenario.values import (
    Distance,
    PositiveSeconds,
    Radius,
    Seconds,
    Section,
    UavRate,
    UavSpeed,
)

IDEAL = "ideal"  # the paper's aircraft: at its height, at full speed and around corners at once
MOST_SORTIES = 50
RESERVE = 0.2  # of a real aircraft's time in the air, if nothing is said


class UavSection(Section):
    """The UAV; its times count from now; `Scenario.take_off_s` is on the target's clock."""

    stand_in: ClassVar[dict[str, Any]] = {"start": {"x_m": 0, "y_m": 0}}

    aircraft: str | None = Field(
        default=None,
        description='what has the keys that are left out: "multicopter", "vtol", "fixed-wing", the '
        'path of a .toml file with keys of [uav], or "ideal"',
    )
    speed_mps: UavSpeed = Field(default=100.0, description="the UAV's speed in m/s, such as 100")
    altitude_m: Distance = Field(default=150.0, description="the flight altitude in metres")
    start: UavStart = Field(
        description="{ x_m = 0, y_m = 0 }, { lon = 13.52, lat = 52.43 } or { node = NAME, "
        "bearing_deg = 315, distance_m = 0 }"
    )
    take_off_s: Seconds = Field(default=0.0, description="seconds or H:M:S from now to take-off")
    max_flight_time_s: PositiveSeconds | None = Field(
        default=None,
        description="the longest flight as seconds or H:M:S, or leave it out for no limit",
    )
    return_to: UavLanding | None = Field(
        default=None,
        description='where it has to land: "start", { node = NAME }, { x_m = 0, y_m = 0 } or '
        "{ lon = 13.52, lat = 52.43 }, or leave it out for anywhere",
    )
    acceleration_mps2: UavRate | None = Field(
        default=None,
        description="how fast it speeds up, brakes and turns in m/s2, such as 1.4, or leave it out",
    )
    corner_m: UavRate | None = Field(
        default=None,
        description="how near it has to pass each corner in metres, such as 2, or leave it out; "
        "goes with acceleration_mps2",
    )
    climb_mps: UavRate | None = Field(
        default=None, description="how fast it climbs in m/s, such as 2.5, or leave it out"
    )
    descend_mps: UavRate | None = Field(
        default=None, description="how fast it comes down in m/s, such as 1.5, or leave it out"
    )
    hover: bool | None = Field(
        default=None,
        description="false for an aircraft that cannot stand still in the air, else true, or leave "
        "it out: it can",
    )
    min_speed_mps: UavRate | None = Field(
        default=None,
        description="the least speed through the air of an aircraft that cannot hover, in m/s, "
        "such as 15, or leave it out",
    )
    reserve_s: Seconds | None = Field(
        default=None,
        description="how much of max_flight_time_s is left when it lands, as seconds or H:M:S; a "
        "fifth for a real aircraft if left out",
    )
    wind: Wind | None = Field(
        default=None,
        description="{ speed_mps = 5, from_deg = 270 }; left out, a real aircraft keeps enough to "
        "come home against 5 m/s",
    )
    link_m: Radius | None = Field(
        default=None,
        description="how far from its start it may be, in metres, such as 2000, or leave it out",
    )
    in_air: InAir | None = Field(
        default=None,
        description="{ place = { x_m = 0, y_m = 0 }, at_s = 300, left_s = 900 } if it flies "
        "already, or leave it out",
    )
    sorties: Annotated[int, Field(ge=0, le=MOST_SORTIES)] | None = Field(
        default=None,
        description="how often it flies, with a full battery each time, such as 4, 0 if it flies "
        "no more, or leave it out: once",
    )
    swap_s: Seconds | None = Field(
        default=None,
        description="how long it stands on the ground between two flights, as seconds or H:M:S, "
        "or leave it out: not at all; goes with sorties",
    )

    @property
    def can_hover(self) -> bool:
        """Whether it can stand still in the air."""
        return self.hover is not False

    @property
    def kept_s(self) -> float:
        """How much of its time in the air it keeps for the end, seconds."""
        if self.reserve_s is not None:
            return self.reserve_s
        return RESERVE * (self.max_flight_time_s or 0.0) if self.is_real else 0.0

    @property
    def spent_s(self) -> float:
        """How much of its time in the air is not for the search, seconds."""
        vertical = [rate for rate in (self.climb_mps, self.descend_mps) if rate is not None]
        return self.kept_s + sum(self.altitude_m / rate for rate in vertical)

    @property
    def is_real(self) -> bool:
        """Whether anything is said of how it flies; else it is the paper's ideal aircraft."""
        said = (self.acceleration_mps2, self.climb_mps, self.descend_mps, self.reserve_s, self.wind)
        return any(one is not None for one in said) or not self.can_hover
