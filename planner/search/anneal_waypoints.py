"""Free movement: simulated annealing of waypoints that need not lie on roads.

The UAV may turn in the middle of a road, hover, and fly anywhere. The search starts from a road
plan and changes one thing at a time: it shifts, inserts, removes, exchanges or delays waypoints,
or flies to meet a particle earlier. A change that makes the plan worse is taken with a chance that
falls as the search cools.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner.arrays import Floats
from planner.detection.evaluation import evaluate
from planner.detection.first_detection import columns
from planner.flight.plan import ROUNDING_S, Plan
from planner.progress import silent
from planner.search.beam import beam, holdout_value
from planner.search.patrol import patrol
from planner.search.plan import needs_open_country, plan_of_waypoints
from planner.search.problem import Budget, Problem
from planner.search.result import SearchLog, SearchResult
from planner.search.what_if import WhatIf

DRAWS = 9  # uniform numbers per move
ROUND = 200  # moves between two looks at the clock
MOVE = 150  # units of work that a move takes, about
SHARES_HUNTED = (1.0, 0.999, 0.995, 0.99)  # of its particles, before a patrol begins
MARGIN = 2e-3  # share of what the start fails to earn by which a move may be misjudged early


@dataclass(frozen=True)
class Annealing:
    """How waypoints are annealed."""

    moves: int | None = None  # how many changes are tried; None: what the budget's work buys
    heat: float = 4e-4  # temperature at first: this share of what the start fails to earn
    cold: float = 2e-5  # temperature at last


def anneal_waypoints(
    problem: Problem,
    *,
    budget: Budget,
    rng: np.random.Generator,
    annealing: Annealing | None = None,
    start: Floats | None = None,
) -> SearchResult:
    """Return the best plan of waypoints found by annealing.

    Its last part, which hunts for the last few of its own particles, may give way to a patrol
    along roads, whichever does better on the holdout particles. On them, or on the problem's own
    if there are none, the plan is never worse than its start.

    Parameters
    ----------
    budget
        ``stop`` is asked between rounds of moves, ``on_progress`` called after each.
    start
        Waypoints, (W, 3): x and y in metres, and how long to hover there in seconds. By default
        those of the road plan of a beam search.

    Raises
    ------
    NotApplicableError
        If the sensor only looks along roads.
    """
    needs_open_country(problem, "anneal-waypoints")
    rules, log = annealing or Annealing(), SearchLog(problem, budget)
    start = road_waypoints(problem, budget) if start is None else start
    known = Known.of(problem, start)
    lacks, many = known.lacks, rules.moves or max(1, budget.work // MOVE)
    for done in range(0, many, ROUND):
        if log.stop():
            break
        moves = np.arange(done, min(done + ROUND, many))
        heat = rules.heat * (rules.cold / rules.heat) ** (moves / many)
        known.anneal(rng.random((len(moves), DRAWS)), lacks * heat)
        log.reached(known.best_reward, MOVE * (done + len(moves)))
    flights = [with_patrol(problem, known.best, share) for share in SHARES_HUNTED]
    plans = [plan_of_waypoints(problem, "anneal-waypoints", way) for way in (*flights, start)]
    return log.result(max(plans, key=lambda plan: holdout_value(problem, plan)))


class Known:
    """A flight over waypoints, whom it sees, and the best way met so far while it is annealed."""

    def __init__(self, problem: Problem, room: int) -> None:
        from planner.search.kernels.anneal import UNSEEN

        particles = len(problem.futures)
        self._world = _world(problem)
        self._scale = _scale(problem)
        self._most = float(problem.weight_at_start.sum()) * problem.objective.most
        self._now, self._trial = (
            (np.zeros((3, room)), np.zeros((4, room)), (np.zeros(particles, np.int32), found_at))
            for found_at in np.zeros((2, particles))
        )
        self._best = np.zeros((3, room))
        self._books = (np.full(particles, UNSEEN), np.full(particles, -1), np.zeros(3, np.int64))
        self._many, self._margin = 1, 0.0
        self.reward = self.best_reward = 0.0

    @classmethod
    def of(cls, problem: Problem, waypoints: Floats) -> "Known":
        """Return the flight over given waypoints, (W, 3)."""
        from planner.search.kernels.waypoints import LEFT, SEEN, sweep

        known, uav = cls(problem, 2 * len(waypoints) + 64), problem.uav_at_start
        way, marks, found = known._now
        place, met, counts = known._books
        many = known._many = len(waypoints) + 1
        way[:2, 0], way[:, 1:many], marks[LEFT, 0] = (uav.x_m, uav.y_m), waypoints.T, uav.take_off_s
        reward = sweep(
            (way, many, 1),
            (marks, found, (place, met, 0, 0)),
            known._world,
            (-np.inf, 0.0, marks, many),
        )
        seen = int(marks[SEEN, many - 1])
        place[found[0][:seen]] = np.arange(seen)
        known._best[:], counts[1] = way, many
        known.reward = known.best_reward = float(reward)
        known._margin = MARGIN * known.lacks
        return known

    def anneal(self, draws: Floats, heat: Floats) -> None:
        """Try one move per row of uniform draws, (M, DRAWS), at temperatures, (M,) reward."""
        from planner.search.kernels.anneal import anneal

        flights = (self._now, self._trial, self._best)
        rules = (heat, self._margin, self._scale)
        self._many, self.reward, self.best_reward = anneal(
            (self._many, self.best_reward), flights, self._books, self._world, draws, rules
        )

    @property
    def lacks(self) -> float:
        """What the best flight fails to earn of all the reward there could be."""
        return self._most - self.best_reward

    @property
    def waypoints(self) -> Floats:
        """Where the flight goes after take-off, (W, 3)."""
        return self._now[0][:, 1 : self._many].T.copy()

    @property
    def best(self) -> Floats:
        """The same of the best flight so far, (W, 3)."""
        return self._best[:, 1 : self._books[2][1]].T.copy()

    @property
    def taken(self) -> int:
        """How many moves have been taken."""
        return int(self._books[2][2])

    @property
    def seen_at(self) -> Floats:
        """When each particle is seen, (N,) seconds, infinity: not while it counts."""
        place, (_, found_at) = self._books[0], self._now[2]
        return np.where(place < len(place), found_at[np.minimum(place, len(place) - 1)], np.inf)


def road_waypoints(problem: Problem, budget: Budget) -> Floats:
    """Return the waypoints of a beam's road plan, (W, 3): x, y, seconds of hovering."""
    tenth = replace(budget, work=budget.work // 10, on_progress=silent)
    found = beam(problem, budget=tenth, rng=np.random.default_rng(0))
    return waypoints_of(problem, found.plan)


def waypoints_of(problem: Problem, plan: Plan) -> Floats:
    """Return where a plan's UAV goes after its start, (W, 3): x, y, seconds of hovering there.

    What it flies more slowly than it could becomes flight at full speed, and hovering.
    """
    (track,) = plan.tracks
    flies_s = np.hypot(np.diff(track.x_m), np.diff(track.y_m)) / problem.uav.speed_mps
    waits_s = np.diff(track.time_s) - flies_s
    waits_s[waits_s < ROUNDING_S] = 0.0
    kept = (flies_s > 0.0) | (waits_s > 0.0)
    return np.stack([track.x_m[1:], track.y_m[1:], waits_s], axis=1)[kept]


def with_patrol(problem: Problem, waypoints: Floats, share: float) -> Floats:
    """Return waypoints that go on along roads, as ``tail`` does, once a share of all is seen.

    Of all particles that they see, by weight.
    """
    plan = plan_of_waypoints(problem, "", waypoints)
    seen_at = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective).seen_at
    by_time = np.argsort(seen_at, kind="stable")
    weight = np.cumsum(np.where(np.isfinite(seen_at), problem.weight_at_start, 0.0)[by_time])
    enough = min(int(np.searchsorted(weight, share * weight[-1])), len(weight) - 1)
    leaves_s = times_left(problem, waypoints)
    useful = int(np.searchsorted(leaves_s, seen_at[by_time[enough]]))
    if useful >= len(waypoints) or leaves_s[useful] >= problem.horizon_s:
        return waypoints
    legs, left_s, (x_m, y_m, _) = problem.legs, float(leaves_s[useful]), waypoints[useful].tolist()
    begun = replace(problem.first_state, time_s=left_s, x_m=x_m, y_m=y_m)
    state = begun.absorb(np.where(seen_at <= left_s, seen_at, np.inf))
    order = patrol(WhatIf(problem), state).order
    along = [np.arange(legs.first_point[leg], legs.first_point[leg + 1]) for leg in order]
    points = np.concatenate([np.empty(0, dtype=int), *along])
    roads = np.stack([legs.x_m[points], legs.y_m[points], np.zeros(len(points))], axis=1)
    return np.vstack([waypoints[: useful + 1], roads])


def times_left(problem: Problem, waypoints: Floats) -> Floats:
    """Return when each waypoint is left, (W,) seconds, if there were no end to the flight."""
    uav = problem.uav_at_start
    places = np.vstack([[uav.x_m, uav.y_m], waypoints[:, :2]])
    flies_s = np.hypot(*np.diff(places, axis=0).T) / uav.speed_mps
    return np.asarray(uav.take_off_s + np.cumsum(flies_s + waypoints[:, 2]))


def _world(problem: Problem) -> Any:
    """Return what a sweep has to know, as ``kernels.anneal.World``."""
    from planner.search.kernels.cells import crowd_of
    from planner.search.kernels.motion import fastest

    uav, futures, objective = problem.uav_at_start, columns(problem.futures), problem.objective
    radius_m = float(problem.sensor.radius_m)
    span = (float(uav.take_off_s), float(objective.ends_s))
    crowd = crowd_of(futures, radius_m, float(fastest(futures)), span)
    home = (np.inf, np.inf) if uav.return_to_m is None else uav.return_to_m
    limits = (*map(float, home), float(uav.landing_s), span[1], float(uav.speed_mps))
    by_s = np.inf if objective.by_s is None else float(objective.by_s)
    return crowd, radius_m, problem.weight_at_start, limits, (float(objective.horizon_s), by_s)


def _scale(problem: Problem) -> tuple[float, float]:
    """Return how far waypoints may be shifted at once, metres, and be delayed, seconds."""
    far_m = float(np.hypot(*np.ptp(problem.network.node_xy_m, axis=0))) / 5.0
    return far_m, far_m / problem.uav.speed_mps
