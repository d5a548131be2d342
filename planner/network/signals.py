"""The ways through junctions: their length and speed, and when their signals let cars pass."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import BadZipFile

import numpy as np

from planner.arrays import Flags, Floats, Frozen, Ints, Offsets, freeze
from planner.cache import cache_folder, is_whole, seal
from planner.checked import finite, lengths, offsets
from planner.errors import InputError
from planner.files import written_whole
from planner.guard import elements_in
from planner.network.road_network import RoadNetwork
from planner.network.sumo import CAR

SIGNALS_VERSION = 1  # goes into the name of kept columns: raise it when their meaning changes
IN_MEMORY = 8  # networks whose signals a process keeps
LONGEST_S = 3600  # of a cycle that is heeded
ELEMENTS = re.compile(rb"<(?:connection|tlLogic|phase|lane)[\s/>]")
STOP, YIELD, GO = 0, 1, 2  # what a signal shows: red or amber, green for who gives way, green
SHOWN = {"G": GO, "O": GO, "g": YIELD, "o": YIELD, "s": YIELD}
MINOR = "m=sw"  # states of links without a signal that give way
SLOWEST_MPS = 1.0  # on a way through a junction


@dataclass(frozen=True, eq=False)
class Signals(Frozen):
    """What a car meets at each of a network's turns, (T,) as ``RoadNetwork.turn_edge``."""

    first_second: Offsets  # (T + 1,) where a turn's seconds start in shows; none: no signal
    shows: Ints  # (S,) STOP, YIELD or GO in each second of the signal's cycle
    offset_s: Ints  # (T,) seconds by which a cycle begins later than SUMO's second 0
    actuated: Flags  # (T,) whether detectors prolong its phases; those given are then nominal
    minor: Flags  # (T,) whether one gives way there, without a signal
    through_m: Floats  # (T,) metres through the junction
    through_mps: Floats  # (T,) speed limit there

    def __post_init__(self) -> None:
        freeze(
            self,
            first_second=np.int64,
            shows=np.uint8,
            offset_s=np.int32,
            actuated=np.bool_,
            minor=np.bool_,
            through_m=np.float64,
            through_mps=np.float64,
        )
        turns = len(self.through_m)
        ways = {"through_m": self.through_m, "through_mps": self.through_mps}
        lengths(turns, offset_s=self.offset_s, actuated=self.actuated, minor=self.minor, **ways)
        offsets("first_second", self.first_second, turns, len(self.shows))
        finite(**ways)
        if not (np.all(self.through_m >= 0.0) and np.all(self.through_mps >= SLOWEST_MPS)):
            raise InputError("through_m, through_mps: ways through junctions lack length or speed")

    @property
    def cycle_s(self) -> Ints:
        """Seconds of each turn's cycle, (T,); 0 where there is no signal."""
        return np.diff(self.first_second)


def signal_cycle_s(network: RoadNetwork) -> int:
    """Return after how many seconds all signals of a net show the same again.

    That is the least common multiple of their cycles, `LONGEST_S` at most; of actuated signals the
    phases that the net states count. 1 where there is no signal.
    """
    found = np.unique(signals_of(network).cycle_s)
    return min(math.lcm(*found[found > 0].tolist()), LONGEST_S)


@lru_cache(IN_MEMORY)
def signals_of(network: RoadNetwork) -> Signals:
    """Return the signals and ways through junctions of a network, read once and kept.

    Raises
    ------
    InputError
        If its file cannot be read any more, or holds a number that is none.
    """
    kept = cache_folder("nets") / f"{network.sha256[:32]}.signals{SIGNALS_VERSION}.npz"
    columns = _load(kept) if is_whole(kept) else None
    if columns is None or len(columns["through_m"]) != len(network.turn_edge):
        columns = _read(network.path, network)
        with written_whole(kept) as new, new.open("wb") as file:
            np.savez(file, **columns)
        seal(kept)
    return Signals(**columns)


def _load(path: Path) -> dict[str, Any] | None:
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as kept:
            return {field.name: kept[field.name] for field in fields(Signals)}
    except (OSError, ValueError, KeyError, EOFError, BadZipFile):
        return None


class _Lane(NamedTuple):
    """A lane, of a road or within a junction."""

    length_m: float
    limit_mps: float
    for_cars: bool


class _Program(NamedTuple):
    """What a signal shows to its links."""

    offset_s: int
    actuated: bool
    phases: list[tuple[float, str]]  # seconds, and a letter for each link


class _File(NamedTuple):
    """What a net's file says of lanes, links and signals."""

    lanes: dict[str, _Lane]
    links: dict[tuple[str, str], dict[str, str]]  # from edge to edge, the first one for cars
    onward: dict[str, str]  # from a lane within a junction to the next one there
    programs: dict[str, _Program]


def _read(path: Path, network: RoadNetwork) -> dict[str, Any]:
    try:
        file = _parsed(elements_in(path, ELEMENTS))
        ways = [_way(file, *names, limit) for names, limit in _named_turns(network)]
    except (ValueError, KeyError, IndexError, OverflowError) as error:
        raise InputError(
            f"{network.given_as}: its signals or links cannot be read ({error!r}); "
            "give a .net.xml that netconvert or netedit wrote"
        ) from error
    return {
        "first_second": np.cumsum([0, *(len(way.shows) for way in ways)]),
        "shows": np.concatenate([np.zeros(0, np.uint8), *(way.shows for way in ways)]),
        "offset_s": np.array([way.offset_s for way in ways], dtype=np.int32),
        "actuated": np.array([way.actuated for way in ways], dtype=bool),
        "minor": np.array([way.minor for way in ways], dtype=bool),
        "through_m": np.array([way.length_m for way in ways], dtype=np.float64),
        "through_mps": np.array([way.limit_mps for way in ways], dtype=np.float64),
    }


def _named_turns(network: RoadNetwork) -> Iterator[tuple[tuple[str, str], float]]:
    """Yield the two edges of each turn, and the lower of their limits."""
    left = np.repeat(np.arange(len(network.edge_ids)), np.diff(network.first_turn))
    limits = np.minimum(network.edge_limit_mps[left], network.edge_limit_mps[network.turn_edge])
    for start, end, limit in zip(left, network.turn_edge, limits, strict=True):
        yield (network.edge_ids[start], network.edge_ids[end]), float(limit)


class _Way(NamedTuple):
    """One turn of the network."""

    shows: Ints
    offset_s: int
    actuated: bool
    minor: bool
    length_m: float
    limit_mps: float


NO_SIGNAL = _Program(0, False, [])


def _way(file: _File, start: str, end: str, limit_mps: float) -> _Way:
    link = file.links.get((start, end), {})
    length_m, via = 0.0, link.get("via")
    passed: set[str] = set()
    while via is not None and via in file.lanes and via not in passed:
        passed.add(via)
        length_m += file.lanes[via].length_m
        limit_mps = min(limit_mps, file.lanes[via].limit_mps)
        via = file.onward.get(via)
    program = file.programs.get(link.get("tl", ""), NO_SIGNAL)
    shows = _seconds(program, int(link.get("linkIndex", "0")))
    minor = not len(shows) and link.get("state", "M") in MINOR
    limit_mps = max(limit_mps, SLOWEST_MPS)
    return _Way(shows, program.offset_s, program.actuated, minor, length_m, limit_mps)


def _seconds(program: _Program, link: int) -> Ints:
    """Return what a link is shown in each second of a cycle; nothing if it never stops there."""
    ends_s = np.cumsum([lasts for lasts, _ in program.phases])
    seconds = np.arange(min(round(ends_s[-1]), LONGEST_S) if len(ends_s) else 0)
    shown = np.array([SHOWN.get(state[link], STOP) for _, state in program.phases], dtype=np.uint8)
    shows = shown[np.searchsorted(ends_s, seconds, side="right")] if len(seconds) else shown[:0]
    # A link that is never let pass is one that detectors, or another program, would open.
    return shows if np.any(shows != STOP) else shows[:0]


def _parsed(elements: Iterable[tuple[str, Mapping[str, str]]]) -> _File:
    lanes: dict[str, _Lane] = {}
    programs: dict[str, _Program] = {}
    connections: list[dict[str, str]] = []
    last = NO_SIGNAL
    for name, said in elements:
        if name == "lane":
            lanes[said["id"]] = _lane(said)
        elif name == "tlLogic":
            # SUMO runs the program that was read last.
            last = _Program(_offset_s(said), said.get("type", "static") != "static", [])
            programs[said["id"]] = last
        elif name == "phase":
            last.phases.append((max(float(said["duration"]), 0.0), said["state"]))
        else:
            connections.append(dict(said))
    return _File(lanes, *_links(connections, lanes), programs)


def _lane(said: Mapping[str, str]) -> _Lane:
    allowed = said.get("allow", "all").split()
    barred = said.get("disallow", "").split()
    for_cars = CAR in allowed or ("all" in allowed and not {CAR, "all"} & set(barred))
    return _Lane(float(said["length"]), float(said["speed"]), for_cars)


def _offset_s(said: Mapping[str, str]) -> int:
    offset = said.get("offset", "0")
    return 0 if offset == "begin" else round(float(offset))


def _links(
    connections: Sequence[dict[str, str]], lanes: Mapping[str, _Lane]
) -> tuple[dict[tuple[str, str], dict[str, str]], dict[str, str]]:
    links: dict[tuple[str, str], dict[str, str]] = {}
    onward: dict[str, str] = {}
    for said in connections:
        start, end = f"{said['from']}_{said['fromLane']}", f"{said['to']}_{said['toLane']}"
        if said["from"].startswith(":"):
            if "via" in said:
                onward[start] = said["via"]
        elif lanes[start].for_cars and lanes[end].for_cars:
            links.setdefault((said["from"], said["to"]), said)
    return links, onward
