"""How far lanes, and ways through junctions, lie off the roads that stand for them."""

import numpy as np

from planner.arrays import Floats, Ints
from planner.network.lines import Lines

STEP_M = 5.0  # longest part of a lane that is held to a road in one go
CANDIDATES = 12  # places on roads, the nearest ones to a line, whose roads may be its own


def off_roads(roads: Lines, ways: Lines, road: Ints) -> Floats:
    """Return how far off each road the ways lie at most that count to it, (R,) metres.

    Parameters
    ----------
    road
        (W,) the road to which each way counts.
    """
    parts, most_m = ways.parts(STEP_M), np.zeros(len(roads))
    own = road[parts.line]
    np.maximum.at(most_m, own, roads.off(own, parts.start_m, parts.end_m))
    return most_m


def nearest_road(roads: Lines, lines: Lines) -> Ints:
    """Return for each line the road that it keeps nearest to, (L,), the first among equals."""
    from scipy.spatial import KDTree

    places, parts = roads.parts(STEP_M), lines.parts(STEP_M)
    tree = KDTree((places.start_m + places.end_m) / 2)
    middle_m = lines.at(np.arange(len(lines)), lines.length_m / 2)
    near = np.atleast_2d(tree.query(middle_m, min(CANDIDATES, len(places.line)))[1])
    found = np.empty(len(lines), dtype=np.int32)
    first = np.searchsorted(parts.line, np.arange(len(lines) + 1))
    for line in range(len(lines)):
        own = slice(first[line], first[line + 1])
        start_m, end_m = parts.start_m[own], parts.end_m[own]
        candidates = np.unique(places.line[near[line]])
        off_m = [roads.off(np.full(len(start_m), k), start_m, end_m).max() for k in candidates]
        found[line] = candidates[int(np.argmin(off_m))]
    return found
