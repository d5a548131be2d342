"""Lanes, ways through junctions, and when their signals let cars pass, as columns."""

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache, lru_cache
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Frozen, Ints, Offsets, first_of_parts, freeze
from planner.cache import cache_folder, is_whole, seal
from planner.checked import finite, lengths, offsets
from planner.errors import InputError
from planner.network.links import NO_SIGNAL, Lane, NetFile, Program, idle_cycle, read_links
from planner.network.road_network import RoadNetwork
from planner.npz import read_columns, write_columns

SIGNALS_VERSION = 3  # goes into the name of kept columns: raise it when their meaning changes
IN_MEMORY = 8  # networks whose signals a process keeps
LONGEST_S = 3600  # of a cycle that is heeded
STOP, YIELD, GO = 0, 1, 2  # what a signal shows: red or amber, green for who gives way, green
SHOWN = {"G": GO, "O": GO, "g": YIELD, "o": YIELD, "s": YIELD}
MINOR = "m=sw"  # states of links without a signal that give way
SLOWEST_MPS = 1.0  # on a way through a junction


@dataclass(frozen=True, eq=False)
class Signals(Frozen):
    """What a car meets on E edges and at T turns, which are counted as ``RoadNetwork`` does.

    Lines are the E lanes that a car drives on, one per edge and the rightmost it may use, and then
    the T ways through junctions.
    """

    first_second: Offsets  # (T + 1,) where a turn's seconds start in shows; none: no signal
    # (S,) STOP, YIELD or GO in each second of a cycle in which no car comes; all STOP: never open
    shows: Ints
    offset_s: Ints  # (T,) seconds by which a cycle begins later than SUMO's second 0
    cycle_s: Ints  # (T,) seconds of a cycle as the program states it; 0: no signal
    actuated: Flags  # (T,) whether detectors prolong its phases
    minor: Flags  # (T,) whether one gives way there, without a signal
    first_point: Offsets  # (E + T + 1,) where a line's points start
    xy_m: Floats  # (P, 2) metres
    length_m: Floats  # (E + T,) metres, as SUMO drives a line
    limit_mps: Floats  # (E + T,) speed limit

    def __post_init__(self) -> None:
        freeze(
            self,
            first_second=np.int64,
            shows=np.uint8,
            offset_s=np.int32,
            cycle_s=np.int32,
            actuated=np.bool_,
            minor=np.bool_,
            first_point=np.int64,
            xy_m=np.float64,
            length_m=np.float64,
            limit_mps=np.float64,
        )
        turns, lines = len(self.minor), len(self.length_m)
        lengths(turns, offset_s=self.offset_s, cycle_s=self.cycle_s, actuated=self.actuated)
        offsets("first_second", self.first_second, turns, len(self.shows))
        offsets("first_point", self.first_point, lines, len(self.xy_m))
        lengths(lines, limit_mps=self.limit_mps)
        finite(xy_m=self.xy_m, length_m=self.length_m, limit_mps=self.limit_mps)
        if np.any(np.diff(self.first_point) < 2):
            raise InputError("first_point: a lane is drawn by fewer than two points")
        if not (np.all(self.length_m >= 0.0) and np.all(self.limit_mps > 0.0)):
            raise InputError("length_m, limit_mps: a lane has no length, or nobody may drive there")


COLUMNS = tuple(field.name for field in fields(Signals))


def signal_cycle_s(network: RoadNetwork) -> int:
    """Return after how many seconds all signals of a net show the same again.

    That is the least common multiple of their cycles, `LONGEST_S` at most; of actuated signals the
    phases that the net states count. 1 where there is no signal.
    """
    found = np.unique(signals_of(network).cycle_s)
    return min(math.lcm(*found[found > 0].tolist()), LONGEST_S)


@lru_cache(IN_MEMORY)
def signals_of(network: RoadNetwork) -> Signals:
    """Return the lanes, ways through junctions and signals of a network, read once and kept.

    Raises
    ------
    InputError
        If its file cannot be read any more, or holds a number that is none.
    """
    # The same net has other turns where other edges are its exits.
    turns = hashlib.sha256(network.first_turn.tobytes() + network.turn_edge.tobytes())
    name = f"{network.sha256[:32]}.{turns.hexdigest()[:8]}.signals{SIGNALS_VERSION}.npz"
    kept = cache_folder("nets") / name
    columns = read_columns(kept, COLUMNS) if is_whole(kept) else None
    if columns is None or len(columns["minor"]) != len(network.turn_edge):
        columns = _read(network.path, network)
        write_columns(kept, columns)
        seal(kept)
    return Signals(**columns)


class _Turn(NamedTuple):
    """A turn of the network."""

    shows: Ints
    offset_s: int
    cycle_s: int
    actuated: bool
    minor: bool
    line: Lane


def _read(path: Path, network: RoadNetwork) -> dict[str, Any]:
    try:
        file = read_links(path)
        shown = _shown_by(file)
        turns = [_turn(file, shown, *names) for names in _names(network)]
        lines = [file.car_lanes[edge][0] for edge in network.edge_ids] + [
            turn.line for turn in turns
        ]
    except (ValueError, LookupError, OverflowError) as error:
        raise InputError(
            f"{network.given_as}: its lanes, links or signals cannot be read ({error!r}); "
            "give a .net.xml that netconvert or netedit wrote"
        ) from error
    return {
        "first_second": first_of_parts([turn.shows for turn in turns]),
        "shows": np.concatenate([np.zeros(0, np.uint8), *(turn.shows for turn in turns)]),
        "offset_s": np.array([turn.offset_s for turn in turns], dtype=np.int32),
        "cycle_s": np.array([turn.cycle_s for turn in turns], dtype=np.int32),
        "actuated": np.array([turn.actuated for turn in turns], dtype=bool),
        "minor": np.array([turn.minor for turn in turns], dtype=bool),
        "first_point": first_of_parts([line.xy_m for line in lines]),
        "xy_m": np.concatenate([line.xy_m for line in lines]),
        "length_m": np.array([line.length_m for line in lines], dtype=np.float64),
        "limit_mps": np.array([line.limit_mps for line in lines], dtype=np.float64),
    }


def _names(network: RoadNetwork) -> Iterator[tuple[str, str]]:
    """Yield the two edges of each turn."""
    left = np.repeat(np.arange(len(network.edge_ids)), np.diff(network.first_turn))
    for start, end in zip(left.tolist(), network.turn_edge.tolist(), strict=True):
        yield network.edge_ids[start], network.edge_ids[end]


def _turn(file: NetFile, shown: Any, start: str, end: str) -> _Turn:
    links = file.links.get((start, end)) or [{}]
    link = links[0]
    program = file.programs.get(link.get("tl", ""), NO_SIGNAL)
    shows = shown(link)
    shut = len(shows) and not np.any(shows != STOP)
    if shut and (program.actuated or any(np.any(shown(other) != STOP) for other in links[1:])):
        shows = shows[:0]  # detectors would open it, or a car takes the lane beside
    cycle_s = min(max(round(sum(phase.lasts_s for phase in program.phases)), 1), LONGEST_S)
    return _Turn(
        shows,
        program.offset_s,
        cycle_s if len(shows) else 0,
        program.actuated,
        not len(shows) and link.get("state", "M") in MINOR,
        _line(file.through(link), file.car_lanes[start][0], file.car_lanes[end][0]),
    )


def _line(lanes: Sequence[Lane], before: Lane, after: Lane) -> Lane:
    """Return the way over some lanes of a junction as one; there may be none."""
    ends = np.stack([before.xy_m[-1], after.xy_m[0]])
    points = np.concatenate([lane.xy_m for lane in lanes]) if lanes else ends
    limit_mps = min(lane.limit_mps for lane in lanes or (before, after))
    length_m = sum(lane.length_m for lane in lanes)
    return Lane(length_m, max(limit_mps, SLOWEST_MPS), True, points)


def _shown_by(file: NetFile) -> Any:
    """Return a function from a link to what its signal shows in each second of a cycle."""

    @cache
    def letters(signal: str) -> tuple[str, ...]:
        program: Program = file.programs.get(signal, NO_SIGNAL)
        return tuple(islice(idle_cycle(program), LONGEST_S))

    def shown(link: Mapping[str, str]) -> Ints:
        index = int(link.get("linkIndex", "0"))
        return np.array(
            [SHOWN.get(state[index], STOP) for state in letters(link.get("tl", ""))], np.uint8
        )

    return shown
