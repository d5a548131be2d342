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


class WhatIf:
    """Flies every leg in thought against one problem's futures; exact, in continuous time.

    Holds the passages of all particles along all roads by time, made once; their number grows
    with the roads that particles pass, not with the roads there are.
    """

    def __init__(self, problem: Problem) -> None:
        from planner.search.kernels_passages import fastest

        legs, sensor = problem.legs, problem.sensor
        self.problem = problem
        self.futures_columns = columns(problem.futures)
        self.leg_columns = (legs.first_point, legs.after_s, legs.x_m, legs.y_m)
        self.passages = passages(problem)
        self.sensing = (
            float(sensor.radius_m),
            float(legs.speed_mps),
            float(fastest(self.futures_columns)),
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
        from planner.search.kernels import leg_sightings, most_sightings

        known = self.problem.legs
        wanted = np.ascontiguousarray(legs, dtype=np.int32)
        look_for = np.isinf(state.seen_at) if unseen is None else unseen
        nodes = known.from_node[wanted]
        start_at_node, heads, chain, counts = self._transits(state, nodes, look_for)
        start_s = start_at_node[nodes]
        end_s = start_s + known.duration_s[wanted]
        spans = np.empty((len(wanted), 2, 2), dtype=np.int64)
        most = most_sightings(wanted, start_s, end_s, self.passages, spans)
        most += int(counts[nodes].sum())
        found = (np.empty(most, dtype=np.int32), np.empty(most))
        world = (self.futures_columns, self.passages, self.sensing[0])
        flights = (wanted, start_s, heads[nodes], spans)
        count = leg_sightings(flights, look_for, self.leg_columns, world, chain, found)
        first = np.concatenate(([0], spans[:, 1, 1]))
        return Sightings(wanted, start_s, end_s, first, found[0][:count], found[1][:count])

    def _transits(
        self, state: SearchState, nodes: Ints, unseen: Flags
    ) -> tuple[Floats, Ints, tuple[Ints, Ints, Floats], Ints]:
        """Fly straight to each node that a leg starts at, once.

        Returns when the UAV is there (V,), the head of each node's chain of sightings (V,), the
        chains, and their lengths (V,).
        """
        from planner.search.kernels import bearings_of, lengths_of, transit_sightings

        place = (float(state.time_s), float(state.x_m), float(state.y_m))
        node_xy_m = self.problem.legs.node_xy_m
        offset = node_xy_m - place[1:]
        away_m = np.hypot(offset[:, 0], offset[:, 1])
        arrive_s = place[0] + away_m / self.sensing[1]
        asked = np.zeros(len(node_xy_m), dtype=np.bool_)
        if self.problem.sensor.detects_in_transit:
            asked[nodes] = offset[nodes].any(axis=1)
        ends = np.flatnonzero(asked)
        bearings = bearings_of(offset[ends])
        order = np.argsort(bearings)
        ends = ends[order]
        waypoints = np.empty((3, len(ends), 2))
        waypoints[:, :, 0] = np.array(place)[:, None]
        waypoints[0, :, 1] = arrive_s[ends]
        waypoints[1:, :, 1] = node_xy_m[ends].T
        flat = waypoints.reshape(3, -1)
        ways = offset[ends] / away_m[ends, None]
        transits = (bearings[order], (flat[0], flat[1], flat[2]), ways)
        head, chain = transit_sightings(place, transits, unseen, self.futures_columns, self.sensing)
        heads, counts = np.full((2, len(node_xy_m)), [[-1], [0]], dtype=np.int32)
        heads[ends], counts[ends] = head, lengths_of(head, chain)
        return arrive_s, heads, chain, counts

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
            self.leg_columns,
            self.futures_columns,
            (self.sensing[0], float(tick_s), self.problem.sensor.detects_in_transit),
        )
        flight, particle = np.nonzero(np.isfinite(seen_at))
        first = np.searchsorted(flight, np.arange(len(wanted) + 1))
        end_s = start_s + self.problem.legs.duration_s[wanted]
        return Sightings(wanted, start_s, end_s, first, particle, seen_at[flight, particle])


def passages(problem: Problem) -> tuple[Offsets, Floats, Floats, Floats, Ints]:
    """Return every particle's passages along every road, by road and time.

    The columns are those of ``kernels_passages.PassageColumns``.
    """
    from planner.search.kernels_passages import all_passages

    network = problem.network
    shape = network.shape_xy_m
    roads = (network.first_point, shape[:, 0].copy(), shape[:, 1].copy())
    lists = 2 * len(network.road_ids)
    entry, from_s, to_s, particle = all_passages(
        columns(problem.futures), roads, problem.sensor.radius_m
    )
    order = np.argsort(from_s)
    # Small integers are sorted by digits, many times faster.
    by_entry = entry[order].astype(np.min_scalar_type(lists))
    order = order[np.argsort(by_entry, kind="stable")]
    first = np.searchsorted(entry[order], np.arange(lists + 1))
    to_s = to_s[order]
    latest_s = to_s.copy()
    for begin, end in zip(first[:-1].tolist(), first[1:].tolist(), strict=True):
        np.maximum.accumulate(latest_s[begin:end], out=latest_s[begin:end])
    return first, from_s[order], to_s, latest_s, particle[order]
