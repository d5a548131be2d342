"""A way on the Earth: its waypoints, and where the aircraft is at every moment, in degrees."""

from dataclasses import replace

import numpy as np

from planner.arrays import Floats
from planner.export.flight_file import Fix, Waypoint
from planner.export.way import Way
from planner.flight.law import FlightLaw
from planner.flight.track import Track
from planner.network.georeference import lonlat
from planner.network.road_network import RoadNetwork

DEGREES = 7  # digits that files have of a place
STEP_S = 1.0  # between moments of a track in files, as receivers tell


def waypoints_of(way: Way, arrives_s: Floats, network: RoadNetwork) -> list[Waypoint]:
    """Return the waypoints of a way, at which an aircraft arrives at these seconds, (W,)."""
    degrees = np.round(lonlat(network, way.xy_m), DEGREES).tolist()
    rows = zip(
        degrees,
        way.xy_m.tolist(),
        arrives_s.tolist(),
        way.hold_s.tolist(),
        ("", *way.streets),
        strict=True,
    )
    return [
        Waypoint(lat, lon, x_m, y_m, time_s, hold_s, street)
        for (lon, lat), (x_m, y_m), time_s, hold_s, street in rows
    ]


def fixes_of(track: Track, law: FlightLaw, network: RoadNetwork, *, lands: bool) -> tuple[Fix, ...]:
    """Return where an aircraft is at the times of its track and in between, and how high.

    They are so close that nobody who reads them back takes two of them for the ends of a break.
    """
    begin_s, end_s = float(track.time_s[0]), track.end_s
    time_s = np.unique([*track.time_s, *np.arange(begin_s, end_s, STEP_S)])
    degrees = np.round(lonlat(network, track.xy(time_s)), DEGREES)
    known = [(begin_s, 0.0 if law.climb_s > 0.0 else law.altitude_m)]
    known.append((begin_s + law.climb_s, law.altitude_m))
    if lands and law.descend_s > 0.0:
        known += [(end_s - law.descend_s, law.altitude_m), (end_s, 0.0)]
    height_m = np.interp(time_s, *np.array(known).T)
    rows = zip(time_s.tolist(), degrees.tolist(), height_m.tolist(), strict=True)
    return tuple(Fix(time_s, lat, lon, metres) for time_s, (lon, lat), metres in rows)


def ends_without_holds(waypoints: list[Waypoint], comes_home: bool) -> list[Waypoint]:
    """Return waypoints of which the first, and the one where it lands, are no places to hover.

    Autopilots have commands of their own for these.
    """
    first, last = waypoints[0], waypoints[-1]
    found = list(waypoints)
    if first.hold_s > 0.0 or len(waypoints) == 1:
        found.insert(0, replace(first, hold_s=0.0))
    if comes_home and last.hold_s > 0.0:
        found.append(replace(last, arrives_s=last.arrives_s + last.hold_s, hold_s=0.0, street=""))
    return found
