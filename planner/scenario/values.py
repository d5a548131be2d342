"""What a key of a scenario may hold: checked values, each with the forms it can be written in.

A value that can be written in several forms is a union with a discriminator, so that a fault is
reported for the form that was meant. Tags that begin with ``~`` are not keys, and are left out of
a fault's key.
"""

import copy
import functools
import math
import operator
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import (
    AfterValidator,
    AwareDatetime,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    model_validator,
)

from planner.clock import moment, seconds
from planner.messages import as_written

LONGEST_S = 1e9  # thirty years
SHORTEST_S = 1e-3
FASTEST_MPS = 1000.0  # nothing on a road is as fast
SLOWEST_MPS = 1e-3  # a kilometre in twelve days
FARTHEST_M = 1e8  # more than round the Earth
SUM_TOLERANCE = 1e-6  # three thirds written with seven digits are one
LONGEST_CREDIT = 300  # characters: a picture has room for a line or two of small print
FARTHEST_SD = 6.0  # a cut normal farther out than this has hardly any probability left


def name_of(value: Any) -> Any:
    """Return a name as text: 12345 without quotes is the node, or the edge, that is called so."""
    return str(value) if type(value) is int else value


def at_least(least: float, unit: str, *, or_zero: bool = False) -> AfterValidator:
    """Return the check of a number above 0 that something is divided by."""

    def check(value: float) -> float:
        if 0 < value < least:
            remedy = f"{'0, or ' if or_zero else ''}at least {as_written(least)} {unit}"
            raise ValueError(f"should not be {as_written(value)}; give {remedy}")
        return value

    return AfterValidator(check)


def _one_line(text: str) -> str:
    """Return a text that can stand in small print, in a comment and in a file's metadata."""
    if not text.strip() or not text.isprintable():
        raise ValueError(f"should be one line of text, not {as_written(text)}")
    if len(text) > LONGEST_CREDIT:
        raise ValueError(f"has {len(text):,} characters; give at most {LONGEST_CREDIT}")
    return text


# Ranges are wide, but such that nothing computed from numbers within them overflows.
Finite = Annotated[float, Field(allow_inf_nan=False)]
Metres = Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M, allow_inf_nan=False)]
Longitude = Annotated[float, Field(ge=-180, le=180, allow_inf_nan=False)]
Latitude = Annotated[float, Field(ge=-90, le=90, allow_inf_nan=False)]
Distance = Annotated[float, Field(ge=0, le=FARTHEST_M, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Name = Annotated[str, BeforeValidator(name_of)]
TargetName = Annotated[str, AfterValidator(_one_line), Field(max_length=40)]
Credit = Annotated[str, AfterValidator(_one_line)]
Seconds = Annotated[NotNegative, Field(le=LONGEST_S), BeforeValidator(seconds)]
PositiveSeconds = Annotated[
    Positive, Field(le=LONGEST_S), BeforeValidator(seconds), at_least(SHORTEST_S, "s")
]
Moment = Annotated[AwareDatetime, BeforeValidator(moment)]
Tick = Annotated[Seconds, at_least(SHORTEST_S, "s", or_zero=True)]
UavSpeed = Annotated[Positive, Field(le=1e5), at_least(0.01, "m/s")]
UavRate = Annotated[Positive, Field(le=1e5), at_least(0.01, "of that unit")]
Radius = Annotated[Positive, Field(le=FARTHEST_M), at_least(1e-3, "m")]
Detects = Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)]
Hidden = Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)]
Tolerance = Annotated[Positive, Field(le=FARTHEST_M), at_least(1e-3, "m")]
RoadTolerance = Annotated[Finite, Field(ge=0, le=FARTHEST_M), at_least(1e-3, "m", or_zero=True)]
Probabilities = Annotated[dict[str, Finite], Field(min_length=1)]


def probability_fault(probabilities: Sequence[float]) -> str | None:
    """Return what is wrong with probabilities that should sum to one, or None."""
    negative = [p for p in probabilities if p < 0]
    if negative:
        return f"the probability {as_written(negative[0])} is negative; give numbers from 0 to 1"
    total = math.fsum(probabilities)
    if abs(total - 1) > SUM_TOLERANCE:
        return (
            f"the probabilities sum to {as_written(total)}, not to one; change them until they do"
        )
    return None


class Section(BaseModel):
    """A table of the file: known keys of the right type only, never changed after reading."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    # What replaces a required key that is faulty, so that the rest can still be checked.
    stand_in: ClassVar[dict[str, Any]] = {}

    @classmethod
    def attempt(cls, table: Any) -> tuple[Self | None, list[Any]]:
        """Return a section as far as its table is sound, and what the check of it reports.

        Faulty keys count as left out. None if it is no table at all.
        """
        section, errors = cls.checked(table)
        if section is not None or not isinstance(table, dict):
            return section, errors
        known = _without_unknown(table, errors)
        _, remaining = cls.checked(known)
        faulty = {error["loc"][0] for error in remaining}
        sound = {key: value for key, value in known.items() if key not in faulty}
        replaced = {key: value for key, value in cls.stand_in.items() if key in faulty}
        return cls.model_validate({**sound, **replaced}), errors

    @classmethod
    def checked(cls, table: Any) -> tuple[Self | None, list[Any]]:
        """Return a section, or None and what the check of it reports."""
        try:
            return cls.model_validate(table), []
        except ValidationError as error:
            return None, list(error.errors(include_url=False))


def _without_unknown(table: dict[str, Any], errors: list[Any]) -> dict[str, Any]:
    known = copy.deepcopy(table)
    for error in errors:
        if error["type"] == "extra_forbidden":
            *parents, last = (p for p in error["loc"] if not str(p).startswith("~"))
            functools.reduce(operator.getitem, parents, known).pop(last)
    return known


class NormalSection(Section):
    """A normal distribution cut off below ``low`` and above ``high``."""

    mean: Finite = Field(description="the mean before cutting off")
    sd: Positive = Field(description="the standard deviation before cutting off")
    low: Finite = Field(description="the lowest value that occurs")
    high: Finite = Field(description="the highest value that occurs")


class DistributionSection(Section):
    """A distribution in one of four forms."""

    forms: ClassVar[tuple[str, ...]] = ("uniform", "normal", "list", "constant")

    uniform: Annotated[tuple[Finite, Finite], Field(strict=False)] | None = Field(
        default=None, description="the lowest and the highest value, as in uniform = [15, 25]"
    )
    normal: NormalSection | None = Field(
        default=None, description="normal = { mean = 20, sd = 2, low = 15, high = 25 }"
    )
    list: Annotated[tuple[Finite, ...], Field(strict=False, min_length=1)] | None = Field(
        default=None, description="the values that occur, as in list = [15, 20, 25]"
    )
    probabilities: Annotated[tuple[Finite, ...], Field(strict=False)] | None = Field(
        default=None, description="one probability for each value of the list"
    )
    constant: Finite | None = Field(default=None, description="the one value, as in constant = 20")

    @model_validator(mode="after")
    def _sound(self) -> "DistributionSection":
        fault = _distribution_fault(self)
        if fault:
            raise ValueError(fault)
        return self

    @property
    def low(self) -> float:
        """The lowest value that occurs."""
        return self._ends()[0]

    @property
    def high(self) -> float:
        """The highest value that occurs."""
        return self._ends()[1]

    @property
    def form(self) -> str:
        """Which of the forms it has."""
        return next(form for form in self.forms if getattr(self, form) is not None)

    def _ends(self) -> tuple[float, float]:
        if self.uniform is not None:
            return self.uniform
        if self.normal is not None:
            return self.normal.low, self.normal.high
        values = self.list or (self.constant or 0.0,)
        return min(values), max(values)


def _distribution_fault(section: DistributionSection) -> str | None:
    """Return what is wrong with a distribution, or None."""
    given = [form for form in section.forms if getattr(section, form) is not None]
    if len(given) != 1:
        return (
            f"gives {' and '.join(given) or 'nothing'}; write exactly one of "
            "{ uniform = [low, high] }, { normal = ... }, { list = [...] }, { constant = x }"
        )
    if section.uniform is not None or section.normal is not None:
        return _range_fault(section)
    return _list_fault(section)


def _range_fault(section: DistributionSection) -> str | None:
    low, high, normal = section.low, section.high, section.normal
    if low == high:
        value = as_written(low)
        return f"holds the one value {value}; write {{ constant = {value} }}"
    if not low < high:
        return (
            f"low {as_written(low)} is not below high {as_written(high)}; write the lower one first"
        )
    if section.probabilities is not None:
        return "gives probabilities without a list; add list = [...] or leave them out"
    if normal is not None:
        away = max(low - normal.mean, normal.mean - high) / normal.sd
        if away > FARTHEST_SD:
            return f"lies {away:.0f} sd from its mean; choose a mean nearer to low and high"
    return None


def _list_fault(section: DistributionSection) -> str | None:
    if section.probabilities is None:
        return None
    if section.list is None:
        return "gives probabilities without a list; add list = [...] or leave them out"
    if len(section.list) != len(section.probabilities):
        return (
            f"has {len(section.list)} values but {len(section.probabilities)} probabilities; "
            "give one probability for each value"
        )
    return probability_fault(section.probabilities)


def edges_alike(edges: Any) -> Any:
    """Return a list of edges as a table in which each has the same probability."""
    if not isinstance(edges, list):
        return edges
    edges = [name_of(edge) for edge in edges]
    if not all(isinstance(edge, str) for edge in edges):
        raise ValueError("should name edges; write each edge's name in quotes")
    repeated = sorted({edge for edge in edges if edges.count(edge) > 1})
    if repeated:
        raise ValueError(f"names {', '.join(repeated)} more than once; name each edge once")
    return {edge: 1 / len(edges) for edge in edges}


def no_edge_alone(word: str) -> str:
    """Return the word for all edges; an edge's name alone is refused with how it is written."""
    if word != "anywhere":
        name = as_written(word)
        raise ValueError(f'should be "anywhere" or a list, not {name}; for the edge write [{name}]')
    return word


def _above_zero(speeds: DistributionSection) -> DistributionSection:
    if speeds.low <= 0:
        raise ValueError(f"reaches down to {as_written(speeds.low)} m/s; give speeds above 0")
    if speeds.low < SLOWEST_MPS:
        raise ValueError(
            f"reaches down to {as_written(speeds.low)} m/s; "
            f"give speeds from {as_written(SLOWEST_MPS)} on"
        )
    if speeds.high > FASTEST_MPS:
        raise ValueError(
            f"reaches up to {as_written(speeds.high)} m/s; "
            f"give speeds up to {as_written(FASTEST_MPS)}"
        )
    return speeds


def _from_zero(distances: DistributionSection) -> DistributionSection:
    if distances.low < 0:
        raise ValueError(f"reaches down to {as_written(distances.low)} m; give distances from 0 on")
    if distances.high > FARTHEST_M:
        raise ValueError(
            f"reaches up to {as_written(distances.high)} m; "
            f"give distances up to {as_written(FARTHEST_M)}"
        )
    return distances


Speeds = Annotated[DistributionSection, AfterValidator(_above_zero)]
Distances = Annotated[
    Annotated[Literal["anywhere"], Tag("~word")]
    | Annotated[DistributionSection, AfterValidator(_from_zero), Tag("~DistributionSection")],
    Discriminator(lambda value: "~word" if isinstance(value, str) else "~DistributionSection"),
]


class TurnFile(Section):
    """A file of SUMO edgeRelations."""

    file: str = Field(description="the path of a SUMO turn file")


def _turning_form(value: Any) -> str:
    if isinstance(value, TurnFile) or (isinstance(value, dict) and not _is_pairs(value)):
        return "~TurnFile"
    return "~word" if isinstance(value, str) else "~pairs"


def _is_pairs(value: dict[str, Any]) -> bool:
    return not isinstance(value.get("file", {}), str)


Turning = Annotated[
    Annotated[Literal["equal"], Tag("~word")]
    | Annotated[dict[str, Probabilities], Tag("~pairs")]
    | Annotated[TurnFile, Tag("~TurnFile")],
    Discriminator(_turning_form),
]
