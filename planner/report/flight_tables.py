"""What is flown, as tables for a terminal: roads or waypoints in the order flown."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.clock import clock
from planner.flight.legs import leg_ends
from planner.flight.plan import FlownLeg, Plan
from planner.flight.simplified import told_knots
from planner.flight.track import Track
from planner.network.georeference import coordinates, is_georeferenced
from planner.network.road_network import RoadNetwork
from planner.network.street_names import has_street_names, road_phrase, street_at
from planner.report.formats import Column, FittingTable

BESIDE_M = 30.0  # from a street is still in it
MOST_ROWS = 40  # of roads or waypoints in a table; plan.json holds all


def legs_table(plan: Plan, network: RoadNetwork, until_s: float = math.inf) -> FittingTable:
    """Return the roads of a plan in the order flown, with times on the target's clock.

    Where the net has names of streets, roads are called by them.

    Parameters
    ----------
    until_s
        The horizon: no road that begins after it is shown, nor are more than ``MOST_ROWS``.
    """
    named = has_street_names(network)
    ends = (Column("from", rank=3, left=True), Column("to", rank=3, left=True))
    ids = (Column("street", left=True, wraps=True), Column("road", rank=3, left=True))
    times_s = (Column("start", rank=1), Column("end", rank=2))
    called = ids if named else (Column("road", left=True), *ends)
    columns = (Column("#"), *called, *times_s)

    def cells(leg: FlownLeg) -> list[str]:
        times = (clock(leg.start_s), clock(leg.end_s))
        road = network.road_ids[leg.road]
        if named:
            return [road_phrase(network, leg.leg), road, *times]
        return [road, *leg_ends(network, leg.leg), *times]

    flown = [[cells(leg) for leg in legs if leg.start_s < until_s] for legs in plan.legs]
    return _flown_table("roads in the order flown", columns, plan, flown)


def waypoints_table(
    plan: Plan, network: RoadNetwork, until_s: float = math.inf, *, radius_m: float | None = None
) -> FittingTable:
    """Return where a flight off the roads goes, with times on the target's clock.

    In a town a place is its street, and where it lies on the Earth if the net says so.

    Parameters
    ----------
    until_s
        As ``legs_table`` takes it.
    radius_m
        How far the sensor sees: bends that do not matter to it are left out. None: all are told.
    """
    place = ("place",) if is_georeferenced(network) else ("x (m)", "y (m)")
    named = has_street_names(network)
    street = [Column("street", left=True, wraps=True)] * named
    times = (Column("arrives"), Column("leaves", rank=1))
    columns = (Column("#"), *street, *map(Column, place), *times)

    def cells(stay: _Stay) -> list[str]:
        xy_m = np.array([stay.x_m, stay.y_m])
        found = [_street(network, xy_m)] * named
        if is_georeferenced(network):
            found.append(coordinates(network, xy_m))
        else:
            found += [f"{stay.x_m:,.0f}", f"{stay.y_m:,.0f}"]
        return [*found, clock(stay.from_s), clock(min(stay.to_s, until_s))]

    flown = [
        [cells(stay) for stay in _stays(track, radius_m) if stay.from_s < until_s]
        for track in plan.tracks
    ]
    return _flown_table("waypoints in the order flown", columns, plan, flown)


def _flown_table(
    title: str, columns: Sequence[Column], plan: Plan, flown: Sequence[Sequence[Sequence[str]]]
) -> FittingTable:
    """Return a table of what is flown, for each flight the cells after its number.

    Where there are several flights, each begins with its name.
    """
    several = len(flown) > 1
    most = MOST_ROWS if not several else max(1, MOST_ROWS // len(flown))
    caption = "plan.json, which -o DIR writes, holds all of them; page.html tells them as legs"
    table = FittingTable(
        title,
        ([Column("UAV", left=True)] if several else []) + [*columns],
        caption=caption if max(map(len, flown), default=0) > most else "",
    )
    for name, rows in zip(plan.names, flown, strict=True):
        told = [[name.removeprefix("UAV ")]] + [[""]] * len(rows) if several else [[]] * len(rows)
        for order, (head, cells) in enumerate(zip(told, rows[:most], strict=False), 1):
            table.add_row(*head, str(order), *cells)
        if len(rows) > most:
            blank = [""] * (len(columns) - 2)
            table.add_row(*[""] * several, "", f"{len(rows) - most:,} more", *blank)
        if several:
            table.end_section()
    return table


def _street(network: RoadNetwork, xy_m: Floats) -> str:
    """Return in or near which street a place is; "" where that has no name."""
    name, _, away_m = street_at(network, xy_m)
    return f"near {name}" if name and away_m > BESIDE_M else name


class _Stay(NamedTuple):
    """A place of a flight, and from when to when it is there."""

    x_m: float
    y_m: float
    from_s: float
    to_s: float


def _stays(track: Track, radius_m: float | None) -> list[_Stay]:
    """Return the places of a flight in the order flown."""
    found: list[_Stay] = []
    told = slice(None) if radius_m is None else told_knots(track, radius_m)
    columns = (track.time_s[told], track.x_m[told], track.y_m[told])
    for time_s, x_m, y_m in zip(*columns, strict=True):
        begun_s = time_s
        if found and found[-1][:2] == (x_m, y_m):
            begun_s = found.pop().from_s
        found.append(_Stay(float(x_m), float(y_m), float(begun_s), float(time_s)))
    return found
