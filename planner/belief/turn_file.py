"""Turn probabilities from SUMO's own format, read as SUMO's jtrrouter reads it."""

import logging
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from planner.belief.prior import TurnTable
from planner.clock import clock, sumo_seconds
from planner.errors import InputError
from planner.messages import as_written
from planner.xml_guard import xml_elements

log = logging.getLogger(__name__)


@dataclass
class _Interval:
    """What a file says of the turns from a time to another, seconds."""

    begin_s: float = 0.0
    end_s: float = math.inf
    shares: TurnTable = field(default_factory=dict)  # counts, per cent or parts of one
    sinks: set[str] = field(default_factory=set)
    sources: bool = False

    def lasts_s(self, horizon_s: float) -> float:
        """Return for how long it holds within the search."""
        return max(0.0, min(self.end_s, horizon_s) - max(self.begin_s, 0.0))


def read_turns(
    path: Path, horizon_s: float = math.inf, *, note: Callable[[str], None] = log.info
) -> TurnTable:
    """Return the shares of a file of ``edgeRelation`` elements, by its two edges.

    Counts, per cent and shares that were rounded come out as parts of one. A sink has no ways. Of
    several intervals, those within the search count for as long as they hold there.

    Parameters
    ----------
    horizon_s
        Up to when the target is looked for, seconds on its clock, which is the file's.
    note
        Is told what of the file counts otherwise than it may seem.

    Raises
    ------
    InputError
        If the file is missing, is not such a file, or gives a turn twice for the same time.
    """
    intervals = [one for one in _intervals(path) if one.shares or one.sinks or one.sources]
    if not any(one.shares or one.sinks for one in intervals):
        raise InputError(f"{path}: holds no edgeRelation; give a SUMO turn file")
    if any(one.sources for one in intervals):
        note(f"{path}: its sources are not read; target.start says where the target starts")
    if len(intervals) == 1:
        return _joined(intervals, [1.0])
    lasts_s = [one.lasts_s(horizon_s) for one in intervals]
    if not any(lasts_s):
        raise InputError(
            f"{path}: none of its {len(intervals)} intervals lies within the search, 0:00:00 to "
            f"{clock(horizon_s)} on the target's clock; keep the one that is meant"
        )
    if math.isinf(max(lasts_s)):
        lasts_s = [float(math.isinf(one)) for one in lasts_s]
    used = [(one, s) for one, s in zip(intervals, lasts_s, strict=True) if s > 0]
    if len(used) > 1:
        note(
            f"{path}: {len(used)} intervals lie within the search; turns have the mean of their "
            "shares"
        )
    return _joined([one for one, _ in used], [s for _, s in used])


def _joined(intervals: list[_Interval], weights: list[float]) -> TurnTable:
    """Return the weighted mean of the shares of intervals; those of one are as they are."""
    turns: TurnTable = {}
    for interval, weight in zip(intervals, weights, strict=True):
        for start, ways in interval.shares.items():
            total = math.fsum(ways.values())
            if total > 0:  # else nothing is known of it, and it turns as edges do by default
                onward = turns.setdefault(start, {})
                for end, share in ways.items():
                    onward[end] = onward.get(end, 0.0) + weight * share / total
        turns.update({sink: {} for sink in interval.sinks})
    for interval in intervals:
        turns.update({sink: {} for sink in interval.sinks})
    return {start: _parts_of_one(ways) for start, ways in turns.items()}


def _parts_of_one(ways: dict[str, float]) -> dict[str, float]:
    total = math.fsum(ways.values())
    return {end: share / total for end, share in ways.items()}


def _intervals(path: Path) -> list[_Interval]:
    """Return the intervals of a file, and first what stands outside of any."""
    loose = _Interval()
    found, here = [loose], _Interval()
    within: list[tuple[str, Any]] = []  # of an older format: the ways of a fromEdge
    for element in xml_elements(path):
        said = element.attrib
        match element.tag.rpartition("}")[2]:
            case "edgeRelation":
                _add(path, here, (said.get("from"), said.get("to")), said)
            case "toEdge":
                within.append((said.get("id"), said))
            case "fromEdge":
                for end, ways in within:
                    _add(path, here, (said.get("id"), end), ways)
                within = []
            case "sink":
                here.sinks.update(_names(said))
            case "source":
                here.sources = True
            case "interval":
                here.begin_s = _time(path, said.get("begin", "0"))
                here.end_s = _time(path, said.get("end", "inf"))
                found.append(here)
                here = _Interval()
    # Elements are told of as they end: what is left stood after the last interval.
    loose.shares, loose.sinks, loose.sources = here.shares, here.sinks, here.sources
    return found


def _names(said: dict[str, str]) -> Iterator[str]:
    yield from said.get("edges", said.get("id", "")).replace(",", " ").split()


def _add(
    path: Path, interval: _Interval, turn: tuple[str | None, str | None], said: dict[str, str]
) -> None:
    start, end = turn
    if start is None or end is None:
        raise InputError(f"{path}: an edgeRelation lacks from or to; add both")
    ways = interval.shares.setdefault(start, {})
    if end in ways:
        raise InputError(
            f"{path}: gives the turn from {start} to {end} twice; keep one of them in an interval"
        )
    ways[end] = _share(path, f"{start} to {end}", said.get("count", said.get("probability")))


def _share(path: Path, turn: str, text: str | None) -> float:
    try:
        share = float(text or "")
    except ValueError:
        share = math.nan
    if not 0 <= share < 1e15:
        what = "no probability" if text is None else f"probability {as_written(text)}"
        raise InputError(
            f"{path}: the turn from {turn} has {what}; give a count or a share, a number from 0 on"
        )
    return share


def _time(path: Path, text: str) -> float:
    try:
        return math.inf if text == "inf" else sumo_seconds(text)
    except InputError as error:
        raise InputError(f"{path}: an interval's time {error}") from error
