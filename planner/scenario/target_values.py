"""What the keys of a target may hold beyond single values: where it starts, goes and stops."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator

from planner.messages import as_written
from planner.scenario.values import (
    Distance,
    Finite,
    Latitude,
    Longitude,
    Metres,
    Name,
    NotNegative,
    PositiveSeconds,
    Probabilities,
    Radius,
    Section,
    edges_alike,
    no_edge_alone,
    probability_fault,
)

Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
MOST_FACTOR = 3.0  # of what a limit allows


class StretchStart(Section):
    """A stretch of an edge."""

    edge: Name = Field(description="the name of an edge")
    from_m: Distance = Field(default=0.0, description="metres along the edge where it begins")
    to_m: Distance | None = Field(
        default=None, description="metres along the edge where it ends, or leave it out for its end"
    )
    p: NotNegative | None = Field(
        default=None, description="its probability, or leave it out everywhere: by length"
    )


class CircleStart(Section):
    """A place, how well it is known, and the heading if there is one."""

    x_m: Metres = Field(description="metres to the east")
    y_m: Metres = Field(description="metres to the north")
    radius_m: Radius = Field(description="within how many metres of it the target was, such as 50")
    heading_deg: Finite | None = Field(
        default=None, description="the compass heading (0 north, 90 east), or leave it out"
    )


class LonLatStart(Section):
    """The same by longitude and latitude."""

    lon: Longitude = Field(description="degrees east, such as 13.52")
    lat: Latitude = Field(description="degrees north, such as 52.43")
    radius_m: Radius = Field(description="within how many metres of it the target was, such as 50")
    heading_deg: Finite | None = Field(
        default=None, description="the compass heading (0 north, 90 east), or leave it out"
    )


def _three_corners(corners: tuple[Any, ...]) -> tuple[Any, ...]:
    if len(corners) < 3:
        raise ValueError(f"has {len(corners)} corners; give three or more, as [x_m, y_m]")
    return corners


class AreaStart(Section):
    """All streets within a polygon."""

    area: Annotated[
        tuple[Annotated[tuple[Metres, Metres], Field(strict=False)], ...],
        Field(strict=False),
        AfterValidator(_three_corners),
    ] = Field(description="the corners, as in area = [[0, 0], [500, 0], [500, 300]]")


class TazStart(Section):
    """A traffic assignment zone of SUMO."""

    taz: Name = Field(description="the id of a taz")
    file: str = Field(description="the path of the SUMO additional file that holds the taz")


def _either_all_or_none(parts: Sequence[Any]) -> str | None:
    """Return what is wrong with the probabilities of parts, which may be left out, or None."""
    given = [part.p for part in parts if part.p is not None]
    if given and len(given) < len(parts):
        return "gives p for some only; give one for each, or for none"
    return probability_fault(given) if given else None


def _sound_stretches(stretches: tuple[StretchStart, ...]) -> tuple[StretchStart, ...]:
    for stretch in stretches:
        if stretch.to_m is not None and not stretch.from_m < stretch.to_m:
            raise ValueError(
                f"{stretch.edge}: from_m {as_written(stretch.from_m)} is not below to_m "
                f"{as_written(stretch.to_m)}; write the lower one first"
            )
    fault = _either_all_or_none(stretches)
    if fault:
        raise ValueError(fault)
    return stretches


FORMS: dict[str, type[Section]] = {
    "lon": LonLatStart,
    "lat": LonLatStart,
    "x_m": CircleStart,
    "y_m": CircleStart,
    "radius_m": CircleStart,
    "area": AreaStart,
    "taz": TazStart,
}


def _start_form(value: Any) -> str:
    if isinstance(value, str):
        return "~word"
    if isinstance(value, Section):
        return f"~{type(value).__name__}"
    if isinstance(value, list | tuple):
        stretches = [one for one in value if isinstance(one, dict | StretchStart)]
        return "~StretchStart" if stretches else "~table"
    keys = value if isinstance(value, dict) else {}
    form = next((FORMS[key] for key in FORMS if key in keys), None)
    return f"~{form.__name__}" if form else "~table"


Start = Annotated[
    Annotated[Literal["anywhere"], BeforeValidator(no_edge_alone), Tag("~word")]
    | Annotated[Probabilities, BeforeValidator(edges_alike), Tag("~table")]
    | Annotated[
        tuple[StretchStart, ...],
        Field(strict=False),
        AfterValidator(_sound_stretches),
        Tag("~StretchStart"),
    ]
    | Annotated[CircleStart, Tag("~CircleStart")]
    | Annotated[LonLatStart, Tag("~LonLatStart")]
    | Annotated[AreaStart, Tag("~AreaStart")]
    | Annotated[TazStart, Tag("~TazStart")],
    Discriminator(_start_form),
]


class Goal(Section):
    """A place that the target may drive to; one of its forms."""

    edge: Name | None = Field(default=None, description="the name of an edge")
    x_m: Metres | None = Field(default=None, description="metres to the east")
    y_m: Metres | None = Field(default=None, description="metres to the north")
    lon: Longitude | None = Field(default=None, description="degrees east, such as 13.52")
    lat: Latitude | None = Field(default=None, description="degrees north, such as 52.43")
    radius_m: Radius | None = Field(
        default=None, description="within how many metres, or leave it out for the nearest road"
    )
    taz: Name | None = Field(default=None, description="the id of a taz")
    file: str | None = Field(
        default=None, description="the path of the SUMO additional file that holds the taz"
    )
    p: NotNegative | None = Field(
        default=None, description="its probability, or leave it out everywhere: all alike"
    )

    @model_validator(mode="after")
    def _sound(self) -> "Goal":
        given = {key for key, value in self.model_dump(exclude_none=True).items() if value != ""}
        if given - {"p"} not in GOALS:
            raise ValueError(
                f"gives {' and '.join(sorted(given - {'p'})) or 'no place'}; write {{ edge, p }}, "
                "{ x_m, y_m, radius_m, p }, { lon, lat, radius_m, p } or { taz, file, p }"
            )
        return self


GOALS = (
    {"edge"},
    {"x_m", "y_m"},
    {"x_m", "y_m", "radius_m"},
    {"lon", "lat"},
    {"lon", "lat", "radius_m"},
    {"taz", "file"},
)


class GoalFile(Section):
    """A file of SUMO's that says where vehicles drive."""

    file: str = Field(description="the path of a SUMO file of routes or trips (.rou.xml)")


def _sound_goals(goals: tuple[Goal, ...]) -> tuple[Goal, ...]:
    if not goals:
        raise ValueError('is empty; name a place, or write "turns"')
    fault = _either_all_or_none(goals)
    if fault:
        raise ValueError(fault)
    return goals


def _goes_form(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "~Goal"
    return "~GoalFile" if isinstance(value, dict | GoalFile) else "~word"


Goes = Annotated[
    Annotated[Literal["turns", "somewhere", "leaves"], Tag("~word")]
    | Annotated[tuple[Goal, ...], Field(strict=False), AfterValidator(_sound_goals), Tag("~Goal")]
    | Annotated[GoalFile, Tag("~GoalFile")],
    Discriminator(_goes_form),
]


class Stops(Section):
    """That targets park: from the start, or on the way."""

    parked: Share = Field(
        default=0.0, description="the share that is parked from the start, 0 to 1"
    )
    share: Share = Field(
        default=1.0, description="the share of the others that parks sooner or later, 0 to 1"
    )
    mean_s: PositiveSeconds | None = Field(
        default=None, description="how long these drive in the mean, as seconds or H:M:S"
    )

    @model_validator(mode="after")
    def _sound(self) -> "Stops":
        drives = self.parked < 1 and self.share > 0
        if drives and self.mean_s is None and (self.parked == 0 or self.share < 1):
            raise ValueError(
                "says nothing of how long they drive; give mean_s, as in "
                '{ share = 0.85, mean_s = "1:00:00" }, or { parked = 0.3 }'
            )
        return self


class Flees(Section):
    """That targets drive faster at first."""

    for_s: PositiveSeconds = Field(default=90.0, description="for how long, such as 90")
    factor: Annotated[float, Field(gt=1, le=MOST_FACTOR, allow_inf_nan=False)] = Field(
        default=1.3, description="times the limits and its own speed, above 1 and at most 3"
    )
