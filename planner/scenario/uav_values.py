"""What the keys of the UAV may hold beyond single values: where it starts and lands, and wind."""

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from planner.scenario.values import (
    Distance,
    Finite,
    Latitude,
    Longitude,
    Metres,
    Name,
    NotNegative,
    PositiveSeconds,
    Seconds,
    Section,
)


class PointStart(Section):
    """A place in the network's coordinates."""

    x_m: Metres = Field(description="metres to the east")
    y_m: Metres = Field(description="metres to the north")


class LonLatPlace(Section):
    """A place by longitude and latitude (WGS 84), for nets that have a projection."""

    lon: Longitude = Field(description="degrees east, such as 13.52")
    lat: Latitude = Field(description="degrees north, such as 52.43")


class NodeStart(Section):
    """A place some way off a node."""

    node: Name = Field(description="the name of a node")
    bearing_deg: Finite = Field(
        default=0.0, description="the compass bearing seen from the node (0 north, 90 east)"
    )
    distance_m: Distance = Field(default=0.0, description="metres from the node")


def _place_form(value: Any) -> str:
    keys = value if isinstance(value, dict) else ()
    if isinstance(value, LonLatPlace) or "lon" in keys or "lat" in keys:
        return "~LonLatPlace"
    return "~NodeStart" if isinstance(value, NodeStart) or "node" in keys else "~PointStart"


UavStart = Annotated[
    Annotated[PointStart, Tag("~PointStart")]
    | Annotated[LonLatPlace, Tag("~LonLatPlace")]
    | Annotated[NodeStart, Tag("~NodeStart")],
    Discriminator(_place_form),
]


class InAir(Section):
    """Where a UAV is that flies already."""

    place: UavStart = Field(description="where it is, as uav.start has it")
    at_s: Seconds = Field(description="when, on the target's clock, as seconds or H:M:S")
    left_s: PositiveSeconds | None = Field(
        default=None,
        description="for how long it can be in the air from then on, with its reserve, or leave "
        "it out: what is left of max_flight_time_s",
    )


class Wind(Section):
    """The wind at the height of flight, the same everywhere."""

    speed_mps: NotNegative = Field(description="its speed in m/s, such as 5")
    from_deg: Finite = Field(description="the compass direction it comes from, such as 270: west")


class NodeLanding(Section):
    """A node to land at."""

    node: Name = Field(description="the name of a node")


def _landing_form(value: Any) -> str:
    if isinstance(value, str):
        return "~word"
    form = _place_form(value)
    keys = value if isinstance(value, dict) else ()
    return "~NodeLanding" if isinstance(value, NodeLanding) or "node" in keys else form


UavLanding = Annotated[
    Annotated[Literal["start"], Tag("~word")]
    | Annotated[PointStart, Tag("~PointStart")]
    | Annotated[LonLatPlace, Tag("~LonLatPlace")]
    | Annotated[NodeLanding, Tag("~NodeLanding")],
    Discriminator(_landing_form),
]
