"""A scenario: the file a person edits, as frozen sections of checked values.

`planner.scenario_draft` reads them from ``scenario.toml``; `planner.belief.opening` opens the
network with them.
"""

import copy
import functools
import operator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    model_validator,
)

from planner.clock import seconds
from planner.scenario_checks import distribution_fault
from planner.scenario_source import FILE
from planner.wording import shown


def _equal(edges: Any) -> Any:
    """Return a list of edges as a table in which each has the same probability."""
    if not isinstance(edges, list):
        return edges
    if not all(isinstance(edge, str) for edge in edges):
        raise ValueError("should name edges; write each edge's name in quotes")
    repeated = sorted({edge for edge in edges if edges.count(edge) > 1})
    if repeated:
        raise ValueError(f"names {', '.join(repeated)} more than once; name each edge once")
    return {edge: 1 / len(edges) for edge in edges}


LONGEST_S = 1e9  # thirty years
FASTEST_MPS = 1000.0  # nothing on a road is as fast

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Seconds = Annotated[NotNegative, Field(le=LONGEST_S), BeforeValidator(seconds)]
PositiveSeconds = Annotated[Positive, Field(le=LONGEST_S), BeforeValidator(seconds)]
Probabilities = Annotated[dict[str, Finite], Field(min_length=1)]


class Section(BaseModel):
    """A table of the file: known keys of the right type only, never changed after reading."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    # What takes the place of a required key that is faulty, so that the rest can be looked at.
    stand_in: ClassVar[dict[str, Any]] = {}

    @classmethod
    def attempt(cls, table: Any) -> tuple[Self | None, list[Any]]:
        """Return a section as far as its table is sound, and what the check of it reports.

        Faulty keys count as left out. None if it is no table at all.
        """
        section, errors = cls._checked(table)
        if section is not None or not isinstance(table, dict):
            return section, errors
        known = _without_unknown(table, errors)
        _, remaining = cls._checked(known)
        faulty = {error["loc"][0] for error in remaining}
        sound = {key: value for key, value in known.items() if key not in faulty}
        replaced = {key: value for key, value in cls.stand_in.items() if key in faulty}
        return cls.model_validate({**sound, **replaced}), errors

    @classmethod
    def _checked(cls, table: Any) -> tuple[Self | None, list[Any]]:
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
        fault = distribution_fault(self)
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


def _above_zero(speeds: DistributionSection) -> DistributionSection:
    if speeds.low <= 0:
        raise ValueError(f"reaches down to {shown(speeds.low)} m/s; give speeds above 0")
    if speeds.high > FASTEST_MPS:
        raise ValueError(
            f"reaches up to {shown(speeds.high)} m/s; give speeds up to {shown(FASTEST_MPS)}"
        )
    return speeds


def _from_zero(distances: DistributionSection) -> DistributionSection:
    if distances.low < 0:
        raise ValueError(f"reaches down to {shown(distances.low)} m; give distances from 0 on")
    return distances


Speeds = Annotated[DistributionSection, AfterValidator(_above_zero)]
Distances = Annotated[
    Annotated[Literal["anywhere"], Tag("~word")]
    | Annotated[DistributionSection, AfterValidator(_from_zero), Tag("~DistributionSection")],
    Discriminator(lambda value: "~word" if isinstance(value, str) else "~DistributionSection"),
]
StartEdges = Annotated[
    Annotated[Literal["anywhere"], Tag("~word")]
    | Annotated[Probabilities, BeforeValidator(_equal), Tag("~table")],
    Discriminator(lambda value: "~word" if isinstance(value, str) else "~table"),
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


class NetworkSection(Section):
    """Where the network comes from; paths are relative to the scenario's folder."""

    nodes: str | None = Field(default=None, description="the path of a .nod.xml file")
    edges: str | None = Field(default=None, description="the path of an .edg.xml file")
    connections: str | None = Field(default=None, description="the path of a .con.xml file")
    signals: str | None = Field(default=None, description="the path of a .tll.xml file")
    abstract: bool = Field(
        default=False,
        description="true for nets whose coordinates and lengths stay exact, else false",
    )
    net: str | None = Field(default=None, description="the path of a SUMO .net.xml file")
    osm: str | None = Field(default=None, description="the path of an OpenStreetMap file")

    @property
    def files(self) -> dict[str, str]:
        """The files named, by key."""
        keys = ("nodes", "edges", "connections", "signals", "net", "osm")
        return {key: getattr(self, key) for key in keys if getattr(self, key) is not None}


class TargetSection(Section):
    """What is known of the target: the paper's p(r0), p(d0), p(v0) and its transition model."""

    stand_in: ClassVar[dict[str, Any]] = {"start": "anywhere"}

    start: StartEdges = Field(
        description='"anywhere", a list of edges, or a table of edges and their probabilities'
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
    driving: Literal["constant", "free"] = "constant"
    at_sink: Literal["stays", "gone"] = "stays"
    probability_present: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = Field(
        default=1.0,
        description="the probability that the target is there at all, above 0 and at most 1",
    )
    last_seen_ago_s: Seconds = Field(
        default=0.0, description="how long ago the target was at its start, as seconds or H:M:S"
    )


class PointStart(Section):
    """A place in the network's coordinates."""

    x_m: Finite = Field(description="metres to the east")
    y_m: Finite = Field(description="metres to the north")


class NodeStart(Section):
    """A place some way off a node."""

    node: str = Field(description="the name of a node")
    bearing_deg: Finite = Field(
        default=0.0, description="the compass bearing seen from the node (0 north, 90 east)"
    )
    distance_m: NotNegative = Field(default=0.0, description="metres from the node")


def _place_form(value: Any) -> str:
    keys = value if isinstance(value, dict) else ()
    return "~NodeStart" if isinstance(value, NodeStart) or "node" in keys else "~PointStart"


UavStart = Annotated[
    Annotated[PointStart, Tag("~PointStart")] | Annotated[NodeStart, Tag("~NodeStart")],
    Discriminator(_place_form),
]


class NodeLanding(Section):
    """A node to land at."""

    node: str = Field(description="the name of a node")


def _landing_form(value: Any) -> str:
    if isinstance(value, str):
        return "~word"
    keys = value if isinstance(value, dict) else ()
    return "~NodeLanding" if isinstance(value, NodeLanding) or "node" in keys else "~PointStart"


UavLanding = Annotated[
    Annotated[Literal["start"], Tag("~word")]
    | Annotated[PointStart, Tag("~PointStart")]
    | Annotated[NodeLanding, Tag("~NodeLanding")],
    Discriminator(_landing_form),
]


class UavSection(Section):
    """The UAV; its times count from now, `Scenario.take_off_s` tells them on the target's clock."""

    stand_in: ClassVar[dict[str, Any]] = {"start": {"x_m": 0, "y_m": 0}}

    speed_mps: Positive = Field(default=100.0, description="the UAV's speed in m/s, such as 100")
    altitude_m: NotNegative = Field(default=150.0, description="the flight altitude in metres")
    start: UavStart = Field(
        description="{ x_m = 0, y_m = 0 } or { node = NAME, bearing_deg = 315, distance_m = 0 }"
    )
    take_off_s: Seconds = Field(default=0.0, description="seconds or H:M:S from now to take-off")
    max_flight_time_s: PositiveSeconds | None = Field(
        default=None,
        description="the longest flight as seconds or H:M:S, or leave it out for no limit",
    )
    return_to: UavLanding | None = Field(
        default=None,
        description='where it has to land: "start", { node = NAME } or { x_m = 0, y_m = 0 }, '
        "or leave it out for anywhere",
    )


class SensorSection(Section):
    """The perfect sensor."""

    radius_m: Positive = Field(
        default=500.0, description="the detection radius in metres, such as 500"
    )
    detects_in_transit: bool = Field(
        default=True, description="true if the sensor is on between roads as well, else false"
    )


class SearchSection(Section):
    """How long and with how much work the search is planned."""

    horizon_s: PositiveSeconds = Field(
        default=10000.0,
        description="when the search stops, as seconds or H:M:S on the target's clock",
    )
    objective: Literal["time", "probability"] = Field(
        default="time",
        description='"time" for the least expected detection time, or "probability" for the '
        "greatest one of finding the target by by_s",
    )
    by_s: PositiveSeconds | None = Field(
        default=None,
        description='the deadline of objective = "probability", as seconds or H:M:S on the '
        "target's clock",
    )
    particles: Annotated[int, Field(ge=1)] = Field(
        default=1000, description="how many possible targets are simulated, such as 1000"
    )
    sampling: Literal["iid", "sobol", "all"] = "iid"
    depth: Annotated[int, Field(ge=1)] = Field(
        default=16, description="how many roads a plan has at most, such as 16"
    )
    seed: Annotated[int, Field(ge=0)] = Field(default=1, description="a whole number from 0 on")
    work: Annotated[int, Field(ge=1)] = Field(
        default=80_000,
        description="how many legs a search may fly in thought, such as 80000",
    )
    free: bool = Field(
        default=False, description="true if the best plan may leave the roads, else false"
    )
    planning_time_s: Seconds = Field(
        default=0.0, description="what planning by simulation is charged, as seconds or H:M:S"
    )


class GreedySection(Section):
    """Readings of the paper's Figures 4 to 6, the default first."""

    particles: Literal["once", "anew"] = "once"
    flags: Literal["copied", "times only"] = "copied"
    miss: Literal["horizon", "infinity", "rate"] = "horizon"
    direction: Literal["own", "both", "nearest end"] = "own"
    roads: Literal["removed", "revisited"] = "removed"
    ends: Literal["depth", "all found"] = "depth"
    tick_s: NotNegative = Field(
        default=0.0, description="0 for continuous time, or the length of a tick in seconds"
    )
    ties: Literal["lowest index", "earliest end"] = "lowest index"


SECTIONS: dict[str, type[Section]] = {
    "network": NetworkSection,
    "target": TargetSection,
    "truth": TargetSection,
    "uav": UavSection,
    "sensor": SensorSection,
    "search": SearchSection,
    "greedy": GreedySection,
}


@dataclass(frozen=True)
class Scenario:
    """A scenario whose sections are each sound and agree with each other."""

    path: Path  # of the file it comes from
    title: str
    network: NetworkSection
    target: TargetSection  # what the planners know
    truth: TargetSection  # how the true targets differ from that, applied
    uav: UavSection
    sensor: SensorSection
    search: SearchSection
    greedy: GreedySection

    @property
    def name(self) -> str:
        """The scenario's name: that of its folder, or of a file that is called otherwise."""
        return self.path.resolve().parent.name if self.path.name == FILE else self.path.stem

    @property
    def folder(self) -> Path:
        """Where the scenario's relative paths start."""
        return self.path.parent

    @property
    def take_off_s(self) -> float:
        """When the UAV takes off, seconds on the target's clock."""
        return self.target.last_seen_ago_s + self.uav.take_off_s

    def as_dict(self) -> dict[str, Any]:
        """Return the whole scenario as plain values that a scenario file may hold as well."""
        sections = {key: getattr(self, key) for key in SECTIONS}
        plain = {
            key: section.model_dump(mode="json", exclude_none=True)
            for key, section in sections.items()
        }
        return {"title": self.title, **plain}
