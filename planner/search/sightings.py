"""When a flight sees how much, and what that brings: what searches learn from a flight."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats
from planner.detection.evaluate import evaluate, evaluate_all
from planner.detection.kernels.worth import judged_contacts
from planner.detection.survival import Searched, contacts_of_all
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.search.problem import Problem
from planner.search.what_if import goal_of


class Seen(NamedTuple):
    """What flights see, sighting by sighting; what they do not see comes with time infinity."""

    time_s: Floats  # (M,) seconds, expected
    weight: Floats  # (M,) probability of the target being seen just then
    reward: Floats  # (M,) what that is worth, expected

    def brings(self, times_s: Floats) -> Floats:
        """Return the reward per unit of unseen weight that comes after each time, (T,)."""
        by_time = np.argsort(self.time_s, kind="stable")
        after = np.searchsorted(self.time_s[by_time], times_s, side="right")
        left, brings = (
            np.append(np.cumsum(amount[by_time][::-1])[::-1], 0.0)[after]
            for amount in (self.weight, self.reward)
        )
        share: Floats = np.divide(brings, left, out=np.zeros(len(times_s)), where=left > 0.0)
        return share


def seen_by(problem: Problem, tracks: Sequence[Track], futures: Futures, weight: Floats) -> Seen:
    """Return what flights see together of particles, beside the problem's flights of others.

    Parameters
    ----------
    weight
        How probably the target is each of them, and unseen as the flights begin, (N,).
    """
    sensor, objective = problem.sensor, problem.objective
    if sensor.is_perfect and not problem.flown:
        seen_at = evaluate(tracks, futures, sensor, objective).seen_at
        return Seen(seen_at, weight, weight * objective.reward(seen_at))
    met, rates = contacts_of_all(futures, [Searched(track, sensor) for track in tracks])
    time_s, share, worth, left = judged_contacts(met, rates, goal_of(problem, futures))
    each = np.repeat(weight, np.diff(met.first))
    never = np.full(len(weight), np.inf)
    return Seen(
        np.concatenate([time_s, never]),
        np.concatenate([each * share, weight * left]),
        np.concatenate([each * worth, np.zeros(len(weight))]),
    )


def earned(problem: Problem, plan: Plan, futures: Futures, weight: Floats) -> float:
    """Return the expected reward of a plan, and of the flights of others that are decided.

    Parameters
    ----------
    futures, weight
        As `seen_by` has them.
    """
    own = [Searched(track, problem.sensor) for track in plan.tracks]
    return float(weight @ evaluate_all([*problem.flown, *own], futures, problem.objective).reward)


def holdout_value(problem: Problem, plan: Plan) -> float:
    """Return a plan's expected reward on the holdout particles, or on its own if there are none."""
    holdout = problem.holdout or problem.futures
    return earned(problem, plan, holdout, holdout.weight)
