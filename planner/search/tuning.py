"""Tuning a pilot's pattern: where, how wide and which way round it serves best.

A pattern that nobody tuned is a straw man: its centre, spacing, extent and course are worth as much
as the choice of the pattern. So many of each are flown against the planning particles, first
widely apart, then close to the best one, and the best is the plan.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from planner.arrays import Floats
from planner.errors import NotApplicableError
from planner.search.patterns import Point
from planner.search.plan import needs_open_country, plan_of_waypoints
from planner.search.problem import Budget, Problem
from planner.search.result import SearchLog, SearchResult
from planner.search.waypoint_rewards import WaypointRewards

TRIES = 200  # flights of one pattern that are compared, at most
TRY = 400  # units of work that one takes, about
WIDELY = 0.5  # share of the tries that are drawn widely; the others lie close to the best one
FAR = 0.95  # share of the particles that the widest patterns enclose, about
FARTHEST, SIZES = 1.5, 16.0  # reach of the widest pattern, by that; of the widest to the smallest
FINEST = 40  # tracks of the finest pattern from its centre outwards


@dataclass(frozen=True)
class Layout:
    """Where a pattern lies, and how large it is."""

    centre: Point  # x and y, metres
    spacing_m: float  # between neighbouring tracks
    extent_m: float  # from the centre to its edge
    course_deg: float  # of the first leg, clockwise from north
    slimness: float = 1.0  # of an oblong one: width by length

    def near(self, rng: np.random.Generator, step: float) -> "Layout":
        """Return one that differs in all of them, by about a step from 0 to 1."""
        east, north, turn, *scales = rng.normal(size=6).tolist()
        spacing, extent, slimness = np.exp(0.4 * step * np.array(scales)).tolist()
        away_m = 0.25 * step * self.extent_m
        return Layout(
            (self.centre[0] + away_m * east, self.centre[1] + away_m * north),
            self.spacing_m * spacing,
            self.extent_m * extent,
            (self.course_deg + 30.0 * step * turn) % 360.0,
            self.slimness * slimness,
        )


class Tuner:
    """Flies one pattern after the other and keeps the best: the first one among equals."""

    def __init__(self, problem: Problem, budget: Budget, method: str) -> None:
        needs_open_country(problem, method)
        self._problem, self._method = problem, method
        self._log = SearchLog(problem, budget)
        self._rewards = WaypointRewards(problem)
        self._best, self._reward = np.empty((0, 3)), -np.inf
        self.done, self.most = 0, max(1, min(TRIES, budget.work // TRY))

    @property
    def step(self) -> float:
        """How far from the best one the next should be, 1 to 0; above 1: anywhere."""
        return (1.0 - self.done / self.most) / (1.0 - WIDELY)

    @property
    def goes_on(self) -> bool:
        """Whether another one may be flown; the first one always is."""
        return self.done < self.most and not (self.done and self._log.stop())

    def is_better(self, points: Floats) -> bool:
        """Fly over points, (W, 2) metres, hover over the last one; return whether that is best."""
        waits_s = np.zeros(len(points))
        waits_s[-1] = self._problem.horizon_s
        waypoints = np.column_stack([points, waits_s])
        reward = self._rewards.of(waypoints)
        better = reward > self._reward
        if better:
            self._best, self._reward = waypoints, reward
        self.done += 1
        self._log.reached(self._reward, TRY * self.done)
        return better

    def result(self) -> SearchResult:
        """Return the best flight as a plan, and what was done to find it."""
        return self._log.result(plan_of_waypoints(self._problem, self._method, self._best))


def sought(problem: Problem) -> Floats:
    """Return what each particle counts, (N,): its probability; the same if all have been seen."""
    weight = problem.weight_at_start
    some = weight[np.diff(problem.futures.first_knot) > 0]
    return weight if some.any() else np.ones(len(weight))


@dataclass(frozen=True, eq=False)
class Whereabouts:
    """Where particles set out, and where they are while the UAV searches."""

    starts_xy_m: Floats  # (N, 2) metres
    later_xy_m: Floats  # (N, 2) metres, each at a time of its own
    weight: Floats  # (N,) probability, sums to 1
    radius_m: float  # of the sensor
    flight_m: float  # how far the UAV can fly until the search ends

    @classmethod
    def of(cls, problem: Problem, rng: np.random.Generator) -> "Whereabouts":
        """Return those of a problem's particles, as many as ever set out.

        Raises
        ------
        NotApplicableError
            If none does.
        """
        futures, uav = problem.futures, problem.uav_at_start
        set_out = np.diff(futures.first_knot) > 0
        if not set_out.any():
            raise NotApplicableError("no particle ever sets out, so there is nothing to search for")
        first = futures.first_knot[:-1][set_out]
        until_s = max(uav.take_off_s, min(problem.objective.ends_s, uav.landing_s))
        moments_s = rng.uniform(uav.take_off_s, until_s, len(futures))
        moments_s = np.clip(moments_s[set_out], futures.time_s[first], futures.end_s[set_out])
        at_s = np.zeros(len(futures))
        at_s[set_out] = moments_s
        weight = sought(problem)[set_out]
        return cls(
            np.stack([futures.x_m[first], futures.y_m[first]], axis=1),
            futures.positions(at_s)[set_out],
            weight / weight.sum(),
            problem.sensor.radius_m,
            (until_s - uav.take_off_s) * uav.speed_mps,
        )

    @cached_property
    def last_seen(self) -> Point:
        """The middle of the places where particles set out, x and y in metres."""
        x_m, y_m = self.weight @ self.starts_xy_m
        return float(x_m), float(y_m)

    @cached_property
    def far_m(self) -> float:
        """Within how many metres of there most particles are, most of the time.

        At least two sensor radii, and no further than the UAV comes and back.
        """
        away_m = np.hypot(*(self.later_xy_m - self.last_seen).T)
        order = np.argsort(away_m, kind="stable")
        most = int(np.searchsorted(np.cumsum(self.weight[order]), FAR))
        far_m = float(away_m[order[min(most, len(order) - 1)]])
        return max(2.0 * self.radius_m, min(far_m, self.flight_m / 2.0))

    @property
    def by_the_book(self) -> Layout:
        """The layout that nobody tuned: around last seen, gapless, north first."""
        return self.flyable(Layout(self.last_seen, 2.0 * self.radius_m, self.far_m, 0.0))

    def drawn(self, rng: np.random.Generator) -> Layout:
        """Return any layout: around last seen, where a particle comes to, or between the two."""
        extent_m = self.any_extent_m(rng)
        share, spacing, course, slimness = rng.random(4).tolist()
        spacing_m = self.radius_m * max(1.0, extent_m / self.radius_m) ** spacing
        there = self.later_xy_m[self.any_particle(rng)]
        x_m, y_m = self.last_seen + share * (there - self.last_seen)
        centre = (float(x_m), float(y_m))
        return Layout(centre, spacing_m, extent_m, 360.0 * course, 5.0 ** (2.0 * slimness - 1.0))

    def any_extent_m(self, rng: np.random.Generator) -> float:
        """Return a distance from the centre to which a pattern may reach, small ones as often."""
        return float(self.far_m * FARTHEST / SIZES ** rng.random())

    def any_particle(self, rng: np.random.Generator) -> int:
        """Return a particle drawn by weight."""
        return int(np.searchsorted(np.cumsum(self.weight)[:-1], rng.random()))

    def flyable(self, layout: Layout) -> Layout:
        """Return a layout with at least one track and no more than are worth telling apart."""
        spacing_m = max(layout.spacing_m, layout.extent_m / FINEST)
        return replace(layout, spacing_m=min(spacing_m, layout.extent_m))
