"""The traffic that a target drives in: a SUMO scenario, its routes alone, or a stated rate."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from pydantic import Field

from planner.errors import Fault
from planner.scenario.values import Positive, Seconds, Section

SOURCES = ("sumocfg", "routes", "vehicles_per_hour")
FILLED_S = 1800.0  # after which traffic at a stated rate is there, if nothing else is said
Files = Annotated[tuple[str, ...], Field(strict=False, min_length=1)]


class TrafficSection(Section):
    """The traffic, for targets with ``driving = "traffic"``."""

    sumocfg: str | None = Field(default=None, description="the path of a .sumocfg file")
    routes: Files | None = Field(
        default=None, description='the paths of SUMO route files, as in routes = ["town.rou.xml"]'
    )
    additional: Files | None = Field(
        default=None, description='the paths of SUMO additional files, as in ["stops.add.xml"]'
    )
    vehicles_per_hour: Annotated[Positive, Field(le=1e6)] | None = Field(
        default=None, description="how many vehicles set out in an hour, such as 1000"
    )
    at: Seconds | None = Field(
        default=None,
        description="the traffic's own time that is the target's time 0, as seconds or H:M:S",
    )
    realisations: Annotated[int, Field(ge=1, le=10_000)] = Field(
        default=8, description="in how many runs of the traffic particles drive, such as 8"
    )
    depart_offset_s: Seconds = Field(
        default=0.0,
        description="by how much at most each vehicle sets out later, as seconds or H:M:S",
    )

    @property
    def is_given(self) -> bool:
        """Whether there is any traffic."""
        return any(getattr(self, key) is not None for key in SOURCES)

    @property
    def at_s(self) -> float:
        """The traffic's own time that is the target's time 0, seconds."""
        return FILLED_S if self.at is None else self.at

    @property
    def files(self) -> Iterator[tuple[str, str]]:
        """The files named, with their keys."""
        if self.sumocfg is not None:
            yield "sumocfg", self.sumocfg
        for key in ("routes", "additional"):
            yield from ((f"{key}[{i}]", name) for i, name in enumerate(getattr(self, key) or ()))


def traffic_faults(section: TrafficSection, folder: Path) -> Iterator[Fault]:
    """Yield what is wrong with the traffic's sources."""
    given = [key for key in SOURCES if getattr(section, key) is not None]
    if len(given) > 1:
        text = f"gives {' and '.join(given)}; leave one of them"
        yield Fault("traffic", text)
    elif not given and section != TrafficSection():
        yield Fault("traffic", "has no source; give sumocfg, or routes, or vehicles_per_hour")
    elif given and given != ["routes"] and section.additional is not None:
        text = "goes with routes only; name the files in the configuration, or leave it out"
        yield Fault("traffic.additional", text)
    if given[:1] in (["sumocfg"], ["routes"]) and section.at is None:
        text = "is missing; give the traffic's own time of the target's time 0, as in \"8:00:00\""
        yield Fault("traffic.at", text)
    for key, name in section.files:
        if "\0" in name or not (folder / name).is_file():
            yield Fault(f"traffic.{key}", f"there is no file {folder / name}; correct the path")


def driving_faults(believed: str, true: str, traffic: TrafficSection) -> Iterator[Fault]:
    """Yield the fault of targets that drive in traffic of which nothing is said."""
    keys = {"target": believed, "truth": true} if true != believed else {"target": believed}
    for key, driving in keys.items():
        if driving == "traffic" and not traffic.is_given:
            text = '"traffic" needs to know which; give [traffic] sumocfg, routes or'
            yield Fault(f"{key}.driving", f"{text} vehicles_per_hour")
