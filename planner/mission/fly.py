"""A plan meets the truth: each target is found or not, when, where and on which leg."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Frozen, Ints, freeze
from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.detection.first_detection import first_detection
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.futures.futures import Futures


@dataclass(frozen=True, eq=False)
class MissionRecord(Frozen):
    """One flight per true target."""

    evaluation: Evaluation  # when each is found; failure counts as the horizon
    xy_m: Floats  # (N, 2) metres, where the target is when found; NaN if it is not
    leg: Ints  # (N,) the leg flown, or flown to, when found, from 1; 0: none, or not found
    finder: Ints  # (N,) which of the plan's flights finds it; it says nothing of who is not found
    names: tuple[str, ...]  # of the plan's flights

    def __post_init__(self) -> None:
        freeze(self, xy_m=np.float64, leg=np.int32, finder=np.int32)


def fly(plan: Plan, truth: Futures, sensor: Sensor, objective: Objective) -> MissionRecord:
    """Return what happens when a plan is flown against true targets, each on its own.

    Parameters
    ----------
    truth
        The motion of one or more true targets.
    """
    evaluation = evaluate(plan.tracks, truth, sensor, objective)
    finder = _finders(plan.tracks, truth, sensor, evaluation)
    found = np.flatnonzero(evaluation.found)
    xy_m = np.full((len(truth), 2), np.nan)
    leg = np.zeros(len(truth), dtype=np.int32)
    for k in found.tolist():
        seen_s = evaluation.seen_at[k]
        xy_m[k] = truth.xy(k, seen_s)
        ends = [flown.end_s for flown in plan.legs[finder[k]]]
        number = int(np.searchsorted(ends, seen_s)) + 1
        leg[k] = number if number <= len(ends) else 0
    return MissionRecord(evaluation, xy_m, leg, finder, plan.names)


def _finders(
    tracks: Sequence[Track], truth: Futures, sensor: Sensor, evaluation: Evaluation
) -> Ints:
    """Return which flight finds each target, (N,): with a sensor that may miss, who has it then."""
    if len(tracks) == 1:
        return np.zeros(len(truth), dtype=np.int64)
    if sensor.is_perfect:
        seen = np.array([first_detection(truth, track, sensor.radius_m) for track in tracks])
        return np.asarray(seen.argmin(axis=0))
    at_s = np.where(evaluation.found, evaluation.seen_at, 0.0)
    there = np.array([truth.xy(k, time_s) for k, time_s in enumerate(at_s.tolist())])
    away_m = [np.hypot(*(track.xy(at_s) - there).T) for track in tracks]
    return np.asarray(np.nan_to_num(away_m, nan=np.inf).argmin(axis=0))
