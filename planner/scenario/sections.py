"""A scenario: the file a person edits, as frozen sections of checked values.

`planner.scenario.draft` reads them from ``scenario.toml``; `planner.mission.opening` opens the
network with them.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from planner.scenario.areas import Area
from planner.scenario.news import NewsSection
from planner.scenario.source import FILE
from planner.scenario.target import TargetSection
from planner.scenario.traffic import TrafficSection
from planner.scenario.uav import UavSection
from planner.scenario.values import (
    Credit,
    Detects,
    Name,
    Positive,
    PositiveSeconds,
    Radius,
    RoadTolerance,
    Seconds,
    Section,
    Tick,
    Tolerance,
)

OF_SUMO = "sumo:"  # begins a path below the folder of the SUMO that is installed
OF_OSM = "© OpenStreetMap contributors"  # whose data an extract of OpenStreetMap is


class NetworkSection(Section):
    """Where the network comes from; paths are relative to the scenario's folder.

    A ``net`` that begins with ``sumo:`` is one of those that come with SUMO.
    """

    nodes: str | None = Field(default=None, description="the path of a .nod.xml file")
    edges: str | None = Field(default=None, description="the path of an .edg.xml file")
    connections: str | None = Field(default=None, description="the path of a .con.xml file")
    signals: str | None = Field(default=None, description="the path of a .tll.xml file")
    abstract: bool = Field(
        default=False,
        description="true for nets whose coordinates and lengths stay exact, else false",
    )
    net: str | None = Field(
        default=None,
        description="the path of a SUMO .net.xml or .sumocfg file, or of an OpenStreetMap file; "
        "after sumo: one that comes with SUMO",
    )
    osm: str | None = Field(default=None, description="the path of an OpenStreetMap file")
    exits: Annotated[tuple[Name, ...], Field(strict=False)] | None = Field(
        default=None,
        description="the edges that lead off the map, as in exits = [NAME, NAME]; [] for none, or "
        "leave it out for those found at the edge of the net",
    )
    road_tolerance_m: RoadTolerance | None = Field(
        default=None,
        description="how near each other edges of a town are one road, in metres; 0 for roads as "
        "the net's edges, or leave it out for a third of the detection radius",
    )
    attribution: Credit | None = Field(
        default=None, description=f'whose data the network is, as in "{OF_OSM}"'
    )

    @property
    def files(self) -> dict[str, str]:
        """The files named, by key."""
        keys = ("nodes", "edges", "connections", "signals", "net", "osm")
        return {key: getattr(self, key) for key in keys if getattr(self, key) is not None}

    @property
    def credit(self) -> str:
        """What all that is made from the network has to say of whose data it is; may be empty."""
        return self.attribution or (OF_OSM if self.osm is not None else "")


class SensorSection(Section):
    """How far the sensor sees, and how surely."""

    radius_m: Radius = Field(
        default=500.0, description="the detection radius in metres, such as 500"
    )
    detects_in_transit: bool = Field(
        default=True, description="true if the sensor is on between roads as well, else false"
    )
    detects: Detects | None = Field(
        default=None,
        description="the probability that one pass at the UAV's speed straight over a resting "
        "target sees it, above 0 and at most 1, or leave it out for 1",
    )
    sweep_width_m: Radius | None = Field(
        default=None,
        description="in place of detects, how wide a swath a perfect sensor would sweep to find "
        "as many, in metres, at most twice the radius, or leave it out",
    )
    lookalike: Detects | None = Field(
        default=None,
        description="the share of the cars in traffic that look like the target and have to be "
        "checked, such as 0.02, or leave it out",
    )
    check_s: Positive | None = Field(
        default=None, description="for how many seconds each of these is looked at, such as 60"
    )


class AirspaceSection(Section):
    """Where the UAV may fly and where it searches: paths of GeoJSON files, or polygons."""

    within: Area | None = Field(
        default=None,
        description="the area that is searched: a GeoJSON file or [[x, y], ...], or leave it out",
    )
    no_fly: Area | None = Field(
        default=None,
        description="what is flown around: a GeoJSON file or [[x, y], ...], or leave it out",
    )
    fence: Area | None = Field(
        default=None,
        description="what is never left: a GeoJSON file or [[x, y], ...], or leave it out",
    )

    @property
    def files(self) -> dict[str, str]:
        """The files named, by key."""
        areas = {"within": self.within, "no_fly": self.no_fly, "fence": self.fence}
        return {key: area for key, area in areas.items() if isinstance(area, str)}


class FuturesSection(Section):
    """How the motion that SUMO simulates is recorded."""

    tolerance_m: Tolerance | None = Field(
        default=None,
        description="how far recorded motion may be from the simulated one, in metres, or leave "
        "it out for 1 on abstract nets and 5 on others",
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
    depth: Annotated[int, Field(ge=1, le=1_000_000)] = Field(
        default=16,
        description="how many roads a plan of greedy, exact or random has at most, such as 16",
    )
    seed: Annotated[int, Field(ge=0)] = Field(default=1, description="a whole number from 0 on")
    work: Annotated[int, Field(ge=1, le=10**15)] = Field(
        default=80_000,
        description="how many simulated legs a search may fly, such as 80000",
    )
    free: bool | None = Field(
        default=None,
        description="true if the best plan may leave the roads, else false; left out: in towns "
        "it may, on abstract nets not",
    )
    targets: Annotated[int, Field(ge=1)] | None = Field(
        default=None,
        description="on how many fresh targets a plan is evaluated, or leave it out: 4000, fewer "
        "in towns",
    )
    planning_time_s: Seconds = Field(
        default=0.0, description="the time charged for planning by simulation, as seconds or H:M:S"
    )


class GreedySection(Section):
    """Interpretations of the paper's Figures 4 to 6, the default first."""

    particles: Literal["once", "anew"] = "once"
    flags: Literal["copied", "times only"] = "copied"
    miss: Literal["horizon", "infinity", "rate"] = "horizon"
    direction: Literal["own", "both", "nearest end"] = "own"
    roads: Literal["removed", "revisited"] = "removed"
    ends: Literal["depth", "all found"] = "depth"
    tick_s: Tick = Field(
        default=0.0, description="0 for continuous time, or the length of a tick in seconds"
    )
    ties: Literal["lowest index", "earliest end"] = "lowest index"


SECTIONS: dict[str, type[Section]] = {
    "network": NetworkSection,
    "target": TargetSection,
    "truth": TargetSection,
    "uav": UavSection,
    "sensor": SensorSection,
    "airspace": AirspaceSection,
    "traffic": TrafficSection,
    "futures": FuturesSection,
    "search": SearchSection,
    "greedy": GreedySection,
    "news": NewsSection,
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
    airspace: AirspaceSection
    traffic: TrafficSection
    futures: FuturesSection
    search: SearchSection
    greedy: GreedySection
    news: NewsSection
    others: tuple[UavSection, ...] = ()  # the UAVs beside the first, if it is a fleet
    other_targets: tuple[TargetSection, ...] = ()  # those beside the first, if there are several
    other_truths: tuple[TargetSection, ...] = ()  # as many

    @property
    def targets(self) -> tuple[TargetSection, ...]:
        """What the planners know of each target, the first one first."""
        return (self.target, *self.other_targets)

    @property
    def truths(self) -> tuple[TargetSection, ...]:
        """How each true target differs from that, applied."""
        return (self.truth, *self.other_truths)

    @property
    def hidden(self) -> float:
        """The share of true targets that no pass can see, of any one on average."""
        return sum(truth.hidden or 0.0 for truth in self.truths) / len(self.truths)

    @property
    def target_names(self) -> tuple[str, ...]:
        """What each target is called: its name, or its number from 1 on."""
        return tuple(target.called(number) for number, target in enumerate(self.targets, 1))

    @property
    def uavs(self) -> tuple[UavSection, ...]:
        """All UAVs, the first one first."""
        return (self.uav, *self.others)

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
        """When the first UAV takes off, seconds on the target's clock."""
        return self.target.last_seen_ago_s + min(uav.take_off_s for uav in self.uavs)

    def as_dict(self) -> dict[str, Any]:
        """Return the whole scenario as plain values that a scenario file may hold as well."""
        sections = {key: getattr(self, key) for key in SECTIONS}
        plain: dict[str, Any] = {
            key: section.model_dump(mode="json", exclude_none=True)
            for key, section in sections.items()
        }
        several = {"uav": self.uavs, "target": self.targets, "truth": self.truths}
        for key, tables in several.items():
            if len(tables) > 1:
                plain[key] = [one.model_dump(mode="json", exclude_none=True) for one in tables]
        silent = [
            key
            for key in ("airspace", "traffic", "futures", "news")
            if getattr(self, key) == SECTIONS[key]()
        ]
        return {"title": self.title, **{key: plain[key] for key in plain if key not in silent}}
