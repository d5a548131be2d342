"""What has come in since a search was planned: news, as the scenario of what is left holds it.

Each piece of news that says something of the target is a table with a ``kind``. Times are on the
target's clock; how likely each particle makes it is `planner.mission.news` to say.
"""

from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from planner.scenario.uav_values import UavStart
from planner.scenario.values import Finite, Metres, Name, Radius, Seconds, Section, UavSpeed

MOST_NEWS = 1000  # pieces that come in: each weighs all particles
MOST_HEARD = 2 * MOST_NEWS  # and what each UAV has flown

Probability = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
Detects = Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)]
Target = Annotated[int, Field(ge=0)]
Row = Annotated[tuple[Finite, Metres, Metres], Field(strict=False)]
Window = Annotated[tuple[Finite, Finite], Field(strict=False)]


class _OfPlace(Section):
    """News of a place: a point with how near it was, or streets."""

    place: UavStart | None = Field(
        default=None, description="where, as uav.start has it, or leave it out for edges"
    )
    edges: Annotated[tuple[Name, ...], Field(strict=False, min_length=1)] | None = Field(
        default=None, description="the names of the edges that it was on, in place of a place"
    )
    radius_m: Radius | None = Field(
        default=None, description="within how many metres of it, such as 200"
    )

    @model_validator(mode="after")
    def _one_place(self) -> "_OfPlace":
        if (self.place is None) == (self.edges is None):
            raise ValueError("should have either a place or edges; give one of them")
        return self


class ReportNews(_OfPlace):
    """Somebody has seen the target, and how sure that is."""

    kind: Literal["report"]
    at_s: Seconds = Field(description="when it was seen there, as seconds or H:M:S")
    heard_s: Seconds = Field(description="when that was known, as seconds or H:M:S")
    sure: Probability = Field(description="the probability that it is true, such as 0.7")
    sd_m: Radius | None = Field(
        default=None, description="the place's standard deviation in metres, in place of radius_m"
    )
    target: Target = Field(default=0, description="which target it was, 0 for the first")

    @model_validator(mode="after")
    def _one_error(self) -> "ReportNews":
        if (self.radius_m is None) == (self.sd_m is None):
            raise ValueError("should have either radius_m or sd_m; give one of them")
        return self


class NothingNews(_OfPlace):
    """Somebody who watched a place has not seen the target there."""

    kind: Literal["nothing"]
    radius_m: Radius = Field(description="within how many metres of it, such as 200")
    from_s: Seconds = Field(description="since when it was watched, as seconds or H:M:S")
    to_s: Seconds = Field(description="until when, as seconds or H:M:S")
    sure: Probability = Field(description="the probability that it would have been seen there")

    @model_validator(mode="after")
    def _rises(self) -> "NothingNews":
        if self.to_s < self.from_s:
            raise ValueError("ends before it begins; give from_s and to_s in their order")
        return self


class SearchedNews(Section):
    """A flight, the own one or another's, that has not found the target."""

    kind: Literal["searched"]
    waypoints: Annotated[tuple[Row, ...], Field(strict=False, min_length=2)] = Field(
        description="[[time_s, x_m, y_m], ...] in metres as the net has them"
    )
    sensor_on: Annotated[tuple[Window, ...], Field(strict=False)] | None = Field(
        default=None, description="[[from_s, to_s], ...], or leave it out: all the time"
    )
    radius_m: Radius = Field(description="how far its sensor sees, in metres")
    detects: Detects = Field(
        default=1.0, description="the probability that one head-on pass at its speed sees a target"
    )
    speed_mps: UavSpeed | None = Field(
        default=None, description="that speed in m/s, or leave it out for the UAV's own"
    )

    @model_validator(mode="after")
    def _rises(self) -> "SearchedNews":
        times = [row[0] for row in self.waypoints]
        if any(later < time for time, later in pairwise(times)):
            raise ValueError("waypoints: go back in time; give them in the order flown")
        spent = [time for window in self.sensor_on or () for time in window]
        if any(later < time for time, later in pairwise(spent)):
            raise ValueError("sensor_on: goes back in time; give [from, to] in their order")
        return self


class FoundNews(Section):
    """One of several targets is found."""

    kind: Literal["found"]
    target: Target = Field(default=0, description="which target it is, 0 for the first")


KINDS: dict[str, type[Section]] = {
    "report": ReportNews,
    "nothing": NothingNews,
    "searched": SearchedNews,
    "found": FoundNews,
}


def _kind(value: Any) -> str:
    """Return which class a table is of; tags begin with ~, as they are no part of a key."""
    return f"~{value.get('kind') if isinstance(value, dict) else getattr(value, 'kind', None)}"


News = Annotated[
    Annotated[ReportNews, Tag("~report")]
    | Annotated[NothingNews, Tag("~nothing")]
    | Annotated[SearchedNews, Tag("~searched")]
    | Annotated[FoundNews, Tag("~found")],
    Discriminator(_kind),
]


class NewsSection(Section):
    """What is known of the target beyond what was known at first."""

    heard: Annotated[tuple[News, ...], Field(strict=False, max_length=MOST_HEARD)] | None = Field(
        default=None,
        description="the pieces of news, each with its kind (report, nothing, searched or found), "
        "or leave it out for none",
    )
