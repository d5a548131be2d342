"""What-if flights (Figure 6): what each of many legs would see from one place and time on."""

from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets
from planner.detection.first_detection import columns
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
        return np.bincount(self.flight, weights=amount, minlength=len(self.leg))

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


class WhatIf:
    """Flies every leg in thought against one problem's futures; exact, in continuous time.

    Holds the passages of all particles along all roads by time, made once; their number grows
    with the roads that particles pass, not with the roads there are.
    """

    def __init__(self, problem: Problem) -> None:
        from planner.search.kernels_passages import all_passages, fastest

        legs, sensor = problem.legs, problem.sensor
        self.problem = problem
        self._futures = columns(problem.futures)
        self._legs = (
            legs.from_node,
            legs.duration_s,
            legs.first_point,
            legs.after_s,
            legs.x_m,
            legs.y_m,
            legs.node_xy_m,
        )
        self._passages = all_passages(self._futures, _roads(problem), sensor.radius_m)
        self._sensing = (
            float(sensor.radius_m),
            float(legs.speed_mps),
            float(fastest(self._futures)),
            sensor.detects_in_transit,
        )

    def fly(self, state: SearchState, legs: Ints, *, unseen: Flags | None = None) -> Sightings:
        """Return what each leg would see from a state on.

        Parameters
        ----------
        legs
            Leg indices, (C,).
        unseen
            The particles to look for, (N,); by default those the state has not seen.
        """
        from planner.search.kernels import what_if_sightings

        wanted = np.ascontiguousarray(legs, dtype=np.int32)
        look_for = np.isinf(state.seen_at) if unseen is None else unseen
        start_s, first, particle, seen_at = what_if_sightings(
            (float(state.time_s), float(state.x_m), float(state.y_m)),
            wanted,
            look_for,
            self._legs,
            (self._futures, self._passages),
            self._sensing,
        )
        end_s = start_s + self.problem.legs.duration_s[wanted]
        return Sightings(wanted, start_s, end_s, first, particle, seen_at)

    def fly_by_ticks(
        self, state: SearchState, legs: Ints, tick_s: float, *, unseen: Flags | None = None
    ) -> Sightings:
        """Return what each leg would see if the sensor only looked at each tick of its flight.

        As ``fly``, but slow: lines 8-27 of Figure 6 step by step. The first look is one tick
        after the flight's start, the last one at or before its end.
        """
        from planner.search.kernels_ticks import seen_by_ticks

        wanted = np.ascontiguousarray(legs, dtype=np.int32)
        look_for = np.isinf(state.seen_at) if unseen is None else unseen
        start_s = state.time_s + self.problem.legs.transit_s(state.x_m, state.y_m)[wanted]
        seen_at = seen_by_ticks(
            (float(state.time_s), float(state.x_m), float(state.y_m)),
            (wanted, start_s),
            look_for,
            self._legs,
            self._futures,
            (self._sensing[0], float(tick_s), self._sensing[3]),
        )
        flight, particle = np.nonzero(np.isfinite(seen_at))
        first = np.searchsorted(flight, np.arange(len(wanted) + 1))
        end_s = start_s + self.problem.legs.duration_s[wanted]
        return Sightings(wanted, start_s, end_s, first, particle, seen_at[flight, particle])


def _roads(problem: Problem) -> tuple[Offsets, Floats, Floats]:
    network = problem.network
    shape = network.shape_xy_m
    return network.first_point, shape[:, 0].copy(), shape[:, 1].copy()
