"""How the UAV and the particles of a problem can move; worked out once for all that ask."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.bounds.hops import Hops, hops_of, passes_over
from planner.bounds.kernels.meetings import Motion, Pieces
from planner.detection.evaluate import evaluate_all
from planner.detection.first_detection import first_detection
from planner.detection.survival import Searched, survival
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.search.problem import Problem

LONGEST_BIN_S = 5.0


class Place(NamedTuple):
    """A node that a flight has reached."""

    node: int
    time_s: float
    reward: Floats  # (N,) of what is seen until there, to be expected
    missed: Floats  # (N,) how probably each is unseen there; if nobody is missed, 1 or 0


@dataclass(frozen=True, eq=False)
class Movements:
    """The movements on which the bounds of a problem are built."""

    problem: Problem

    @cached_property
    def hops(self) -> Hops:
        """What road plans consist of after their first flight."""
        return hops_of(self.problem.legs)

    @cached_property
    def first_flights(self) -> tuple[Place, ...]:
        """Where each flight from take-off ends that is not two hops.

        Where the UAV takes off at a node there is only one: all other flights are hops.
        """
        return tuple(
            Place(node, float(track.end_s), *_done_by(self.problem, track))
            for node, track in _first_tracks(self.problem)
        )

    @cached_property
    def first_sights(self) -> tuple[Floats, ...]:
        """The rewards of what each of these sees first, as if it missed nothing, (N,) each."""
        futures, radius_m = self.problem.futures, self.problem.sensor.radius_m
        seen = (
            first_detection(futures, track, radius_m) for _, track in _first_tracks(self.problem)
        )
        return tuple(self.problem.objective.reward(one) for one in seen)

    @cached_property
    def pieces(self) -> Pieces:
        """The straight motions of all particles.

        Contacts with a sensor that may miss are bounded piece by piece, the fewer the better.
        """
        pieces = pieces_of(self.problem.futures)
        return pieces if self.problem.sensor.is_perfect else joined(pieces)

    @property
    def fitting_bin_s(self) -> float:
        """Bins short enough for every hop to last one, seconds."""
        return min(LONGEST_BIN_S, float(self.hops.duration_s.min()))


def _first_tracks(problem: Problem) -> Iterator[tuple[int, Track]]:
    uav, xy = problem.uav, problem.network.node_xy_m
    start_m = np.array([uav.x_m, uav.y_m])
    here = np.flatnonzero(np.all(xy == start_m, axis=1))[:1]
    for node in here if len(here) else range(len(xy)):
        if len(here) == 0 and passes_over(xy, start_m, xy[node]):
            continue
        at_s = uav.take_off_s + float(np.hypot(*(xy[node] - start_m))) / uav.speed_mps
        on = [(uav.take_off_s, at_s)] if problem.sensor.detects_in_transit else []
        path = np.array([start_m, xy[node]])
        track = Track(
            np.array([uav.take_off_s, at_s]), path[:, 0], path[:, 1], np.array(on).reshape(-1, 2)
        )
        yield int(node), track


def _done_by(problem: Problem, track: Track) -> tuple[Floats, Floats]:
    """Return the reward of a flight with each particle, and how probably it is missed."""
    searched = [Searched(track, problem.sensor)]
    reward = evaluate_all(searched, problem.futures, problem.objective).reward
    if problem.sensor.is_perfect:
        return reward, unseen_after(reward)
    return reward, survival(problem.futures, searched).at(track.end_s)


def unseen_after(reward: Floats) -> Floats:
    """Return 1 for each particle that a perfect sensor has not seen to any use, otherwise 0."""
    return np.asarray(reward == 0.0, dtype=np.float64)


def pieces_of(futures: Futures) -> Pieces:
    """Return all straight motions of futures.

    A particle that is somewhere for a moment only does not move there, and can be seen all the
    same.
    """
    straight, particle = futures.pieces, futures.particle
    moves = np.flatnonzero((straight.to_s > straight.from_s) & (straight.to_s < np.inf))
    rests = np.flatnonzero(straight.to_s == np.inf)
    moments = np.setdiff1d(np.arange(len(particle)), np.concatenate([moves, moves + 1, rests]))
    places = np.concatenate([moves, rests, moments])
    motion = Motion(
        from_s=straight.from_s[places],
        to_s=straight.to_s[places],
        x_m=straight.x_m[places],
        y_m=straight.y_m[places],
        vx_mps=straight.vx_mps[places],
        vy_mps=straight.vy_mps[places],
    )
    return Pieces(motion, particle[places].astype(np.int64))


def joined(pieces: Pieces) -> Pieces:
    """Return pieces of which none goes on from the one before at the same velocity."""
    motion, particle = pieces
    same = (particle, motion.vx_mps, motion.vy_mps)
    goes_on = np.all([column[1:] == column[:-1] for column in same], axis=0)
    goes_on &= motion.from_s[1:] == motion.to_s[:-1]
    first = np.flatnonzero(np.append(True, ~goes_on)[: len(particle)])
    last = np.append(first[1:], len(particle))[: len(first)] - 1
    whole = Motion(*(column[first] for column in motion))._replace(to_s=motion.to_s[last])
    return Pieces(whole, particle[first])
