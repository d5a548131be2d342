"""Whether a flight is the one that its plan tells of, road by road, for verify.py."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from verify_files import Array
from verify_inputs import Net
from verify_uavs import NamedLeg

NEAR_M = 1.0  # of a node, where a real aircraft is at an end of a road


class LegOn(NamedTuple):
    """A leg that a flight contains: its number, when it is flown, the parts of the flight on it."""

    number: int
    times_s: list[float]  # when it starts and ends
    parts: range  # by their first point


def legs_on(time_s: Array, place: Array, routes: Sequence[Any], nodes: Array) -> list[LegOn] | None:
    """Return the legs that a flight contains, in order.

    None if the flight does not consist of whole hops.

    Parameters
    ----------
    time_s, place
        The points of the flight; places are complex numbers, as those of the legs' routes and of
        the nodes.
    """
    i, found, legs = 0, list[LegOn](), [route.place for route in routes]
    while i < len(place) - 1:
        flown = (n for n, leg in enumerate(legs) if np.array_equal(leg, place[i : i + len(leg)]))
        leg = next(flown, None)
        if leg is not None:
            parts = range(i, i + len(legs[leg]) - 1)
            found.append(LegOn(leg, [time_s[parts.start], time_s[parts.stop]], parts))
        elif place[i + 1] not in nodes:
            return None  # neither a leg nor a straight flight to a node
        i = i + 1 if leg is None else found[-1].parts.stop
    return found


def legs_named(
    named: Sequence[NamedLeg], time_s: Array, place: Array, net: Net
) -> list[LegOn] | None:
    """Return the legs that a real aircraft's flight contains at the times that its plan names.

    None if it is not at both ends of a road at the times of one.
    """
    nodes, found = net.node_xy_m @ [1, 1j], list[LegOn]()
    ends = np.array([(nodes[road[0]], nodes[road[1]]) for road in net.roads])
    for leg in named:
        times_s = list(leg.times_s[1:])
        at = np.interp(times_s, time_s, place.real) + 1j * np.interp(times_s, time_s, place.imag)
        near = np.flatnonzero(np.all(abs(ends - at) <= NEAR_M, axis=1))
        if not len(near):
            return None
        found.append(LegOn(int(near[0]), times_s, range(0)))
    return found


def are_flown(named: Sequence[NamedLeg], legs: list[LegOn], time_s: Array, net: Net) -> bool:
    """Tell whether a flight contains the roads that its plan names, in order and at their times.

    One name is one road or node, wherever it stands. The flight may contain other legs as well:
    a way from road to road may lead along one. The first departs at the first of the times.
    """
    ends_s, roads, nodes, left = time_s[0], dict[str, int](), dict[str, int](), iter(legs)
    for leg in named:
        departs_s, *times_s = leg.times_s
        on = next((on for on in left if on.times_s == times_s), None)
        if on is None or departs_s != ends_s:
            return False
        ends_s, ends = times_s[1], net.roads[on.number][:2]
        if roads.setdefault(leg.road, on.number // 2) != on.number // 2:
            return False
        if any(nodes.setdefault(*pair) != pair[1] for pair in zip(leg.ends, ends, strict=True)):
            return False
    return bool(named)
