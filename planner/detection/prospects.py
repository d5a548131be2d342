"""What any flight has to reckon with: targets leave the map, and some are out of reach."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Flags
from planner.detection.chase import chased_by_any
from planner.detection.evaluation import Evaluation
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.futures.futures import Futures

MOMENTS_S = (300.0, 600.0, 1200.0)  # at which the share that has left is told
MUCH = 0.1  # of the targets; if more leave, the net is too small to judge a search by


@dataclass(frozen=True, eq=False)
class Prospects:
    """How many targets have left the map by when, and how many a flight can find at most."""

    gone_by: tuple[tuple[float, float], ...]  # seconds on the target's clock, probability
    gone: float  # probability of having left by the horizon; of several targets their mean
    ceiling: Evaluation  # each target chased alone: what no flight surpasses

    @property
    def many_leave(self) -> bool:
        """Whether so many leave that a larger net would give another answer."""
        return self.gone > MUCH


def prospects(
    futures: Futures, uavs: Sequence[Uav], sensor: Sensor, objective: Objective
) -> Prospects:
    """Return what any flight of one UAV or several has to reckon with on given futures."""
    horizon_s = objective.horizon_s
    moments_s = [moment_s for moment_s in MOMENTS_S if moment_s < horizon_s]
    seen_at, many = chased_by_any(futures, uavs, sensor), objective.sought
    chased = Evaluation(seen_at, futures.weight, futures.end_s, objective)
    return Prospects(
        gone_by=tuple((moment_s, gone_by(futures, moment_s) / many) for moment_s in moments_s),
        gone=gone_by(futures, horizon_s) / many,
        ceiling=chased if many == 1 else replace(chased, target=futures.target),
    )


def gone_by(futures: Futures, time_s: float) -> float:
    """Return the probability that the target was there and has left the map before a time.

    Recorded motion ends at the horizon: who is still there then has not left.
    """
    return float(futures.weight @ _left(futures, time_s))


def left_unseen(futures: Futures, evaluated: Evaluation, time_s: float) -> float:
    """Return the probability that the target has left the map before a time, and unseen."""
    if evaluated.survival is not None:
        unseen = evaluated.survival.at(futures.end_s)
    else:
        unseen = (evaluated.seen_at > futures.end_s).astype(np.float64)
    return float(futures.weight @ (_left(futures, time_s) * unseen))


def _left(futures: Futures, time_s: float) -> Flags:
    return np.asarray(futures.gone & (futures.end_s < time_s) & (futures.end_s > -np.inf))
