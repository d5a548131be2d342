"""The legs of a flight as rows of a table: where, from when to when, how far."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from planner.arrays import Floats
from planner.flight.legs import leg_ends
from planner.flight.plan import FlownLeg
from planner.flight.simplified import told_knots
from planner.flight.track import Track
from planner.network.beside import nearest_road
from planner.network.lines import Lines
from planner.network.road_network import RoadNetwork
from planner.network.street_names import has_street_names, road_phrase, street_at, street_names

HOVERS, CLIMBS, COMES_DOWN = "hover", "climb", "come down"
HOME = "to the landing place"
UNNAMED, ACROSS = "unnamed road", "across country"
MOMENT_S = 0.5  # what is shorter is no leg


@dataclass(frozen=True, eq=False)
class Row:
    """One leg of a flight, as a person reads it."""

    name: str
    start_s: float
    end_s: float
    start_m: Floats  # (2,) metres
    length_m: float
    bearing_deg: float | None = None  # in the net's frame; None: it bends, or does not move


def rows_of(
    track: Track,
    legs: Sequence[FlownLeg],
    network: RoadNetwork,
    *,
    home_m: tuple[float, float] | None,
    radius_m: float,
) -> list[Row]:
    """Return the legs of a flight: its roads, or what it flies from waypoint to waypoint.

    Parameters
    ----------
    home_m
        Where it has to land; None: anywhere.
    radius_m
        A straight way that keeps within this of a road is flown along it.
    """
    if legs:
        return [_road_row(leg, track, network) for leg in legs]
    return list(_joined(_straight_rows(track, network, home_m, radius_m)))


def _road_row(leg: FlownLeg, track: Track, network: RoadNetwork) -> Row:
    name = road_phrase(network, leg.leg)
    if not has_street_names(network):
        name = "{}, from {} to {}".format(network.road_ids[leg.road], *leg_ends(network, leg.leg))
    start_m, end_m = track.xy(np.array([leg.start_s, leg.end_s]))
    length_m = float(network.road_length_m[leg.road])
    is_straight = np.hypot(*(end_m - start_m)) > 0.999 * length_m
    bearing_deg = _bearing_deg(end_m - start_m) if is_straight else None
    return Row(name, leg.start_s, leg.end_s, start_m, length_m, bearing_deg)


def _straight_rows(
    track: Track, network: RoadNetwork, home_m: tuple[float, float] | None, radius_m: float
) -> Iterator[Row]:
    """Yield a row for each waypoint that matters, and for each time of hovering."""
    kept = told_knots(track, radius_m)
    times_s = track.time_s[kept].tolist()
    places = np.stack([track.x_m, track.y_m], axis=1)[kept]
    moves = np.any(np.diff(places, axis=0) != 0.0, axis=1)
    names = _ways(places[:-1][moves], places[1:][moves], network, radius_m)
    for k, (start_s, end_s) in enumerate(pairwise(times_s)):
        step_m = places[k + 1] - places[k]
        if not moves[k]:
            if end_s - start_s >= MOMENT_S:
                yield Row(_stays(track, start_s, end_s), start_s, end_s, places[k], 0.0)
            continue
        name, is_last = next(names), k == len(moves) - 1
        if is_last and home_m is not None and np.allclose(places[k + 1], home_m):
            name = HOME
        yield Row(name, start_s, end_s, places[k], float(np.hypot(*step_m)), _bearing_deg(step_m))


def _stays(track: Track, start_s: float, end_s: float) -> str:
    """Return what it does in one place: it climbs before it sees, and comes down after."""
    on_s = track.sensor_on
    if len(on_s) and start_s == track.time_s[0] and end_s <= on_s[0, 0]:
        return CLIMBS
    if len(on_s) and end_s == track.time_s[-1] and start_s >= on_s[-1, 1]:
        return COMES_DOWN
    return HOVERS


def _ways(from_m: Floats, to_m: Floats, network: RoadNetwork, radius_m: float) -> Iterator[str]:
    """Yield along which street each of the straight ways goes, or to which one across country."""
    if not len(from_m):
        return
    ways = Lines(np.arange(len(from_m) + 1) * 2, np.stack([from_m, to_m], axis=1).reshape(-1, 2))
    called = network.road_ids if network.is_abstract else street_names(network).road
    along = nearest_road(network.road_lines, ways)
    near = network.road_lines.off(along, from_m, to_m) <= radius_m
    for way, end_m, is_near in zip(along, to_m, near, strict=True):
        if is_near:
            yield called[way] or UNNAMED
        else:
            there = street_at(network, end_m)
            name = network.edge_ids[there.edge] if network.is_abstract else there.name
            yield f"across to {name}" if name else ACROSS


def _joined(rows: Iterator[Row]) -> Iterator[Row]:
    """Yield rows, those one after the other along the same street as one."""
    last: Row | None = None
    for row in rows:
        if last is not None and row.name == last.name not in (HOVERS, ACROSS):
            together_m = last.length_m + row.length_m
            last = replace(last, end_s=row.end_s, length_m=together_m, bearing_deg=None)
            continue
        if last is not None:
            yield last
        last = row
    if last is not None:
        yield last


def _bearing_deg(step_m: Floats) -> float:
    return float(np.degrees(np.arctan2(step_m[0], step_m[1]))) % 360.0
