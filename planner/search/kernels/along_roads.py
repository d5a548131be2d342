"""A problem laid out for what-if flights, compiled, and what a flight along a road meets."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Offsets
from planner.detection.kernels.closest_approach import Window, last_at_or_before
from planner.detection.kernels.worth import Goal
from planner.jit import compiled
from planner.search.kernels.contacts import Contacts, PiecesAhead, contacts_on
from planner.search.kernels.motion import Course, ParticleMotion, first_meeting, piece_from
from planner.search.kernels.passages import PassageColumns
from planner.search.kernels.windows import Sensing


class LegColumns(NamedTuple):
    """The polylines of all legs, as they are flown."""

    first_point: Offsets  # (L + 1,) where a leg's points start
    after_s: Floats  # (Q,) seconds from the leg's start to the point
    x_m: Floats  # (Q,) metres
    y_m: Floats  # (Q,) metres
    vx_mps: Floats  # (Q,) m/s, from the point on
    vy_mps: Floats  # (Q,) m/s


class SearchIndex(NamedTuple):
    """A problem, laid out so that what-if flights find what they pass."""

    motion: ParticleMotion
    passages: PassageColumns
    legs: LegColumns
    sensing: Sensing
    weight: Floats  # (N,) probability of each particle
    goal: Goal


class RoadFlight(NamedTuple):
    """A flight along a road."""

    leg: int
    start_s: float  # when it begins


@compiled
def first_meeting_along(
    road: RoadFlight, window: Window, ahead: PiecesAhead, index: SearchIndex
) -> float:
    """Return when a flight along a road first has a particle within the radius, inf: never.

    ``ahead`` is the particle's motion from the window's start on.
    """
    pieces, radius_m = index.motion.pieces, index.sensing.radius_m
    first_point, after_s, x_m, y_m, vx_mps, vy_mps = index.legs
    leg, start_s = road
    from_s, to_s = window
    _, k, last_piece = ahead
    last = first_point[leg + 1] - 1
    i = last_at_or_before(after_s, first_point[leg], last, from_s - start_s)
    while True:
        begin_s = start_s + after_s[i]
        leaves_s = min(to_s, start_s + after_s[i + 1]) if i + 1 < last else to_s
        course = Course(x_m[i], y_m[i], vx_mps[i], vy_mps[i], begin_s)
        seen_s = first_meeting(course, Window(from_s, leaves_s), pieces, k, radius_m)
        i += 1
        if seen_s < np.inf or i >= last:
            return seen_s
        from_s = start_s + after_s[i]
        if from_s > to_s:
            return np.inf
        k = piece_from(pieces, k, last_piece, from_s)


@compiled
def contacts_along(
    road: RoadFlight, window: Window, ahead: PiecesAhead, index: SearchIndex, found: Contacts
) -> Contacts:
    """Return the same contacts, and those of a flight along a road with a particle in a window.

    As `first_meeting_along`, for a sensor that may miss.
    """
    pieces, radius_m = index.motion.pieces, index.sensing.radius_m
    first_point, after_s, x_m, y_m, vx_mps, vy_mps = index.legs
    leg, start_s = road
    from_s, to_s = window
    who, k, last_piece = ahead
    last = first_point[leg + 1] - 1
    i = last_at_or_before(after_s, first_point[leg], last, from_s - start_s)
    while True:
        begin_s = start_s + after_s[i]
        leaves_s = min(to_s, start_s + after_s[i + 1]) if i + 1 < last else to_s
        course = Course(x_m[i], y_m[i], vx_mps[i], vy_mps[i], begin_s)
        here = PiecesAhead(who, k, last_piece)
        found = contacts_on(course, Window(from_s, leaves_s), pieces, here, radius_m, found)
        i += 1
        if i >= last:
            return found
        from_s = start_s + after_s[i]
        if from_s > to_s:
            return found
        k = piece_from(pieces, k, last_piece, from_s)
