"""What-if flights (Figure 6): what each of many legs would see from one place and time on."""

from dataclasses import dataclass, replace
from functools import lru_cache
from weakref import WeakKeyDictionary

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets, first_rows
from planner.checked import indices
from planner.detection.first_detection import columns
from planner.detection.kernels.worth import Goal, Others, others_of
from planner.detection.survival import survival
from planner.flight.law import FlightLaw
from planner.flight.legs import Legs
from planner.futures.futures import Futures, Pieces
from planner.search.kernels.along_roads import LegColumns, SearchIndex
from planner.search.kernels.ceilings import Doubt, ceilings
from planner.search.kernels.motion import ParticleMotion, motion_of
from planner.search.kernels.passages import PassageColumns, RoadShapes, all_passages, in_order
from planner.search.kernels.ticks import TimedLegs, seen_by_ticks
from planner.search.kernels.transits import Transits, bearings_of
from planner.search.kernels.turning import Turning
from planner.search.kernels.what_if import Candidates, fly_all, judged, score_all
from planner.search.kernels.windows import Departure, Sensing
from planner.search.problem import Problem
from planner.search.state import SearchState

# Four caches outlive the planner that filled them, each of what never changes: the indices of
# problems (`_indices`, as long as a problem lives), the last grid of futures
# (`waypoint_rewards._grids`, as long as they live), the transits from the last 256 places asked
# for (`_transits_from`), and the ways of the last 16 beams (`ways.ways_within`). The latter two
# keep the `Legs` that they were asked about alive.
_indices: WeakKeyDictionary[Problem, SearchIndex] = WeakKeyDictionary()

PACE = 0.8  # of the UAV's speed: who is faster for a while only falls behind a flight in the end


@dataclass(frozen=True, eq=False)
class Sightings:
    """What each of C legs would see of the particles not seen yet, if it were flown next.

    A flight is the straight transit to the leg's start, then the road. With a perfect sensor each
    flight names a particle at most once, at its first sighting; else at each contact, in order of
    time.
    """

    leg: Ints  # (C,) leg index
    start_s: Floats  # (C,) seconds, when its road begins
    end_s: Floats  # (C,) seconds, when its road ends
    first: Offsets  # (C + 1,) where a flight's sightings start
    particle: Ints  # (M,) particle index
    seen_at: Floats  # (M,) seconds on the target's clock, when it comes within the radius
    # Both as far as the particle is unseen when the flight begins:
    worth: Floats  # (M,) what the sighting is worth, by the problem's objective
    share: Floats  # (M,) probability that this is when it is seen; 1 with a perfect sensor

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
            first=first_rows(counts),
            particle=self.particle[kept],
            seen_at=self.seen_at[kept],
            worth=self.worth[kept],
            share=self.share[kept],
        )

    def seen(self, flight: int, particles: int) -> Floats:
        """Return when one flight sees each particle, (particles,) seconds, inf: not."""
        mine = slice(self.first[flight], self.first[flight + 1])
        seen_at = np.full(particles, np.inf)
        np.minimum.at(seen_at, self.particle[mine], self.seen_at[mine])
        return seen_at

    def missed(self, flight: int, particles: int) -> Floats:
        """Return the probability that one flight misses each particle, (particles,)."""
        mine = slice(self.first[flight], self.first[flight + 1])
        seen = np.bincount(self.particle[mine], self.share[mine], particles)
        return np.asarray(np.maximum(0.0, 1.0 - seen))


@dataclass(frozen=True, eq=False)
class Scores:
    """What each of C legs would earn, if it were flown next."""

    leg: Ints  # (C,) leg index
    start_s: Floats  # (C,) seconds, when its road begins
    end_s: Floats  # (C,) seconds, when its road ends
    reward: Floats  # (C,) expected reward of the sightings, by the problem's objective
    seen: Floats  # (C,) weight of the particles seen, as far as they are still unseen


class WhatIf:
    """Simulates flights along legs against one problem's futures; exact, in continuous time.

    Looks up the passages of all particles along all roads by time, made once for a problem; their
    number grows with the roads that particles pass, not with the roads there are.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.index = indexed(problem)

    def score(self, state: SearchState, legs: Ints, *, miss: Floats | None = None) -> Scores:
        """Return what each leg would earn from a state on, by the problem's objective.

        As ``fly``, but without the single sightings.
        """
        departure, candidates, transits = self._ways(state, legs)
        earned = score_all(departure, candidates, transits, _miss(state, miss), self.index)
        end_s = earned.start_s + self.problem.legs.duration_s[candidates.leg]
        return Scores(candidates.leg, earned.start_s, end_s, earned.reward, earned.seen)

    def fly(self, state: SearchState, legs: Ints, *, miss: Floats | None = None) -> Sightings:
        """Return what each leg would see from a state on.

        Parameters
        ----------
        legs
            Leg indices, (C,).
        miss
            Probability that each particle is still unseen, (N,); by default the state's. Those
            with more than 0 are looked for.
        """
        departure, candidates, transits = self._ways(state, legs)
        flown = fly_all(departure, candidates, transits, _miss(state, miss), self.index)
        end_s = flown.start_s + self.problem.legs.duration_s[candidates.leg]
        if self.problem.sensor.is_perfect and not self.problem.flown:
            worth = self.problem.objective.reward(flown.from_s)
            share = np.ones(len(worth))
        else:
            worth, share = judged(flown, self.index)
        return Sightings(
            candidates.leg,
            flown.start_s,
            end_s,
            flown.first,
            flown.particle,
            flown.from_s,
            worth,
            share,
        )

    def ceilings(
        self, state: SearchState, legs: Ints, unseen: Floats, *, missed: float = 0.0
    ) -> Floats:
        """Return what each leg earns at most if it is flown from a state on, (C,).

        A hundred times faster than ``score``, and rather too high.

        Parameters
        ----------
        unseen
            Probability of each particle, as far as it is looked for, (N,).
        missed
            Probability that a particle seen a horizon ago was missed then.
        """
        departure, candidates, transits = self._ways(state, legs)
        doubt = Doubt(np.array(unseen, dtype=np.float64), state.seen_at.copy(), float(missed))
        return ceilings(departure, candidates, transits, doubt, self.index)

    def fly_by_ticks(
        self, state: SearchState, legs: Ints, tick_s: float, *, miss: Floats | None = None
    ) -> Sightings:
        """Return what each leg would see if the sensor only looked at each tick of its flight.

        As ``fly``, but slow: lines 8-27 of Figure 6 step by step. The first look is one tick
        after the flight's start, the last one at or before its end.
        """
        wanted = np.ascontiguousarray(legs, dtype=np.int32)
        start_s = state.time_s + state.to_legs_s(self.problem.legs)[wanted]
        seen_at = seen_by_ticks(
            _departure(state),
            TimedLegs(wanted, start_s),
            _miss(state, miss),
            columns(self.problem.futures),
            self.index,
            float(tick_s),
        )
        flight, particle = np.nonzero(np.isfinite(seen_at))
        first = np.searchsorted(flight, np.arange(len(wanted) + 1))
        end_s, seen_at = start_s + self.problem.legs.duration_s[wanted], seen_at[flight, particle]
        worth, share = self.problem.objective.reward(seen_at), np.ones(len(seen_at))
        return Sightings(wanted, start_s, end_s, first, particle, seen_at, worth, share)

    def _ways(self, state: SearchState, legs: Ints) -> tuple[Departure, Candidates, Transits]:
        """Return how legs can be flown to from where a state is, as the kernels take it."""
        wanted = np.ascontiguousarray(legs, dtype=np.int32)
        indices(len(self.problem.legs), legs=wanted)
        departure = _departure(state)
        transit_to, transits = _transits_from(self.problem.legs, departure.x_m, departure.y_m)
        transit = transit_to[self.problem.legs.from_node[wanted]]
        candidates = Candidates(wanted, transit, state.turns_s(self.problem.legs)[wanted])
        return departure, candidates, transits


def _departure(state: SearchState) -> Departure:
    return Departure(float(state.time_s), float(state.x_m), float(state.y_m))


def _miss(state: SearchState, miss: Floats | None) -> Floats:
    """Return the state's ``miss`` unless another one is given, (N,).

    A copy, as compiled code is compiled once more for arrays that are read-only.
    """
    return np.array(state.miss if miss is None else miss, dtype=np.float64)


@lru_cache(maxsize=256)
def _transits_from(legs: Legs, x_m: float, y_m: float) -> tuple[Ints, Transits]:
    """Return which transit leads from a place to each node, (V,), -1: it is there; and all."""
    offset = legs.node_xy_m - (x_m, y_m)
    away_m = np.hypot(offset[:, 0], offset[:, 1])
    nodes = np.flatnonzero(away_m > 0.0)
    bearings = bearings_of(offset[nodes])
    order = np.argsort(bearings, kind="stable")
    nodes = nodes[order]
    transit_to = np.full(len(legs.node_xy_m), -1, dtype=np.int32)
    transit_to[nodes] = np.arange(len(nodes))
    ways = offset[nodes] / away_m[nodes, None]
    return transit_to, Transits(bearings[order], ways, away_m[nodes] / legs.speed_mps)


def indexed(problem: Problem) -> SearchIndex:
    """Return a problem's index, made when it is first asked for."""
    if problem not in _indices:
        _indices[problem] = index_of(problem)
    return _indices[problem]


def index_of(problem: Problem) -> SearchIndex:
    """Return a problem's index, made anew."""
    legs, sensor, futures = problem.legs, problem.sensor, problem.futures
    pace_mps = PACE * float(legs.speed_mps)
    motion = motion_of(columns(futures), rows_of(futures.pieces), pace_mps)
    return SearchIndex(
        motion,
        passages(problem, motion),
        LegColumns(legs.first_point, legs.after_s, legs.x_m, legs.y_m, *velocities(legs)),
        Sensing(
            float(sensor.radius_m),
            float(legs.speed_mps),
            sensor.detects_in_transit,
            float(sensor.rate_per_s),
        ),
        futures.weight,
        goal_of(problem, futures),
    )


def goal_of(problem: Problem, futures: Futures) -> Goal:
    """Return an objective, and what others do for it with given futures, as the kernels take it."""
    horizon_s, by_s = float(problem.objective.horizon_s), problem.objective.by_s
    by_s = np.inf if by_s is None else float(by_s)
    if not problem.flown:
        nobody, none = np.empty(0, dtype=np.int64), np.empty(0)
        return Goal(horizon_s, by_s, Others(nobody, none, none, none, none, none))
    others = survival(futures, problem.flown)
    return Goal(horizon_s, by_s, others_of(others.columns, horizon_s, by_s))


def rows_of(pieces: Pieces) -> Floats:
    """Return pieces of straight motion with one row each, (K, 6) as ``kernels.motion`` has them."""
    from_s, x_m, y_m, vx_mps, vy_mps, to_s = pieces
    return np.stack([x_m, y_m, vx_mps, vy_mps, from_s, to_s], axis=1)


def velocities(legs: Legs) -> tuple[Floats, Floats]:
    """Return the UAV's velocity from each of the legs' points on, (Q,) m/s in x and in y."""
    steps = np.diff([legs.x_m, legs.y_m], append=0.0)
    lengths = np.hypot(*steps)
    per_metre = np.divide(legs.speed_mps, lengths, out=np.zeros(len(lengths)), where=lengths > 0.0)
    if np.isfinite(legs.law.acceleration_mps2):  # slower where corners delay it
        lasts_s = np.diff(legs.after_s, append=0.0)
        per_metre = np.divide(1.0, lasts_s, out=np.zeros(len(lengths)), where=lasts_s > 0.0)
    return steps[0] * per_metre, steps[1] * per_metre


def turning_of(law: FlightLaw) -> Turning:
    """Return how an aircraft takes corners, as the kernels take it."""
    rates = law.speed_mps, law.acceleration_mps2, law.corner_m
    return Turning(*map(float, rates), *map(float, law.wind_mps))


def passages(problem: Problem, motion: ParticleMotion) -> PassageColumns:
    """Return every particle's passages along every road, by road and time."""
    network = problem.network
    shape = network.shape_xy_m
    roads = RoadShapes(network.first_point, shape[:, 0].copy(), shape[:, 1].copy())
    records = all_passages(motion, roads, problem.sensor.radius_m)
    order = np.argsort(records.times_s[:, 0])
    return in_order(records, order, 2 * len(network.road_ids))
