"""What-if flights (Figure 6): what each of many legs would see from one place and time on."""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets
from planner.detection.first_detection import columns
from planner.flight.legs import Legs
from planner.search.problem import Problem
from planner.search.state import SearchState


@dataclass(frozen=True, eq=False)
class Sightings:
    """What each of C legs would see of the particles not seen yet, if it were flown next.

    A flight is the straight transit to the leg's start, then the road. Each flight names a
    particle at most once, at its first sighting.
    """

    leg: Ints  # (C,) leg index
    start_s: Floats  # (C,) seconds, when its road begins
    end_s: Floats  # (C,) seconds, when its road ends
    first: Offsets  # (C + 1,) where a flight's sightings start
    particle: Ints  # (M,) particle index
    seen_at: Floats  # (M,) seconds on the target's clock

    @property
    def flight(self) -> Offsets:
        """Index of the flight that each sighting belongs to, (M,)."""
        return np.repeat(np.arange(len(self.leg)), np.diff(self.first))

    def per_flight(self, amount: Floats) -> Floats:
        """Return the sum over each flight's sightings of an amount per sighting, (C,)."""
        sums = np.bincount(self.flight, weights=amount, minlength=len(self.leg))
        return np.asarray(sums, dtype=np.float64)

    def those(self, kept: Flags) -> "Sightings":
        """Return the same flights with some of their sightings only, (M,)."""
        counts = np.bincount(self.flight[kept], minlength=len(self.leg))
        return replace(
            self,
            first=np.concatenate(([0], np.cumsum(counts))),
            particle=self.particle[kept],
            seen_at=self.seen_at[kept],
        )

    def seen(self, flight: int, particles: int) -> Floats:
        """Return when one flight sees each particle, (particles,) seconds, inf: not."""
        mine = slice(self.first[flight], self.first[flight + 1])
        seen_at = np.full(particles, np.inf)
        seen_at[self.particle[mine]] = self.seen_at[mine]
        return seen_at


@dataclass(frozen=True, eq=False)
class Scores:
    """What each of C legs would earn with the particles not seen yet, if it were flown next."""

    leg: Ints  # (C,) leg index
    start_s: Floats  # (C,) seconds, when its road begins
    end_s: Floats  # (C,) seconds, when its road ends
    reward: Floats  # (C,) expected reward of the sightings, by the problem's objective
    seen: Floats  # (C,) weight of the particles seen


class WhatIf:
    """Flies every leg in thought against one problem's futures; exact, in continuous time.

    Looks up the passages of all particles along all roads by time, made once for a problem; their
    number grows with the roads that particles pass, not with the roads there are.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.world = indexed(problem)
        self.motion, self.passages, self.leg_columns, self.sensing = self.world

    def score(self, state: SearchState, legs: Ints, *, unseen: Flags | None = None) -> Scores:
        """Return what each leg would earn from a state on, by the problem's objective.

        As ``fly``, but without the single sightings.
        """
        from planner.search.kernels.what_if import score_all

        place, flights, ends, look_for = self._asked(state, legs, unseen)
        objective = self.problem.objective
        by_s = np.inf if objective.by_s is None else float(objective.by_s)
        aim = (self.problem.futures.weight, (float(objective.horizon_s), by_s))
        start_s, reward, seen = score_all(place, flights, ends, look_for, self.world, aim)
        end_s = start_s + self.problem.legs.duration_s[flights[0]]
        return Scores(flights[0], start_s, end_s, reward, seen)

    def fly(self, state: SearchState, legs: Ints, *, unseen: Flags | None = None) -> Sightings:
        """Return what each leg would see from a state on.

        Parameters
        ----------
        legs
            Leg indices, (C,).
        unseen
            The particles to look for, (N,); by default those the state has not seen.
        """
        from planner.search.kernels.what_if import fly_all

        place, flights, ends, look_for = self._asked(state, legs, unseen)
        start_s, first, particle, seen_at = fly_all(place, flights, ends, look_for, self.world)
        end_s = start_s + self.problem.legs.duration_s[flights[0]]
        return Sightings(flights[0], start_s, end_s, first, particle, seen_at)

    def _asked(self, state: SearchState, legs: Ints, unseen: Flags | None) -> tuple[Any, ...]:
        """Return place, flights, ends and the particles to look for, as the kernels take them."""
        wanted = np.ascontiguousarray(legs, dtype=np.int32)
        look_for = np.isinf(state.seen_at) if unseen is None else unseen
        place = (float(state.time_s), float(state.x_m), float(state.y_m))
        end_of_node, ends = _around(self.problem.legs, place[1], place[2])
        return place, (wanted, end_of_node[self.problem.legs.from_node[wanted]]), ends, look_for

    def fly_by_ticks(
        self, state: SearchState, legs: Ints, tick_s: float, *, unseen: Flags | None = None
    ) -> Sightings:
        """Return what each leg would see if the sensor only looked at each tick of its flight.

        As ``fly``, but slow: lines 8-27 of Figure 6 step by step. The first look is one tick
        after the flight's start, the last one at or before its end.
        """
        from planner.search.kernels.ticks import seen_by_ticks

        wanted = np.ascontiguousarray(legs, dtype=np.int32)
        look_for = np.isinf(state.seen_at) if unseen is None else unseen
        start_s = state.time_s + self.problem.legs.transit_s(state.x_m, state.y_m)[wanted]
        seen_at = seen_by_ticks(
            (float(state.time_s), float(state.x_m), float(state.y_m)),
            (wanted, start_s),
            look_for,
            self.leg_columns,
            columns(self.problem.futures),
            (self.sensing[0], float(tick_s), self.sensing[2]),
        )
        flight, particle = np.nonzero(np.isfinite(seen_at))
        first = np.searchsorted(flight, np.arange(len(wanted) + 1))
        end_s = start_s + self.problem.legs.duration_s[wanted]
        return Sightings(wanted, start_s, end_s, first, particle, seen_at[flight, particle])


@lru_cache(maxsize=256)
def _around(legs: Legs, x_m: float, y_m: float) -> tuple[Ints, tuple[Floats, Floats, Floats]]:
    """Return which end each node is, seen from a place, (V,), -1: it is there; and the ends."""
    from planner.search.kernels.transits import bearings_of

    offset = legs.node_xy_m - (x_m, y_m)
    away_m = np.hypot(offset[:, 0], offset[:, 1])
    nodes = np.flatnonzero(away_m > 0.0)
    bearings = bearings_of(offset[nodes])
    order = np.argsort(bearings, kind="stable")
    nodes = nodes[order]
    end_of_node = np.full(len(legs.node_xy_m), -1, dtype=np.int32)
    end_of_node[nodes] = np.arange(len(nodes))
    ways = offset[nodes] / away_m[nodes, None]
    return end_of_node, (bearings[order], ways, away_m[nodes] / legs.speed_mps)


_indices: WeakKeyDictionary[Problem, tuple[Any, ...]] = WeakKeyDictionary()


def indexed(problem: Problem) -> tuple[Any, ...]:
    """Return a problem's futures by road and time, as ``kernels.what_if.World``; made once."""
    if problem not in _indices:
        _indices[problem] = index_of(problem)
    return _indices[problem]


def index_of(problem: Problem) -> tuple[Any, ...]:
    """Return motion, passages, legs and sensing of a problem."""
    from planner.search.kernels.motion import motion_of

    legs, sensor = problem.legs, problem.sensor
    motion = motion_of(columns(problem.futures))
    leg_columns = (legs.first_point, legs.after_s, legs.x_m, legs.y_m, *velocities(legs))
    sensing = (float(sensor.radius_m), float(legs.speed_mps), sensor.detects_in_transit)
    return motion, passages(problem, motion), leg_columns, sensing


def velocities(legs: Legs) -> tuple[Floats, Floats]:
    """Return the UAV's velocity from each of the legs' points on, (Q,) m/s in x and in y."""
    steps = np.diff([legs.x_m, legs.y_m], append=0.0)
    lengths = np.hypot(*steps)
    per_metre = np.divide(legs.speed_mps, lengths, out=np.zeros(len(lengths)), where=lengths > 0.0)
    return steps[0] * per_metre, steps[1] * per_metre


def passages(
    problem: Problem, motion: tuple[Any, ...]
) -> tuple[Offsets, Floats, Floats, Floats, Ints, Offsets]:
    """Return every particle's passages along every road, by road and time.

    The columns are those of ``kernels.passages.PassageColumns``.
    """
    from planner.search.kernels.passages import all_passages, in_order

    network = problem.network
    shape = network.shape_xy_m
    roads = (network.first_point, shape[:, 0].copy(), shape[:, 1].copy())
    records = all_passages(motion, roads, problem.sensor.radius_m)
    order = np.argsort(records[1][:, 0])
    return in_order(records, order, 2 * len(network.road_ids))
