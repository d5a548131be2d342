"""The search patterns that a pilot flies without a planner, as points.

Names and turns are those of the IAMSAR Manual, volume II (IMO and ICAO, International Aeronautical
and Maritime Search and Rescue Manual): expanding square (SS), sector search (VS), parallel track
(PS). Courses are in degrees clockwise from north, and turns go to the right (starboard).
"""

from collections.abc import Callable

import numpy as np

from planner.arrays import Floats

Point = tuple[float, float]  # x and y, metres

SPIRAL_STEP_DEG = 15.0  # chords of this angle stay within 1 % of a turn's radius
SECOND_SQUARE_DEG = 45.0  # by which each further expanding square is turned
SECOND_SECTORS_DEG = 30.0  # by which each further sector search is turned
MOST_POINTS = 4000  # of a flight: a pattern of metres ends here, not at a horizon of days


def spiral(centre: Point, spacing_m: float, extent_m: float, course_deg: float) -> Floats:
    """Return a spiral outwards to the right, (W, 2) metres: r = spacing * turns.

    Parameters
    ----------
    extent_m
        Radius at which it ends, after a whole step.
    course_deg
        Bearing in which it leaves the centre.
    """
    steps = int(np.ceil(extent_m / spacing_m * 360.0 / SPIRAL_STEP_DEG - 1e-9))
    angle_deg = SPIRAL_STEP_DEG * np.arange(steps + 1.0)
    radius_m = spacing_m * angle_deg / 360.0
    return np.asarray(centre + radius_m[:, None] * _heading(course_deg + angle_deg))


def expanding_square(centre: Point, spacing_m: float, extent_m: float, course_deg: float) -> Floats:
    """Return an expanding square search (SS), (W, 2) metres.

    From the centre, legs of 1, 1, 2, 2, 3, 3, ... spacings, with a right turn of 90 degrees after
    each, until the square is as large as the extent, half of a side.
    """
    legs = 2 * max(1, int(np.ceil(2.0 * extent_m / spacing_m - 1e-9))) + 1
    number = np.arange(float(legs))
    length_m = spacing_m * (number // 2.0 + 1.0)
    length_m[-1] -= spacing_m  # the last leg closes the square
    return _legs(centre, length_m, course_deg + 90.0 * number)


def sector_search(centre: Point, extent_m: float, course_deg: float) -> Floats:
    """Return a sector search (VS), (W, 2) metres: three triangles that meet in the centre.

    Nine legs as long as the extent, the radius. All turns are of 120 degrees to the right, and
    every third leg leads to the centre, through which the UAV flies straight on.
    """
    away = extent_m * _heading(course_deg + np.array([[0.0, 60.0], [240.0, 300.0], [120.0, 180.0]]))
    middle = np.array(centre)
    return np.vstack([middle, *(point for out in away for point in (*(middle + out), middle))])


def parallel_track(
    centre: Point, length_m: float, width_m: float, spacing_m: float, course_deg: float
) -> Floats:
    """Return parallel tracks over a rectangle (PS), the lawnmower, (W, 2) metres.

    Parameters
    ----------
    length_m
        How long each track is, along the course.
    width_m
        What the tracks cover to the right of the first one, each half a spacing to either side;
        there are as many as fit, at least one.
    """
    tracks = max(1, int(width_m / spacing_m + 1e-9))
    across_m = spacing_m * (np.arange(tracks) - (tracks - 1) / 2.0)
    along_m = np.where(np.arange(tracks) % 2 == 0, -0.5, 0.5)[:, None] * (1.0, -1.0) * length_m
    ahead, right = _heading(course_deg), _heading(course_deg + 90.0)
    points = along_m[:, :, None] * ahead + across_m[:, None, None] * right
    return np.asarray(centre + points.reshape(-1, 2))


def repeated(one_pass: Callable[[int], Floats], flight_m: float) -> Floats:
    """Return passes of a pattern one after the other, (W, 2), until they are so long together.

    There are at most ``MOST_POINTS`` points, and the first leg at least.

    Parameters
    ----------
    one_pass
        Returns the points of a pass by its number, from 0 on.
    """
    points, left_m, number = np.empty((0, 2)), flight_m, 0
    while not len(points) or (left_m > 0.0 and len(points) < MOST_POINTS):
        flown = one_pass(number)
        joined = np.vstack([points[-1:], flown])
        steps_m = np.hypot(*np.diff(joined, axis=0).T)
        enough = int(np.searchsorted(np.cumsum(steps_m), left_m)) + 1
        points = np.vstack([points, flown[: enough + (number == 0)]])
        left_m -= float(steps_m.sum())
        number += 1
    return points[:MOST_POINTS]


def _heading(course_deg: Floats | float) -> Floats:
    """Return the way of one metre on a course, (..., 2): x east, y north."""
    course = np.radians(course_deg)
    return np.stack([np.sin(course), np.cos(course)], axis=-1)


def _legs(start: Point, length_m: Floats, course_deg: Floats) -> Floats:
    """Return the points of a way from a start on, given each leg's length and course."""
    steps_m = np.asarray(length_m)[:, None] * _heading(course_deg)
    return np.asarray(start + np.vstack([[(0.0, 0.0)], np.cumsum(steps_m, axis=0)]))
