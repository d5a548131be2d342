"""What the odds of a plan hang on, read off the targets that it was evaluated on: worth asking."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from planner import compass
from planner.arrays import Flags, Floats, Ints
from planner.futures.futures import Futures
from planner.mission.now_events import Condition, FirstPlan, Unknown

WENT_S = 60.0  # after which it shows which way a target went, and how fast
STANDS_M = 5.0  # in that time: it does not drive
FEWEST = 20  # targets of which odds are told
KMH = 3.6  # of a metre a second
ROUND_KMH = 5  # to which speeds are told
QUARTERS = [compass.words(90.0 * k, 4) for k in range(4)]


def unknowns(made: FirstPlan) -> tuple[Unknown, ...]:
    """Return what would change the odds of a plan by more than chance, the most first.

    Nothing new is simulated: the plan's own fresh targets are told apart by what they did.
    """
    found = [one for one in every_unknown(made) if _matters(one)]
    return tuple(sorted(found, key=lambda one: -_spread(one)))


def every_unknown(made: FirstPlan) -> Iterator[Unknown]:
    """Yield all that is looked at, with the answers that enough targets give."""
    fresh, start = made.fresh.futures, made.call.tables["target"]["start"]
    answers = partial(_answers, made)
    drives = _Drives(fresh)
    if not (isinstance(start, dict) and "heading_deg" in start):
        yield Unknown("which way it went", "--heading", answers(QUARTERS, drives.quarter))
    yield Unknown("how fast it drove", "--target", answers(*_thirds(drives)))
    away_m = drives.start_m - np.nanmean(drives.start_m, axis=0)
    yield Unknown(
        "on which side of the place it was", "--last-seen", answers(QUARTERS, _quarter(away_m))
    )
    take_off_s = float(made.opened.scenario.take_off_s)
    moved_m = fresh.positions(take_off_s) - fresh.positions(max(0.0, take_off_s - WENT_S))
    stands = _group(np.hypot(*moved_m.T) <= STANDS_M, np.isfinite(moved_m[:, 0]))
    yield Unknown(
        "whether it stands by take-off", "--target", answers(("drives", "stands"), stands)
    )


class _Drives:
    """How targets began to drive, (N,) each; NaN for those that never were there."""

    def __init__(self, futures: Futures) -> None:
        some = np.diff(futures.first_knot) > 0
        first = futures.first_knot[:-1][some]
        began_s = np.full(len(futures), np.nan)
        began_s[some] = futures.time_s[first]
        self.start_m = np.full((len(futures), 2), np.nan)
        self.start_m[some] = np.stack([futures.x_m[first], futures.y_m[first]], axis=1)
        ends_s = np.fmin(began_s + WENT_S, futures.end_s)
        step_m = futures.positions(ends_s) - self.start_m
        away_m = np.hypot(*step_m.T)
        self.moves = away_m > STANDS_M  # False for NaN
        self.quarter = np.where(self.moves, _quarter(step_m), -1)
        lasts_s = np.where(ends_s > began_s, ends_s - began_s, 1.0)
        self.speed_mps = futures.driven_m(ends_s) / lasts_s


def _quarter(step_m: Floats) -> Ints:
    """Return the quarter of the compass to which steps, (N, 2) metres, lead; -1: to none."""
    bearing_deg = np.degrees(np.arctan2(step_m[:, 0], step_m[:, 1]))
    quarter = np.round(np.nan_to_num(bearing_deg) / 90.0).astype(int) % len(QUARTERS)
    return np.where(np.hypot(*step_m.T) > 0.0, quarter, -1)


def _thirds(drives: _Drives) -> tuple[Sequence[str], Ints]:
    """Return names of a slow, a middle and a fast third of those that drive, and each one's."""
    speed_kmh = KMH * drives.speed_mps
    if not drives.moves.any():
        return (), np.full(len(speed_kmh), -1)
    ends = np.quantile(speed_kmh[drives.moves], [1 / 3, 2 / 3])
    slow, fast = (int(ROUND_KMH * round(end / ROUND_KMH)) for end in ends)
    names = (f"under {slow} km/h", f"{slow} to {fast} km/h", f"over {fast} km/h")
    third = np.searchsorted([slow, fast], speed_kmh, side="right")
    return names, np.where(drives.moves, third, -1)


def _group(yes: Flags, known: Flags) -> Ints:
    return np.where(known, yes.astype(int), -1)


def _answers(made: FirstPlan, names: Sequence[str], group: Ints) -> tuple[Condition, ...]:
    """Return the odds of a plan for each group of targets that is large enough.

    Parameters
    ----------
    group
        (N,) the place of each target's answer among the names; -1: it gives none.
    """
    evaluated, weight = made.trial.evaluated, made.fresh.futures.weight
    found = []
    for number, name in enumerate(names):
        those = group == number
        share = float(weight[those].sum() / weight.sum())
        if those.sum() < FEWEST or share <= 0.0:
            continue
        found.append(Condition(name, evaluated.of_those(those, 1.0 / share), share))
    return tuple(found)


def _matters(one: Unknown) -> bool:
    """Return whether two answers' odds at the end are apart by more than chance."""
    if len(one.answers) < 2:
        return False
    ends = [answer.evaluated.found_interval for answer in one.answers]
    return max(low for low, _ in ends) > min(high for _, high in ends)


def _spread(one: Unknown) -> float:
    """Return by how much answers move the odds, in the mean over how probable they are."""
    share = np.array([answer.share or 0.0 for answer in one.answers])
    odds = np.array([answer.evaluated.detection_probability for answer in one.answers])
    middle = float(np.average(odds, weights=share))
    return float(np.sqrt(share @ (odds - middle) ** 2))
