"""What lies under a flight, as a page shows it: roads, names of streets, areas, and which part."""

from itertools import pairwise
from typing import Any

import numpy as np

from planner.arrays import Floats
from planner.flight.airspace import Airspace
from planner.flight.pieces import along
from planner.futures.knots import Knots
from planner.messages import plain
from planner.network.road_network import RoadNetwork
from planner.network.street_names import street_names
from planner.page.earth import Box
from planner.page.frame import Frame, packed

LABELS = 300  # names of streets, at most
EDGE = 0.1  # of the knots, left out on each side of what is shown first
ROOM = 0.04  # of its size, left around it


def roads_once(network: RoadNetwork, frame: Frame) -> list[Floats]:
    """Return the polylines of all roads, (k, 2) metres; opposite ones are drawn once."""
    steps = frame.places(network.shape_xy_m)
    found: dict[bytes, Floats] = {}
    first = network.first_point.tolist()
    for start, end in pairwise(first):
        line = steps[start:end]
        key = min(line.tobytes(), line[::-1].tobytes())
        found.setdefault(key, network.shape_xy_m[start:end])
    return list(found.values())


def under_content(
    network: RoadNetwork, airspace: Airspace | None, roads: list[Floats], frame: Frame, view: Box
) -> dict[str, Any]:
    """Return all of it as the page's script takes it, and which part is shown first."""
    return {
        "frame": frame.as_dict(),
        "view": [round(metres, 2) for metres in view],
        "roads": roads_content(roads, frame),
        "labels": labels(network),
        "areas": areas_content(airspace),
    }


def roads_content(roads: list[Floats], frame: Frame) -> dict[str, str]:
    """Return roads as the page's script takes them."""
    counts = np.array([len(line) for line in roads])
    steps = frame.places(np.concatenate(roads))
    return {"points": packed(counts), "xy": packed(steps.ravel())}


def labels(network: RoadNetwork) -> list[list[Any]]:
    """Return names of streets, the longest first: name, x and y in metres, angle in degrees.

    Each stands in the middle of the longest of its roads, and its angle, upward from the east,
    is from -90 to 90.
    """
    total_m: dict[str, float] = {}
    longest: dict[str, int] = {}
    length_m = network.road_length_m
    for road, name in enumerate(street_names(network).road):
        if name:
            total_m[name] = total_m.get(name, 0.0) + float(length_m[road])
            if length_m[road] > length_m[longest.setdefault(name, road)]:
                longest[name] = road
    order = sorted(total_m, key=lambda name: (-total_m[name], name))[:LABELS]
    return [[plain(name), *_middle(network.shape(longest[name]))] for name in order]


def _middle(line_m: Floats) -> list[float]:
    (x_m, y_m), (dx, dy) = along(line_m, 0.5)
    angle_deg = float(np.degrees(np.arctan2(dy, dx)))
    upright_deg = (angle_deg + 90.0) % 180.0 - 90.0
    return [round(float(x_m), 1), round(float(y_m), 1), round(upright_deg)]


def areas_content(airspace: Airspace | None) -> dict[str, list[list[list[float]]]]:
    """Return the outlines of areas, each a list of [x, y] in metres, by what they are."""
    found: dict[str, list[list[list[float]]]] = {}
    for key, rings in () if airspace is None else airspace.outlines():
        found.setdefault(key, []).extend(np.round(ring, 1).tolist() for ring in rings)
    return found


def view_of(network: RoadNetwork, flown_m: list[Floats], knots: Knots) -> Box:
    """Return what a page shows first: the flights, and most of the targets' ways, on the net."""
    low_m, high_m = network.shape_xy_m.min(axis=0), network.shape_xy_m.max(axis=0)
    if network.is_abstract:
        places_m = np.stack([low_m, high_m])
    else:
        most = np.quantile(knots.xy_m, [EDGE, 1 - EDGE], axis=0) if len(knots.xy_m) else low_m[None]
        places_m = np.clip(np.concatenate([*flown_m, most]), low_m, high_m)
    return with_room(places_m.min(axis=0), places_m.max(axis=0))


def with_room(low_m: Floats, high_m: Floats) -> Box:
    """Return a box between two corners, (2,) metres, with some room around it."""
    room_m = ROOM * max(float((high_m - low_m).max()), 1.0)
    west_m, south_m = (low_m - room_m).tolist()
    east_m, north_m = (high_m + room_m).tolist()
    return Box(west_m, south_m, east_m, north_m)
