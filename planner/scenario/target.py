"""What a scenario says of a target: the section [target], and each of [[target]] and [[truth]]."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from planner.scenario.target_values import Flees, Goes, Start, Stops
from planner.scenario.values import (
    Distances,
    DistributionSection,
    Hidden,
    Moment,
    Seconds,
    Section,
    Speeds,
    TargetName,
    Turning,
)


class TargetSection(Section):
    """What is known of the target: the paper's p(r0), p(d0), p(v0) and its transition model."""

    stand_in: ClassVar[dict[str, Any]] = {"start": "anywhere"}

    name: TargetName | None = Field(
        default=None,
        description="what it is called where there are several, or leave it out for its number",
    )
    start: Start = Field(
        description='"anywhere", a list of edges, a table of edges and their probabilities, '
        "[{ edge, from_m, to_m, p }], { x_m, y_m, radius_m, heading_deg }, { lon, lat, ... }, "
        "{ area } or { taz, file }"
    )
    goes: Goes | None = Field(
        default=None,
        description='"turns" by chance, "somewhere", "leaves", [{ edge, p }], or { file } of '
        'SUMO\'s routes; left out: "turns"',
    )
    distance_m: Distances = Field(
        default="anywhere",
        description='"anywhere" or a distribution such as { uniform = [0, 7500] }',
    )
    speed_mps: Speeds = Field(
        default=DistributionSection(uniform=(15.0, 25.0)),
        description="a distribution such as { uniform = [15, 25] } or { constant = 20 }",
    )
    speed_drawn: Literal["once", "per road"] = "once"
    turning: Turning = Field(
        default="equal",
        description='"equal", { AB = { BC = 0.5, BD = 0.5 } } or { file = "turns.xml" }',
    )
    driving: Literal["constant", "free", "traffic"] = "constant"
    signals: Literal["unknown", "known"] | None = Field(
        default=None,
        description='"known" if time 0 is second 0 of the traffic signals, or leave it out',
    )
    at_sink: Literal["stays", "gone"] = "stays"
    probability_present: Annotated[float, Field(ge=1e-6, le=1, allow_inf_nan=False)] = Field(
        default=1.0,
        description="the probability that the target is there at all, from 0.000001 to 1",
    )
    hidden: Hidden | None = Field(
        default=None,
        description="the probability that it is where no pass can see it, such as a garage: from "
        "0 to below 1, or leave it out for 0",
    )
    last_seen_ago_s: Seconds = Field(
        default=0.0, description="how long ago the target was at its start, as seconds or H:M:S"
    )
    sighted_at: Moment | None = Field(
        default=None,
        description="the moment of time 0, with its offset from UTC: 2026-05-01T14:05:00+02:00, "
        "or leave it out",
    )
    last_seen_window_s: Seconds | None = Field(
        default=None,
        description="for how long from time 0 on it may have been seen, as seconds or H:M:S, or "
        "leave it out for time 0",
    )
    stops: Stops | None = Field(
        default=None,
        description='{ parked = 0.2, share = 0.85, mean_s = "1:00:00" }, or leave it out: none',
    )
    flees: Flees | None = Field(
        default=None, description="{ for_s = 90, factor = 1.3 }, or leave it out: it does not"
    )
    caution: Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)] | None = Field(
        default=None,
        description="the share of a widened belief that is planned for as well, such as 0.1, or "
        "leave it out for 0",
    )
    mix: Annotated[tuple["Component", ...], Field(strict=False)] | None = Field(
        default=None, description="what the target may be, each with its weight, or leave it out"
    )

    def called(self, number: int) -> str:
        """Return its name; what has none is called by its number, from 1 on."""
        return self.name or f"target {number}"

    def parts(self, key: str) -> "list[tuple[str, TargetSection]]":
        """Return what the target may be, by key: itself, or the components of its mixture."""
        if self.mix is None:
            return [(key, self)]
        return [(f"{key}.mix[{i}]", part) for i, part in enumerate(self.mix)]


class Component(TargetSection):
    """One of the things that a target may be."""

    weight: Annotated[float, Field(gt=0, allow_inf_nan=False)] = Field(
        description="its probability, or any number in proportion to it, above 0"
    )
