"""The line that a stored plan flies: its corners, where it hovers, and along which streets."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from planner.arrays import Floats, Frozen, freeze
from planner.flight.plan import FlownLeg
from planner.flight.simplified import Clear, kept_knots
from planner.flight.track import Track
from planner.network.road_network import RoadNetwork
from planner.network.street_names import street_names

STRAIGHT_M = 1e-5  # that a place may lie beside the way past it and be no corner
MOMENT_S = 1e-3  # what is shorter is rounding, and no hovering


@dataclass(frozen=True, eq=False)
class Line(Frozen):
    """Places that an aircraft flies to one after the other; no two neighbours are one place."""

    time_s: Floats  # (W,) seconds on the target's clock, when it was planned to arrive
    xy_m: Floats  # (W, 2) metres
    hold_s: Floats  # (W,) seconds that it hovers there
    streets: tuple[str, ...]  # W - 1, along which it flies; empty: across country

    def __post_init__(self) -> None:
        freeze(self, time_s=np.float64, xy_m=np.float64, hold_s=np.float64)


def line_of(
    track: Track, legs: tuple[FlownLeg, ...], network: RoadNetwork, *, up_s: float, down_s: float
) -> Line:
    """Return the line of a track.

    Parameters
    ----------
    legs
        The roads flown, at the times of the track.
    up_s, down_s
        For how long it climbs before it sets out, and descends at its end.
    """
    places = np.stack([track.x_m, track.y_m], axis=1)
    moves = np.append(True, np.any(np.diff(places, axis=0) != 0.0, axis=1))
    first = np.flatnonzero(moves)
    arrives_s = track.time_s[first]
    leaves_s = track.time_s[np.append(first[1:], len(places)) - 1].copy()
    arrives_s[0] += up_s
    leaves_s[-1] -= down_s
    hold_s = np.where(leaves_s - arrives_s > MOMENT_S, leaves_s - arrives_s, 0.0)
    corners = _corners(places[first], hold_s)
    time_s = arrives_s[corners]
    streets = tuple(
        _street(float(a), float(b), legs, network)
        for a, b in zip((time_s + hold_s[corners])[:-1], time_s[1:], strict=True)
    )
    return Line(time_s, places[first][corners], hold_s[corners], streets)


def simplified(line: Line, tolerance_m: float, clear: Clear | None = None) -> Line:
    """Return a line with fewer corners, at no time farther off than a tolerance; holds stay.

    Parameters
    ----------
    clear
        Whether one may fly straight between two places; None: anywhere.
    """
    time_s = np.stack([line.time_s, line.time_s + line.hold_s], axis=1).ravel()
    xy_m = np.repeat(line.xy_m, 2, axis=0)
    held = np.flatnonzero(line.hold_s > 0.0)
    both = np.stack([2 * held, 2 * held + 1], axis=1).ravel().tolist()
    knots = kept_knots(time_s, xy_m, tolerance_m, holds=both, clear=clear)
    kept, hold_s = _apart(line, np.unique(knots // 2).tolist())
    streets = tuple(_longest(line, a, b) for a, b in pairwise(kept))
    return Line(line.time_s[kept], line.xy_m[kept], np.array(hold_s), streets)


def _apart(line: Line, kept: list[int]) -> tuple[list[int], list[float]]:
    """Return places no two of which follow at one place, and for how long it hovers at each.

    Where only a short way out and back has been left out in between, it hovers meanwhile.
    """
    found, hold_s = [kept[0]], [float(line.hold_s[kept[0]])]
    for k in kept[1:]:
        if np.array_equal(line.xy_m[k], line.xy_m[found[-1]]):
            hold_s[-1] = float(line.time_s[k] + line.hold_s[k] - line.time_s[found[-1]])
        else:
            found.append(k)
            hold_s.append(float(line.hold_s[k]))
    return found, hold_s


def _corners(places: Floats, hold_s: Floats) -> list[int]:
    """Return the indices of places at which it turns or hovers, with both ends."""
    kept = [0]
    for k in range(1, len(places) - 1):
        before, after = places[k] - places[kept[-1]], places[k + 1] - places[k]
        whole = before + after
        aside_m = abs(before[0] * whole[1] - before[1] * whole[0])
        on_way = before @ after > 0.0 and aside_m <= STRAIGHT_M * np.hypot(*whole)
        if hold_s[k] > 0.0 or not on_way:
            kept.append(k)
    return [*kept, len(places) - 1] if len(places) > 1 else kept


def _street(from_s: float, to_s: float, legs: tuple[FlownLeg, ...], network: RoadNetwork) -> str:
    """Return the street that is flown for most of a time; empty if it is none."""
    best, longest_s = -1, (to_s - from_s) / 2.0
    for leg in legs:
        together_s = min(leg.end_s, to_s) - max(leg.start_s, from_s)
        if together_s > longest_s:
            best, longest_s = leg.road, together_s
    if best < 0:
        return ""
    return street_names(network).road[best] or network.road_ids[best]


def _longest(line: Line, a: int, b: int) -> str:
    """Return the street along which most of a line goes between two of its places."""
    length_m: dict[str, float] = {}
    for k in range(a, b):
        metres = float(np.hypot(*(line.xy_m[k + 1] - line.xy_m[k])))
        length_m[line.streets[k]] = length_m.get(line.streets[k], 0.0) + metres
    return max(length_m, key=lambda name: length_m[name])
