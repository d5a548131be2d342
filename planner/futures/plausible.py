"""Motion that is read is held against the network and the clock; nothing is mended in silence.

Files from elsewhere may be of another frame (degrees, another net), another clock (the time of the
day), other units (nanoseconds), or hold samples that no vehicle can have made.
"""

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets, first_rows
from planner.clock import clock
from planner.errors import InputError
from planner.futures.edges_driven import NO_EDGE
from planner.futures.fcd import Samples
from planner.futures.futures import Futures
from planner.futures.nearness import Nearness, off_edges
from planner.network.road_network import RoadNetwork
from planner.scenario.values import FASTEST_MPS

log = logging.getLogger(__name__)

SLOWEST_MPS = 0.1  # that is the most which anyone moves in a file whose seconds are none
MOVED_M = 100.0  # who moves less may well be as slow as that
AGREES = 10.0  # times as fast, or as slow, as the file itself says
UNITS = (("milliseconds", 1e3), ("microseconds", 1e6), ("nanoseconds", 1e9))
NOWHERE = -(2.0**30)  # what SUMO writes for a place that it does not have
DEGREE_M = 111_000.0
OFF_EDGE = 0.1  # of a net's extent, between these bounds: as far may a sample be from its edge
LEAST_OFF_M, MOST_OFF_M = 100.0, 1000.0
LOOKED_AT = 20_000  # of many samples, those that are held against roads
AT_ONCE = 1 << 15  # samples; so many stay in the processor's cache
LATE = 0.1  # of the horizon: who begins later may have meant another time 0
GAP, GAP_M = 10.0, 200.0  # times the usual step, and metres moved within it


class SearchTime(NamedTuple):
    """What is known of the time of a search, on the clock of a file."""

    begin_s: float | None  # time 0; None: the file's own
    horizon_s: float | None  # from then on; None: not known


class Motion(NamedTuple):
    """Samples of N vehicles or particles, each one's after the other's and in rising time."""

    noun: str
    names: Sequence[str]  # (N,)
    first: Offsets  # (N + 1,) where each one's samples start
    time_s: Floats  # (S,) seconds
    x_m: Floats  # (S,) metres
    y_m: Floats  # (S,) metres
    edge: Ints  # (S,) NO_EDGE where unknown
    speed_mps: Floats | None = None  # (S,) m/s, NaN where unknown

    def name(self, row: int) -> str:
        """Return whose a sample is, as messages say it."""
        return f"{self.noun} {self.names[int(np.searchsorted(self.first, row, 'right')) - 1]!r}"

    def place(self, row: int) -> str:
        """Return where a sample is, as messages say it."""
        return f"({self.x_m[row]:.10g}, {self.y_m[row]:.10g}) at {self.time_s[row]:.10g} s"

    @property
    def looked_at(self) -> slice:
        """Some samples, evenly spread; all if there are few."""
        return slice(None, None, 1 + len(self.time_s) // LOOKED_AT)


def motion_of_samples(samples: Samples) -> Motion:
    """Return what is checked of SUMO's samples."""
    count = np.bincount(samples.vehicle, minlength=len(samples.names))
    return Motion(
        "vehicle",
        samples.names,
        first_rows(count),
        samples.time_s,
        samples.x_m,
        samples.y_m,
        samples.edge,
        samples.speed_mps,
    )


def motion_of_futures(futures: Futures, names: Sequence[str]) -> Motion:
    """Return what is checked of knots."""
    first = futures.first_knot
    edge = futures.edges.of_times(futures.time_s, first)
    return Motion("particle", names, first, futures.time_s, futures.x_m, futures.y_m, edge)


@np.errstate(over="ignore", invalid="ignore")  # absurd places are refused for what they are
def check_motion(path: Path, motion: Motion, network: RoadNetwork, search: SearchTime) -> None:
    """Refuse motion that cannot be, and say in the log what is odd.

    Raises
    ------
    InputError
        In one line, with who it is, the values seen and the remedy.
    """
    _refuse_nowhere(path, motion)
    roads = Nearness(network)
    _refuse_degrees(path, motion, roads)
    notes = _refuse_elsewhere(path, motion, roads)
    fastest_mps = _refuse_jumps(path, motion)
    _refuse_other_units(path, motion, fastest_mps)
    _refuse_other_edges(path, motion, network, roads)
    notes += _refuse_other_clock(path, motion, search)
    if motion.speed_mps is not None:
        notes += _gaps(motion)
    for note in notes:
        log.warning("%s: %s", path, note)


def _refuse_nowhere(path: Path, motion: Motion) -> None:
    if min(motion.x_m.min(), motion.y_m.min()) > NOWHERE + 1.0:
        return
    nowhere = (np.abs(motion.x_m - NOWHERE) < 1.0) | (np.abs(motion.y_m - NOWHERE) < 1.0)
    if nowhere.any():
        row = int(np.argmax(nowhere))
        raise InputError(
            f"{path}: {motion.name(row)} is at {motion.place(row)}, which is how SUMO says that it "
            f"knows no place; leave such samples out ({nowhere.sum()} in all)"
        )


def _ranges(motion: Motion) -> str:
    x, y = motion.x_m, motion.y_m
    return f"x {x.min():.8g} to {x.max():.8g}, y {y.min():.8g} to {y.max():.8g}"


def _refuse_degrees(path: Path, motion: Motion, roads: Nearness) -> None:
    """Refuse places that span as many degrees as the net does, but hardly a metre."""
    spans = [column.max() - column.min() for column in (motion.x_m, motion.y_m)]
    fits = np.abs(motion.x_m).max() <= 180 and np.abs(motion.y_m).max() <= 90
    if fits and 0 < max(spans) < 3 * roads.extent_m / DEGREE_M < max(roads.high_m - roads.low_m):
        _refuse_frame(
            path, motion, roads, "they look like degrees; record without --fcd-output.geo"
        )


def _refuse_frame(path: Path, motion: Motion, roads: Nearness, remedy: str) -> NoReturn:
    (left, low), (right, high) = roads.low_m, roads.high_m
    raise InputError(
        f"{path}: the places are not on this net: {_ranges(motion)}, but its roads lie at "
        f"x {left:.8g} to {right:.8g}, y {low:.8g} to {high:.8g} m; {remedy}"
    )


def _refuse_elsewhere(path: Path, motion: Motion, roads: Nearness) -> list[str]:
    """Refuse motion of which less than half is near a road; return a note if not all of it is."""
    some = motion.looked_at if roads.holds(motion.x_m, motion.y_m) else slice(None)
    near = roads.near(motion.x_m[some], motion.y_m[some])
    if near.all():
        return []
    if some != slice(None):
        near = roads.near(motion.x_m, motion.y_m)
    said = f"{near.sum()} of {len(near)} are within about {roads.near_m:,.0f} m of a road"
    if 2 * near.sum() < len(near):
        remedy = (
            "give the net that they were recorded on, and metres of its frame, as SUMO writes "
            "without --fcd-output.geo and --fcd-output.utm"
        )
        _refuse_frame(path, motion, roads, f"{said}; {remedy}")
    row = int(np.argmin(near))
    return [
        f"{said}; kept, but hardly to be found (the first: {motion.name(row)}, {motion.place(row)})"
    ]


def _hops(motion: Motion, rows: slice) -> tuple[Floats, Floats]:
    """Return metres and seconds from each of some samples to the next; no metres to another's."""
    x_m, y_m, time_s = (np.diff(column[rows]) for column in motion[4:6] + motion[3:4])
    first, last = np.searchsorted(motion.first, [rows.start + 1, rows.start + 1 + len(x_m)])
    between = motion.first[first:last] - 1 - rows.start
    x_m[between] = y_m[between] = 0.0
    time_s[between] = 1.0
    return np.sqrt(x_m * x_m + y_m * y_m), time_s


def _refuse_jumps(path: Path, motion: Motion) -> float:
    """Return the greatest speed between two samples in m/s, if a vehicle can have it."""
    fastest_mps, at = 0.0, 0
    for start in range(0, len(motion.time_s) - 1, AT_ONCE):
        moved_m, lasts_s = _hops(motion, slice(start, start + AT_ONCE + 1))
        speed_mps = moved_m / lasts_s
        most = int(np.argmax(speed_mps))
        if speed_mps[most] > fastest_mps:
            fastest_mps, at = float(speed_mps[most]), start + most
    if fastest_mps > FASTEST_MPS:
        moved_m, lasts_s = _hops(motion, slice(0, len(motion.time_s)))
        moves, jumps = moved_m > 0, moved_m > FASTEST_MPS * lasts_s
        at = int(np.argmax(jumps))
        remedy = "leave the sample out"
        if 2 * jumps.sum() > moves.sum() and moves.sum() > 1:
            remedy = "write times in seconds and places in metres"
        raise InputError(
            f"{path}: {motion.name(at)} moves {moved_m[at] / lasts_s[at]:,.0f} m/s between "
            f"{motion.time_s[at]:.10g} and {motion.time_s[at + 1]:.10g} s (more than "
            f"{FASTEST_MPS:,.0f} m/s), from {motion.place(at)} to {motion.place(at + 1)}; {remedy}"
        )
    return fastest_mps


def _refuse_other_units(path: Path, motion: Motion, fastest_mps: float) -> None:
    if 0.0 < fastest_mps < SLOWEST_MPS:
        spans_m = max(float(np.ptp(column)) for column in (motion.x_m, motion.y_m))
        if spans_m > MOVED_M:
            unit = _unit(fastest_mps)
            raise InputError(
                f"{path}: no {motion.noun} moves faster than {fastest_mps:.2g} m/s, from "
                f"{motion.time_s.min():.10g} to {motion.time_s.max():.10g} s; are the times "
                f"{unit}? write seconds"
            )
    if motion.speed_mps is not None:
        _refuse_other_speeds(path, motion, motion.speed_mps)


def _unit(fastest_mps: float) -> str:
    """Return the unit of time in which the fastest would be as fast as a car."""
    fitting = [unit for unit, factor in UNITS if 1.0 <= fastest_mps * factor < FASTEST_MPS]
    return fitting[0] if fitting else "those of another unit"


def _refuse_other_speeds(path: Path, motion: Motion, speed_mps: Floats) -> None:
    """Refuse places and times that say another speed than the file itself."""
    moved_m, lasts_s = _hops(motion, slice(0, len(motion.time_s)))
    said_mps = (speed_mps[1:] + speed_mps[:-1]) / 2
    moves = (moved_m > 0) & (said_mps > 1.0)
    if not moves.any():
        return
    seen_mps, said_mps = (moved_m / lasts_s)[moves], said_mps[moves]
    ratio = float(np.median(seen_mps / said_mps))
    if not 1 / AGREES <= ratio <= AGREES:
        row = int(np.argmax(moves))
        raise InputError(
            f"{path}: places and times say {np.median(seen_mps):.3g} m/s, but the recorded speeds "
            f"{np.median(said_mps):.3g} m/s ({motion.name(row)} goes from {motion.place(row)} to "
            f"{motion.place(row + 1)}); write times in seconds and places in metres of the net"
        )


def _refuse_other_edges(path: Path, motion: Motion, network: RoadNetwork, roads: Nearness) -> None:
    """Refuse samples that are not where their edge is: the first and last ones on each edge."""
    changes = motion.edge[1:] != motion.edge[:-1]
    changes[motion.first[1:-1] - 1] = True
    last = np.flatnonzero(changes)
    rows = np.concatenate(([0], last + 1, last, [len(motion.edge) - 1]))
    rows = rows[motion.edge[rows] != NO_EDGE]
    off_m = off_edges(network, motion.edge[rows], motion.x_m[rows], motion.y_m[rows])
    allowed_m = np.clip(OFF_EDGE * roads.extent_m, LEAST_OFF_M, MOST_OFF_M)
    if (off_m > allowed_m).any():
        worst = int(np.argmax(off_m))
        row = int(rows[worst])
        raise InputError(
            f"{path}: {motion.name(row)} is at {motion.place(row)}, {off_m[worst]:,.0f} m from its "
            f"edge {network.edge_ids[motion.edge[row]]!r}; give the net "
            "that the file was recorded on, or correct the edge"
        )


def _refuse_other_clock(path: Path, motion: Motion, search: SearchTime) -> list[str]:
    """Refuse motion that a search does not meet; return notes where it hardly does."""
    begin_s = search.begin_s or 0.0
    starts_s, ends_s = motion.time_s[motion.first[:-1]], motion.time_s[motion.first[1:] - 1]
    first_s, count = float(starts_s.min()), len(starts_s)
    everyone = f"all {count} {motion.noun}s" if count > 1 else f"the only {motion.noun}"
    if motion.speed_mps is not None and search.begin_s is not None and ends_s.max() < begin_s:
        raise InputError(
            f"{path}: {everyone} ended before --begin {clock(begin_s)}, the last at "
            f"{clock(float(ends_s.max()))}; choose an earlier time"
        )
    if search.horizon_s is None:
        return []
    remedy = f"--begin {clock(np.floor(first_s))}"
    late = starts_s > begin_s + search.horizon_s
    if late.all():
        raise InputError(
            f"{path}: {everyone} set out after the horizon of {search.horizon_s:g} s, the first at "
            f"{first_s:.10g} s; if the search's time 0 is then, say so with {remedy}"
        )
    notes = []
    if late.any():
        notes.append(
            f"{late.sum()} of {count} {motion.noun}s set out after the horizon of "
            f"{search.horizon_s:g} s, and count as not found"
        )
    if search.begin_s is None and first_s > LATE * search.horizon_s:
        notes.append(
            f"no {motion.noun} sets out before {clock(first_s)}; if the search's time 0 is "
            f"then, say so with {remedy}"
        )
    return notes


def _gaps(motion: Motion) -> list[str]:
    moved_m, lasts_s = _hops(motion, slice(0, len(motion.time_s)))
    hops = _own_hops(motion)
    if not hops.any():
        return []
    usual_s = float(np.median(lasts_s[hops][motion.looked_at]))
    gaps = np.flatnonzero(hops & (lasts_s > GAP * usual_s) & (moved_m > GAP_M))
    if len(gaps) == 0:
        return []
    row = int(gaps[0])
    return [
        f"{motion.name(row)} is not recorded between {motion.time_s[row]:.10g} and "
        f"{motion.time_s[row + 1]:.10g} s; taken to move straight and evenly ({len(gaps)} such "
        "gaps in all)"
    ]


def _own_hops(motion: Motion) -> Flags:
    """Return which samples are followed by one of the same vehicle, (S - 1,)."""
    own = np.ones(len(motion.time_s) - 1, dtype=bool)
    own[motion.first[1:-1] - 1] = False
    return own
