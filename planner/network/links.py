"""What a net's file says of lanes, of links between them and of signals, in one reading."""

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.network.sumo import CAR
from planner.xml_guard import elements_in

ELEMENTS = re.compile(rb"<(?:connection|tlLogic|phase|lane)[\s/>]")


class Lane(NamedTuple):
    """A lane, of a road or within a junction."""

    length_m: float
    limit_mps: float
    for_cars: bool
    xy_m: Floats  # (k, 2) metres


class Phase(NamedTuple):
    """A time in which a signal shows the same."""

    lasts_s: float  # as the program states it
    idle_s: float  # where no car prolongs it
    state: str  # a letter for each link


class Program(NamedTuple):
    """What a signal shows to its links."""

    offset_s: int
    actuated: bool
    phases: list[Phase]


NO_SIGNAL = Program(0, False, [])


class NetFile(NamedTuple):
    """Lanes, links and signals by their names."""

    lanes: dict[str, Lane]
    car_lanes: dict[str, list[Lane]]  # by edge: those that a car may use, the rightmost first
    links: dict[tuple[str, str], list[Mapping[str, str]]]  # from edge to edge, those for cars
    every: list[Mapping[str, str]]  # links for cars, from lane to lane
    onward: dict[str, str]  # from a lane within a junction to the next one there
    programs: dict[str, Program]

    def through(self, link: Mapping[str, str]) -> list[Lane]:
        """Return the lanes within a junction that a link leads over, in driving order."""
        names: dict[str, None] = {}
        via = link.get("via")
        while via is not None and via in self.lanes and via not in names:
            names[via] = None
            via = self.onward.get(via)
        return [self.lanes[name] for name in names]


def read_links(path: Path) -> NetFile:
    """Return the lanes, links and signals of a ``.net.xml``.

    Raises
    ------
    InputError
        If it cannot be read.
    ValueError, LookupError
        If an element lacks something, or a number is none.
    """
    lanes: dict[str, Lane] = {}
    programs: dict[str, Program] = {}
    connections: list[Mapping[str, str]] = []
    last = NO_SIGNAL
    for name, said in elements_in(path, ELEMENTS):
        if name == "lane":
            lanes[said["id"]] = _lane(said)
        elif name == "tlLogic":
            # SUMO runs the program that was read last.
            last = Program(_offset_s(said), said.get("type", "static") != "static", [])
            programs[said["id"]] = last
        elif name == "phase":
            last.phases.append(_phase(said, actuated=last.actuated))
        else:
            connections.append(said)
    every, onward = _links(connections, lanes)
    links: dict[tuple[str, str], list[Mapping[str, str]]] = {}
    for link in every:
        links.setdefault((link["from"], link["to"]), []).append(link)
    return NetFile(lanes, _car_lanes(lanes), links, every, onward, programs)


def _lane(said: Mapping[str, str]) -> Lane:
    allowed = said.get("allow", "all").split()
    barred = said.get("disallow", "").split()
    for_cars = CAR in allowed or ("all" in allowed and not {CAR, "all"} & set(barred))
    points = [point.split(",")[:2] for point in said["shape"].split()]
    xy_m = np.array(points, dtype=np.float64).reshape(-1, 2)
    return Lane(float(said["length"]), float(said["speed"]), for_cars, xy_m)


def _offset_s(said: Mapping[str, str]) -> int:
    offset = said.get("offset", "0")
    return 0 if offset == "begin" else round(float(offset))


def _phase(said: Mapping[str, str], *, actuated: bool) -> Phase:
    lasts_s = max(float(said["duration"]), 0.0)
    idle_s = max(float(said.get("minDur", lasts_s)), 0.0) if actuated else lasts_s
    return Phase(lasts_s, idle_s, said["state"])


def _car_lanes(lanes: Mapping[str, Lane]) -> dict[str, list[Lane]]:
    found: dict[str, list[Lane]] = {}
    for name, lane in lanes.items():
        if lane.for_cars:
            found.setdefault(name.rpartition("_")[0], []).append(lane)
    return found


def _links(
    connections: Sequence[Mapping[str, str]], lanes: Mapping[str, Lane]
) -> tuple[list[Mapping[str, str]], dict[str, str]]:
    every: list[Mapping[str, str]] = []
    onward: dict[str, str] = {}
    for said in connections:
        start, end = f"{said['from']}_{said['fromLane']}", f"{said['to']}_{said['toLane']}"
        if said["from"].startswith(":"):
            if "via" in said:
                onward[start] = said["via"]
        elif lanes[start].for_cars and lanes[end].for_cars:
            every.append(said)
    return every, onward


def idle_cycle(program: Program) -> Iterable[str]:
    """Yield the letters that a signal shows in each second of a cycle in which no car comes."""
    ends_s = np.cumsum([phase.idle_s for phase in program.phases])
    for second in range(round(ends_s[-1]) if len(ends_s) else 0):
        yield program.phases[int(np.searchsorted(ends_s, second, side="right"))].state
