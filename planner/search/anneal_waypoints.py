"""Free movement: simulated annealing of waypoints that need not lie on roads.

The UAV may turn in the middle of a road, hover, and fly anywhere. The search starts from a road
plan and changes one thing at a time: it shifts, inserts, removes, exchanges or delays waypoints,
or flies to meet a particle earlier. A change that makes the plan worse is taken with a chance that
falls as the search cools.
"""

from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Floats
from planner.detection.evaluate import evaluate
from planner.flight.drawn_line import stops_of
from planner.flight.legs import unit
from planner.flight.plan import ROUNDING_S, Plan
from planner.progress import silent
from planner.search.beam import beam
from planner.search.kernels.anneal import (
    BEST_MANY,
    TAKEN,
    UNSEEN,
    Flights,
    Memory,
    Rules,
    Scale,
    Standing,
    anneal,
)
from planner.search.kernels.waypoints import (
    LEFT,
    SEEN,
    Bar,
    Change,
    FirstSightings,
    Unseen,
    WaypointFlight,
    sweep,
)
from planner.search.patrol import patrol
from planner.search.plan import needs_open_country, plan_of_waypoints
from planner.search.problem import Budget, Problem
from planner.search.result import SearchLog, SearchResult
from planner.search.sightings import holdout_value
from planner.search.waypoint_rewards import surroundings
from planner.search.what_if import WhatIf

DRAWS = 9  # uniform numbers per move
ROUND = 200  # moves between two looks at the clock
MOVE = 150  # units of work that a move takes, about
SHARES_HUNTED = (
    1.0,
    0.999,
    0.995,
    0.99,
)  # of its particles, before a patrol; tuned on grid5x5 alone
NEARLY_ALL = 0.9  # of the particles: a plan that sees fewer hunts for no last few
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

    Its last part, which hunts for the last few of its own particles, may be replaced by a patrol
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
    known = AnnealedFlight.of(problem, start)
    lacks, many = known.lacks, rules.moves or max(1, budget.work // MOVE)
    for done in range(0, many, ROUND):
        if log.stop():
            break
        moves = np.arange(done, min(done + ROUND, many))
        heat = rules.heat * (rules.cold / rules.heat) ** (moves / many)
        known.anneal(rng.random((len(moves), DRAWS)), lacks * heat)
        log.reached(known.best_reward, MOVE * (done + len(moves)))
    flights = (known.best, *with_patrols(problem, known.best), start)
    plans = [plan_of_waypoints(problem, "anneal-waypoints", way) for way in flights]
    return log.result(max(plans, key=lambda plan: holdout_value(problem, plan)))


class AnnealedFlight:
    """A flight over waypoints, what it sees, and the best way found so far while it is annealed."""

    def __init__(self, problem: Problem, room: int) -> None:
        particles = len(problem.futures)
        self._around = surroundings(problem)
        self._scale = _scale(problem)
        self._most = float(problem.weight_at_start.sum()) * problem.objective.most
        self._flights = Flights(
            _empty_flight(room, particles), _empty_flight(room, particles), np.zeros((3, room))
        )
        self._memory = Memory(
            np.full(particles, UNSEEN), np.full(particles, -1), np.zeros(3, np.int64)
        )
        self._standing = Standing(1, 0.0, 0.0)
        self._margin = 0.0

    @classmethod
    def of(cls, problem: Problem, waypoints: Floats) -> "AnnealedFlight":
        """Return the flight over given waypoints, (W, 3)."""
        flown, uav = cls(problem, 2 * len(waypoints) + 64), problem.uav_at_start
        flight, many = flown._flights.known, len(waypoints) + 1
        rank, last_round, counts = flown._memory
        flight.way[:2, 0], flight.way[:, 1:many] = (uav.x_m, uav.y_m), waypoints.T
        flight.marks[LEFT, 0] = uav.take_off_s
        everyone, no_bar = Unseen(rank, last_round, 0, 0), Bar(-np.inf, 0.0, flight.marks, many)
        reward = float(sweep(flight, Change(many, 1), everyone, flown._around, no_bar))
        seen = int(flight.marks[SEEN, many - 1])
        rank[flight.found.particle[:seen]] = np.arange(seen)
        flown._flights.best_way[:], counts[BEST_MANY] = flight.way, many
        flown._standing = Standing(many, reward, reward)
        flown._margin = MARGIN * flown.lacks
        return flown

    def anneal(self, draws: Floats, heat: Floats) -> None:
        """Try one move per row of uniform draws, (M, DRAWS), at temperatures, (M,) reward."""
        rules = Rules(heat, self._margin, self._scale)
        self._standing = anneal(
            self._standing, self._flights, self._memory, self._around, draws, rules
        )

    @property
    def reward(self) -> float:
        """The expected reward of the flight."""
        return float(self._standing.reward)

    @property
    def best_reward(self) -> float:
        """The same of the best flight so far."""
        return float(self._standing.best_reward)

    @property
    def lacks(self) -> float:
        """What the best flight fails to earn of all the reward there could be."""
        return self._most - self.best_reward

    @property
    def waypoints(self) -> Floats:
        """Where the flight goes after take-off, (W, 3)."""
        return self._flights.known.way[:, 1 : self._standing.many].T.copy()

    @property
    def best(self) -> Floats:
        """The same of the best flight so far, (W, 3)."""
        return self._flights.best_way[:, 1 : self._memory.counts[BEST_MANY]].T.copy()

    @property
    def taken(self) -> int:
        """How many moves have been taken."""
        return int(self._memory.counts[TAKEN])

    @property
    def seen_at(self) -> Floats:
        """When each particle is seen, (N,) seconds, infinity: not while it counts."""
        rank, seen_at = self._memory.rank, self._flights.known.found.seen_at
        return np.where(rank < len(rank), seen_at[np.minimum(rank, len(rank) - 1)], np.inf)


def _empty_flight(room: int, particles: int) -> WaypointFlight:
    found = FirstSightings(np.zeros(particles, np.int32), np.zeros(particles))
    return WaypointFlight(np.zeros((3, room)), np.zeros((4, room)), found)


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
    if problem.uav.aircraft is not None:
        lands = problem.uav.return_to_m is not None
        return stops_of(track, problem.legs.law, lands=lands)
    flies_s = np.hypot(np.diff(track.x_m), np.diff(track.y_m)) / problem.uav.speed_mps
    waits_s = np.diff(track.time_s) - flies_s
    waits_s[waits_s < ROUNDING_S] = 0.0
    kept = (flies_s > 0.0) | (waits_s > 0.0)
    return np.stack([track.x_m[1:], track.y_m[1:], waits_s], axis=1)[kept]


def with_patrols(problem: Problem, waypoints: Floats) -> list[Floats]:
    """Return waypoints that turn into a patrol after different shares of what they see.

    None if they see little: what is left is not a few targets to be hunted.
    """
    plan = plan_of_waypoints(problem, "", waypoints)
    seen_at = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective).seen_at
    seen = float(problem.weight_at_start[np.isfinite(seen_at)].sum())
    if seen < NEARLY_ALL * problem.weight_at_start.sum():
        return []
    return [with_patrol(problem, waypoints, share) for share in SHARES_HUNTED]


def with_patrol(problem: Problem, waypoints: Floats, share: float) -> Floats:
    """Return waypoints that turn into a patrol along roads once enough has been seen.

    Parameters
    ----------
    share
        How much is enough, of the weight of all particles that the waypoints see.
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
    uav, law = problem.uav_at_start, problem.legs.law
    offset = np.diff(np.vstack([[uav.x_m, uav.y_m], waypoints[:, :2]]), axis=0)
    ways = unit(offset)
    rest, before = np.zeros_like(ways), np.vstack([np.zeros((1, 2)), ways[:-1]])
    stops_s = law.corner_loss_s(before, rest) + law.corner_loss_s(rest, ways)
    hovers = np.append(False, waypoints[:-1, 2] > 0.0)
    lost_s = np.where(hovers, stops_s, law.corner_loss_s(before, ways))
    flies_s = np.hypot(*offset.T) / uav.speed_mps
    return np.asarray(uav.take_off_s + np.cumsum(flies_s + lost_s + waypoints[:, 2]))


def _scale(problem: Problem) -> Scale:
    """Return how far waypoints may be shifted at once, metres, and be delayed, seconds."""
    far_m = float(np.hypot(*np.ptp(problem.network.node_xy_m, axis=0))) / 5.0
    return Scale(far_m, far_m / problem.uav.speed_mps)
