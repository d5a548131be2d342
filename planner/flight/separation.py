"""How UAVs keep apart: in height or on the ground plan, at all times that they may be anywhere.

Nobody flies to the second. A flight may run late or early by a share of the time since its
take-off, so that a UAV may be wherever it is planned to be within that share of then. Climb,
descent and the way home count as all else does.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from planner.arrays import Flags, Floats, Frozen, freeze
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.flight.uav import Uav
from planner.scenario.fleet import APART_M

BESIDE_M = 50.0  # on the ground plan, where they are not `APART_M` apart in height
MISTIMED = 0.05  # share of the time since take-off by which a flight may be early or late
STEP_S = 5.0  # a flight is cut into parts of at most that, anywhere in which it may be
ROUNDING_M = 1e-6
DELAYS_S = (5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 90.0, 120.0, 180.0, 240.0, 360.0, 600.0, 900.0)


@dataclass(frozen=True, eq=False)
class Course(Frozen):
    """A flight from lift-off to the ground, in P parts that are straight in space and even."""

    from_s: Floats  # (P,) seconds on the target's clock, the earliest that it may be in a part
    to_s: Floats  # (P,) and the latest
    ends_m: Floats  # (2, P, 2) metres, where a part begins and ends
    low_m: Floats  # (P,) metres above the ground, the least in a part
    high_m: Floats  # (P,) and the most

    def __post_init__(self) -> None:
        names = ("from_s", "to_s", "ends_m", "low_m", "high_m")
        freeze(self, **dict.fromkeys(names, np.float64))

    @classmethod
    def of(cls, track: Track, height_m: float, climb_s: float, descend_s: float) -> "Course":
        """Return the course of a flight.

        Parameters
        ----------
        height_m
            At which it flies, above the ground.
        climb_s, descend_s
            How long it climbs from the ground at its start, and comes down at its end; 0: it is at
            its height at once, or stays in the air.
        """
        begins_s, ends_s = float(track.time_s[0]), track.end_s
        up_s, down_s = begins_s + climb_s, ends_s - descend_s
        many = int((ends_s - begins_s) / STEP_S) + 1
        even_s = np.linspace(begins_s, ends_s, many + 1)
        bends_s = np.clip([*track.time_s, up_s, down_s], begins_s, ends_s)
        time_s = np.union1d(even_s, bends_s)
        after_s, left_s, xy_m = time_s - begins_s, ends_s - time_s, track.xy(time_s)
        share = np.minimum(_ramp(after_s, climb_s), _ramp(left_s, descend_s))
        low_m = height_m * np.minimum(share[:-1], share[1:])
        high_m = height_m * np.maximum(share[:-1], share[1:])
        return cls(
            begins_s + (1.0 - MISTIMED) * after_s[:-1],
            begins_s + (1.0 + MISTIMED) * after_s[1:],
            np.stack([xy_m[:-1], xy_m[1:]]),
            low_m,
            high_m,
        )

    def later(self, by_s: float) -> "Course":
        """Return the same flight begun later."""
        return replace(self, from_s=self.from_s + by_s, to_s=self.to_s + by_s)


def course_of(track: Track, uav: Uav) -> Course:
    """Return the course of a UAV along a track that begins on the ground."""
    if uav.aircraft is None:
        return Course.of(track, uav.altitude_m, 0.0, 0.0)
    law = uav.aircraft.law
    lands_s = 0.0 if uav.return_to_m is None else law.descend_s
    return Course.of(track, law.altitude_m, law.climb_s, lands_s)


def _ramp(time_s: Floats, lasts_s: float) -> Floats:
    """Return which share of its height a UAV has a time after, or before, it is on the ground."""
    return np.clip(time_s / lasts_s, 0.0, 1.0) if lasts_s > 0.0 else np.ones(len(time_s))


def too_near_s(one: Course, other: Course) -> float | None:
    """Return from when on two flights may be nearer than they should, seconds; None: never."""
    level = (one.low_m[:, None] < other.high_m + APART_M - ROUNDING_M) & (
        other.low_m < one.high_m[:, None] + APART_M - ROUNDING_M
    )
    level &= (one.from_s[:, None] <= other.to_s) & (other.from_s <= one.to_s[:, None])
    a, b = np.nonzero(level)
    near = _apart_m(one.ends_m[:, a], other.ends_m[:, b]) < BESIDE_M - ROUNDING_M
    if not near.any():
        return None
    return float(np.maximum(one.from_s[a[near]], other.from_s[b[near]]).min())


def meetings(courses: Sequence[Course], whose: Sequence[int]) -> Iterator[tuple[int, int, float]]:
    """Yield which two flights of different UAVs may come too near each other, and when first.

    Parameters
    ----------
    whose
        Which UAV's each flight is.
    """
    for one, other in combinations(range(len(courses)), 2):
        if whose[one] == whose[other]:
            continue
        near_s = too_near_s(courses[one], courses[other])
        if near_s is not None:
            yield one, other, near_s


def meetings_of(plan: Plan, uavs: Sequence[Uav]) -> Iterator[tuple[int, int, float]]:
    """Return the same of a plan; ``uavs`` are all of its fleet, each as its first flight begins."""
    flights = zip(plan.tracks, plan.flights, strict=True)
    courses = [course_of(track, uavs[one.uav].of_flight(one.number)) for track, one in flights]
    return meetings(courses, [one.uav for one in plan.flights])


def delay_s(course: Course, others: Sequence[Course]) -> float:
    """Return by how much later a flight should begin to keep apart from others; 0 if it does.

    After all others have landed it certainly does.
    """
    last_s = max((float(other.to_s.max(initial=-np.inf)) for other in others), default=-np.inf)
    after_all_s = max(0.0, last_s - float(course.from_s[0])) + STEP_S if len(course.from_s) else 0.0
    for by_s in (0.0, *(one for one in DELAYS_S if one < after_all_s), after_all_s):
        if keeps_apart(course.later(by_s), others):
            return by_s
    raise AssertionError("a flight after all others meets nobody")


def keeps_apart(course: Course, others: Sequence[Course]) -> bool:
    """Tell whether a flight is never too near any of the others."""
    return all(too_near_s(course, other) is None for other in others)


def _apart_m(one: Floats, other: Floats) -> Floats:
    """Return the least distance of segments in pairs, both (2, K, 2): (K,) metres."""
    ends = [_to_segment_m(point, *other) for point in one]
    ends += [_to_segment_m(point, *one) for point in other]
    return np.where(_cross(one, other), 0.0, np.min(ends, axis=0, initial=np.inf))


def _to_segment_m(point: Floats, a: Floats, b: Floats) -> Floats:
    """Return the distance of points from segments, (K,) metres."""
    way, offset = b - a, point - a
    length2 = np.maximum((way**2).sum(axis=1), ROUNDING_M**2)
    share = np.clip((way * offset).sum(axis=1) / length2, 0.0, 1.0)
    return np.asarray(np.hypot(*(offset - share[:, None] * way).T))


def _cross(one: Floats, other: Floats) -> Flags:
    """Return which pairs of segments cross, (K,)."""

    def side(a: Floats, b: Floats, point: Floats) -> Floats:
        return np.asarray(
            (b[:, 0] - a[:, 0]) * (point[:, 1] - a[:, 1])
            - (b[:, 1] - a[:, 1]) * (point[:, 0] - a[:, 0])
        )

    (a, b), (c, d) = one, other
    apart = (side(a, b, c) * side(a, b, d) < 0.0) & (side(c, d, a) * side(c, d, b) < 0.0)
    return np.asarray(apart)
