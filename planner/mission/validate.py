"""Does a cloud of particles cover true vehicles as often as it says? Judged run by run.

Vehicles of one run of the traffic, or of one day, meet the same queues. What is independent, and so
what intervals are over, is the realisation.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.errors import InputError
from planner.futures.futures import Futures
from planner.futures.pooled import pooled
from planner.intervals import means_of_runs, student_point
from planner.streams import stream

COVERED = 0.9  # of what is true, by what is believed
SHARES = (1 / 8, 1 / 4, 1 / 2, 1.0)  # of the horizon, at which it is looked
CHANCE = 0.05  # that any of the checks is off where nothing is
ALIKE_M = 0.01  # those whose ways differ by less are as far as each other
FEWEST = 20  # realisations of truths, for an interval worth having


class Effect(NamedTuple):
    """How far something is off on average over realisations."""

    off: float
    half: float  # of the width of its interval: the smallest that would have been seen


class Check(NamedTuple):
    """What is found at one time of one measure."""

    measure: str  # "driven" along the way since time 0, or "away" from where particles start
    time_s: float
    covered: float  # share of the truths that are within the cloud's middle 90 %
    coverage: Effect  # off 90 %
    ratio: Effect | None  # of the truths' mean to the cloud's, off 1; None where some have left

    @property
    def is_off(self) -> bool:
        """Whether the cloud covers more or less than it says, beyond chance."""
        return abs(self.coverage.off) > self.coverage.half


@dataclass(frozen=True)
class Validation:
    """All checks of a cloud against truths."""

    particles: int
    particle_runs: int  # realisations that they ride in; 0: in none
    truths: int
    truth_runs: int
    checks: tuple[Check, ...]

    @property
    def is_off(self) -> bool:
        """Whether the belief is wrong, as far as these truths can tell."""
        return any(check.is_off for check in self.checks)

    @property
    def smallest_seen(self) -> float:
        """By how much a cloud has to cover less, or more, than it says for so many runs to see it.

        At the check that sees best, as a share of all truths.
        """
        return min(check.coverage.half for check in self.checks)

    @property
    def can_show(self) -> bool:
        """Whether so many runs could have shown anything: a cloud that covers no truth at all."""
        return self.smallest_seen < COVERED


def validated(
    cloud: Futures, truths: Futures, run: Ints, horizon_s: float, *, seed: int
) -> Validation:
    """Return how a cloud of particles covers truths.

    A truth's rank among the particles is uniform if it is one of them; ties, as of those that have
    left, are broken by chance. Intervals are over the truths' realisations and, by leaving out one
    after the other, over the particles'; they hold for all checks at once.

    Parameters
    ----------
    run
        The realisation, or the day, of each truth, (T,).

    Raises
    ------
    InputError
        If truths are of one run only, or ride where particles have been.
    """
    runs = np.unique(run)
    if len(runs) < 2:
        raise InputError(
            f"truths: are of one run only; give at least two, better {FEWEST}: vehicles of one run "
            "meet the same queues"
        )
    refuse_seen(cloud, truths)
    rng = stream(seed, "ties")
    looks = [(measure, share * horizon_s) for measure in ("driven", "away") for share in SHARES]
    judge = _Judge(cloud, truths, run, CHANCE / len(looks))
    return Validation(
        particles=len(cloud),
        particle_runs=0 if cloud.fates is None else len(np.unique(cloud.fates.realisation)),
        truths=len(truths),
        truth_runs=len(runs),
        checks=tuple(judge.check(measure, at_s, rng) for measure, at_s in looks),
    )


def refuse_seen(cloud: Futures, truths: Futures) -> None:
    """Raise InputError if truths ride in realisations that particles have ridden in.

    A cloud that has met the very queues of a truth covers it far better than one that has not.
    """
    if cloud.fates is None or truths.fates is None:
        return
    both = np.intersect1d(cloud.fates.realisation, truths.fates.realisation)
    if len(both):
        raise InputError(
            f"truths: ride in realisation {', '.join(map(str, both))} of the traffic, as particles "
            "do; what is found there is no forecast: take truths of others"
        )


@dataclass(frozen=True)
class _Judge:
    """A cloud, truths, and what is judged of them."""

    cloud: Futures
    truths: Futures
    run: Ints
    chance: float

    def check(self, measure: str, time_s: float, rng: np.random.Generator) -> Check:
        """Compare the cloud and the truths at a time."""
        start_xy_m = _middle(self.cloud)
        believed, true = (
            futures.driven_m(time_s)
            if measure == "driven"
            else _away_m(futures, time_s, start_xy_m)
            for futures in (self.cloud, self.truths)
        )
        chance = rng.random(len(true))
        covered = self._covered(believed, self.cloud.weight, true, chance)
        by_run = means_of_runs(covered, self.run)
        without = []
        for some in self._without_one():
            fewer = self._covered(believed[some], self.cloud.weight[some], true, chance)
            without.append(float(means_of_runs(fewer, self.run).mean()))
        independent = np.sqrt(COVERED * (1 - COVERED) / len(true))
        coverage = self._effect(by_run, COVERED, without, least=float(independent))
        return Check(measure, time_s, float(by_run.mean()), coverage, self._ratio(believed, true))

    def _ratio(self, believed: Floats, true: Floats) -> Effect | None:
        """Return by how much the truths' mean is more than the cloud's, as a share."""
        if not (np.isfinite(believed).all() and np.isfinite(true).all()):
            return None
        weight = self.cloud.weight
        mean_m = np.average(believed, weights=weight)
        if mean_m <= 0.0:
            return None
        by_run = means_of_runs(true, self.run) / mean_m
        without = [
            by_run.mean() * mean_m / np.average(believed[some], weights=weight[some])
            for some in self._without_one()
        ]
        cloud_error = np.std(believed, ddof=1) / mean_m / np.sqrt(len(believed))
        least = np.hypot(cloud_error, np.std(true, ddof=1) / mean_m / np.sqrt(len(true)))
        return self._effect(by_run, 1.0, without, least=float(least))

    def _effect(
        self, by_run: Floats, expected: float, without: Sequence[float], *, least: float
    ) -> Effect:
        """Return how far the mean over runs is off, and half the width of its interval.

        Parameters
        ----------
        without
            The same mean once each of the cloud's realisations is left out: its jackknife.
        least
            The standard error of as many vehicles that do not meet: runs are never more alike.
        """
        runs, left = len(by_run), np.array(without)
        of_truths = max(float(np.var(by_run, ddof=1)) / runs, least**2)
        of_cloud = (len(left) - 1) * float(np.var(left)) if len(left) else 0.0
        error = of_truths + of_cloud
        # Welch's and Satterthwaite's, for the sum of two variances that are estimated.
        freedom = error**2 / (of_truths**2 / (runs - 1) + of_cloud**2 / max(1, len(left) - 1))
        half = student_point(freedom, self.chance) * np.sqrt(error)
        return Effect(float(by_run.mean()) - expected, float(half))

    def _covered(self, believed: Floats, weight: Floats, true: Floats, chance: Floats) -> Floats:
        """Return which truths are within the middle of the cloud, (T,), 1.0 or 0.0."""
        order = np.argsort(believed, kind="stable")
        below = np.concatenate(([0.0], np.cumsum(weight[order])))
        at = np.searchsorted(believed[order], true - ALIKE_M)
        # To the right: all that have left are at infinity, from where no step leads past them.
        upto = np.searchsorted(believed[order], true + ALIKE_M, side="right")
        # One more vehicle, the truth itself, is as likely as any of the particles.
        own = below[-1] / len(believed)
        rank = (below[at] + chance * (below[upto] - below[at] + own)) / (below[-1] + own)
        return np.asarray(np.abs(rank - 0.5) <= COVERED / 2, dtype=np.float64)

    def _without_one(self) -> list[Ints]:
        """Return the particles without those of one realisation, for each of these in turn."""
        if self.cloud.fates is None:
            return []
        realisation = self.cloud.fates.realisation
        numbers = np.unique(realisation)
        return [np.flatnonzero(realisation != n) for n in numbers] if len(numbers) > 1 else []


def _middle(cloud: Futures) -> Floats:
    """Return the mean place where particles start, (2,) metres."""
    first = cloud.first_knot[:-1][np.diff(cloud.first_knot) > 0]
    return np.array([cloud.x_m[first].mean(), cloud.y_m[first].mean()])


def _away_m(futures: Futures, time_s: float, xy_m: Floats) -> Floats:
    """Return how far each particle is from a place, (N,) metres; infinity if it has left."""
    away_m = np.hypot(*(futures.positions(time_s) - xy_m).T)
    return np.where(np.isnan(away_m), np.inf, away_m)


def together_by_day(days: Sequence[Futures]) -> tuple[Futures, Ints]:
    """Return the vehicles of several days as one set, and the day of each."""
    day = np.repeat(np.arange(len(days)), [len(some) for some in days])
    return pooled(days), day
