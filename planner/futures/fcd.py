"""SUMO's floating car data (FCD) as samples of vehicles on the edges of a network."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.arrays import Flags, Floats, Frozen, Ints, Offsets, freeze
from planner.errors import InputError
from planner.futures.edges import NOT_FOR_CARS, edges_of
from planner.futures.edges_driven import NO_EDGE
from planner.futures.fcd_formats import REMEDY, Rows, read_rows
from planner.network.road_network import RoadNetwork

log = logging.getLogger(__name__)

SAME_S = 1e-9  # samples closer in time than this are at one time
SAME_M = 0.01  # places in files have two decimals
ROADS = "record cars, or give a net on which they may drive"


@dataclass(frozen=True, eq=False)
class Samples(Frozen):
    """Vehicles at sampled times, sorted by vehicle, then time."""

    names: tuple[str, ...]  # of the vehicles, in the order of their numbers
    vehicle: Ints  # (S,) number of the vehicle
    time_s: Floats  # (S,) seconds
    x_m: Floats  # (S,) metres
    y_m: Floats  # (S,) metres
    speed_mps: Floats  # (S,) in the step that ends at the sample; NaN where not recorded
    edge: Ints  # (S,) edge index; a junction's inside counts to the edge after it
    along_m: Floats  # (S,) metres driven on the edge; NaN where not recorded

    def __post_init__(self) -> None:
        freeze(
            self,
            vehicle=np.int32,
            time_s=np.float64,
            x_m=np.float64,
            y_m=np.float64,
            speed_mps=np.float64,
            edge=np.int32,
            along_m=np.float64,
        )


def read_samples(path: Path, network: RoadNetwork) -> Samples:
    """Return the samples of an FCD file, as XML, CSV (also gzipped) or Parquet.

    Where a vehicle drives on an edge that is not for cars, its edge is unknown; one that is never
    on another edge is left out. Both are said in the log.

    Raises
    ------
    InputError
        If the file is missing, is no FCD, or names edges that are not in the network.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; {REMEDY}")
    return samples_of_rows(path, read_rows(path), network)


def samples_of_rows(path: Path, rows: Rows, network: RoadNetwork) -> Samples:
    """Return the samples that rows of a file hold, as `read_samples` does."""
    _refuse_missing(path, rows)
    edge, inside = _edge_of_rows(path, rows, network)
    names, vehicle = _by_appearance(*rows.vehicle)
    kept = _on_roads(path, vehicle, names, edge)
    if not kept.all():
        rows = rows.take(kept)
        edge, inside = edge[kept], inside[kept]
        names, vehicle = _by_appearance(*rows.vehicle)
    order = np.lexsort((rows.time_s, vehicle))
    order = order[_once(path, rows, names, vehicle, order)]
    if not rows.on_lanes:
        order = order[_entering(rows, vehicle, edge, order)]
    vehicle, edge, inside = vehicle[order], edge[order], inside[order]
    edge, along_m = _out_of_junctions(edge, rows.along_m[order], vehicle, network, inside)
    return Samples(
        names=names,
        vehicle=vehicle,
        time_s=rows.time_s[order],
        x_m=rows.x_m[order],
        y_m=rows.y_m[order],
        speed_mps=rows.speed_mps[order],
        edge=edge,
        along_m=along_m,
    )


def _refuse_missing(path: Path, rows: Rows) -> None:
    if len(rows.time_s) == 0:
        raise InputError(f"{path}: holds no vehicle; {REMEDY}")
    for word, column in (("time", rows.time_s), ("x", rows.x_m), ("y", rows.y_m)):
        known = np.isfinite(column)
        if not known.all():
            row = int(np.argmin(known))
            raise InputError(
                f"{path}: vehicle {rows.vehicle.values[rows.vehicle.code[row]]!r} has no finite "
                f"{word} (null or NaN) at {rows.time_s[row]:g} s; leave that sample out"
            )


def _once(
    path: Path, rows: Rows, names: Sequence[str], vehicle: Ints, order: Offsets
) -> Flags | slice:
    """Return which of the sorted rows are the first of their vehicle at their time.

    Raises
    ------
    InputError
        If a vehicle is at two places at one time.
    """
    again = np.diff(rows.time_s[order]) < SAME_S
    again &= np.diff(vehicle[order]) == 0
    if not again.any():
        return slice(None)
    first, second = order[:-1][again], order[1:][again]
    apart_m = np.hypot(*(column[first] - column[second] for column in (rows.x_m, rows.y_m)))
    if (apart_m > SAME_M).any():
        one, other = (side[int(np.argmax(apart_m))] for side in (first, second))
        raise InputError(
            f"{path}: vehicle {names[vehicle[one]]!r} is at two places at {rows.time_s[one]:g} s, "
            f"({rows.x_m[one]:g}, {rows.y_m[one]:g}) and ({rows.x_m[other]:g}, "
            f"{rows.y_m[other]:g}) m; leave one of them out, or name two vehicles"
        )
    log.warning("%s: %d samples stand in it twice; read once", path, len(first))
    return np.append(True, ~again)


def _entering(rows: Rows, vehicle: Ints, edge: Ints, order: Offsets) -> Flags:
    """Return which of the sorted rows are the first of their vehicle on a piece of an edge.

    Without lanes SUMO moves vehicles from piece to piece, and says where the piece begins as long
    as they drive on it. Between the first rows they drive evenly.
    """
    stays = (rows.speed_mps[order] > 0.0)[1:]
    for column in (vehicle, edge, rows.x_m, rows.y_m):
        stays &= np.diff(column[order]) == 0
    return np.append(True, ~stays | (edge[order][1:] == NO_EDGE))


def _edge_of_rows(path: Path, rows: Rows, network: RoadNetwork) -> tuple[Ints, Flags]:
    """Return each row's edge, and whether it is the inside of a junction, (S,)."""
    index = np.append(edges_of(path, rows.edge, network), np.int32(NO_EDGE))
    inside = np.array([name.startswith(":") for name in rows.edge.values] + [False])
    return index[rows.edge.code], inside[rows.edge.code]


def _on_roads(path: Path, vehicle: Ints, names: Sequence[str], edge: Ints) -> Flags:
    """Return which rows are of vehicles that are not on edges for others all the time, (S,).

    Such edges become unknown.
    """
    off = edge == NOT_FOR_CARS
    if not off.any():
        return np.ones(len(edge), dtype=bool)
    count = len(names)
    rows = np.bincount(vehicle, minlength=count)
    rows_off = np.bincount(vehicle[off], minlength=count)
    out = (rows_off > 0) & (rows_off == rows)
    if out.all():
        raise InputError(f"{path}: all vehicles drive on edges that are not for cars; {ROADS}")
    tell_of(
        f"{path}: left out: vehicles that drive on edges only that are not for cars", out, names
    )
    partly = (rows_off > 0) & ~out
    unknown = "taken as unknown: edges that are not for cars, of vehicles that drive on others too"
    tell_of(f"{path}: {unknown}", partly, names)
    edge[off] = NO_EDGE
    return np.asarray(~out[vehicle])


def _by_appearance(names: Sequence[str], code: Ints) -> tuple[tuple[str, ...], Ints]:
    """Return the names that there are, in the order of their first rows, and each row's number."""
    first = np.full(len(names), len(code))
    first[code[::-1]] = np.arange(len(code))[::-1]
    order = np.argsort(first, kind="stable")[: np.count_nonzero(first < len(code))]
    number = np.empty(len(names), dtype=np.int32)
    number[order] = np.arange(len(order))
    return tuple(names[k] for k in order.tolist()), number[code]


def _out_of_junctions(
    edge: Ints, along_m: Floats, vehicle: Ints, network: RoadNetwork, inside: Flags
) -> tuple[Ints, Floats]:
    """Put samples inside a junction at the start of the edge that their vehicle enters next.

    A vehicle last seen inside a junction stays at the end of the edge that it has left.
    """
    rows = np.arange(len(edge))
    after = np.minimum.accumulate(np.where(inside, len(edge), rows)[::-1])[::-1]
    before = np.maximum.accumulate(np.where(inside, -1, rows))
    entered = after < len(edge)
    entered[entered] = vehicle[after[entered]] == vehicle[entered]
    left = ~entered & (before >= 0)
    left[left] = vehicle[before[left]] == vehicle[left]
    place = np.where(entered, after, np.where(left, before, rows))
    on = edge[place]
    end_m = np.where(on == NO_EDGE, np.nan, network.edge_length_m[on])
    return on, np.where(inside, np.where(left, end_m, 0.0), along_m)


def tell_of(what: str, which: Flags, names: Sequence[str]) -> None:
    """Say of which vehicles something is true, (N,), how many they are; nothing if of none."""
    if which.any():
        first = names[int(np.argmax(which))]
        log.warning("%s (%d of %d, the first %r)", what, which.sum(), len(which), first)
