"""Futures that a user brings: those to plan on, and those kept out to evaluate the plan on.

Several files are several days, each as likely as any other. Vehicles of one day, or of one
realisation of traffic, meet the same queues: these are kept out whole, where there are enough.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from planner.arrays import Offsets
from planner.errors import InputError
from planner.futures.futures import Futures
from planner.futures.store import Recording, read_recording
from planner.mission.opening import OpenScenario
from planner.mission.several import refuse_several
from planner.streams import stream

KEPT_OUT = 0.2  # share of the vehicles that no planner sees
ENOUGH = 100  # vehicles from which on some are kept out
ENOUGH_FILES = 3  # from which on these are kept out in place of vehicles


@dataclass(frozen=True)
class OwnFutures:
    """Files of futures, and which of their times is the scenario's time 0."""

    path: Path
    begin_s: float | None = None  # seconds on the files' clock; None: their own time 0
    others: tuple[Path, ...] = ()  # further files

    @property
    def paths(self) -> tuple[Path, ...]:
        """All files."""
        return self.path, *self.others


@dataclass(frozen=True, eq=False)
class Split:
    """A recording in two parts that share no vehicle."""

    planning: Recording
    kept_out: Recording | None  # None: too few vehicles to spare some


def read_split(own: OwnFutures, opened: OpenScenario) -> Split:
    """Return a user's futures in two parts: the same ones for the same scenario seed.

    Raises
    ------
    InputError
        As `planner.futures.store.read_recording`.
    """
    refuse_several(opened, "--futures")
    search = opened.scenario.search
    days = [
        read_recording(path, opened.network, begin_s=own.begin_s, horizon_s=search.horizon_s)
        for path in own.paths
    ]
    recording = _joined(days)
    if recording.futures.target.any():
        raise InputError(
            f"{own.path}: is of several targets, which come from a scenario yet ([[target]]); keep "
            "the rows of one, with target 0"
        )
    unit = _units(days, recording.futures)
    units = np.unique(unit)
    if (len(unit) < ENOUGH and len(days) < ENOUGH_FILES) or len(units) < 2:
        return Split(recording, None)
    order = stream(search.seed, "kept out").permutation(len(units))
    spared = units[order[: max(1, round(KEPT_OUT * len(units)))]]
    out = np.isin(unit, spared)
    return Split(*(_part(recording, np.flatnonzero(some)) for some in (~out, out)))


def _units(days: Sequence[Recording], futures: Futures) -> Offsets:
    """Return the unit that each vehicle is kept out with, (N,): its day, its realisation, itself.

    Vehicles of one unit queue behind each other: who knows some knows where the others are.
    """
    if len(days) >= ENOUGH_FILES:
        return np.repeat(np.arange(len(days)), [len(one.futures) for one in days])
    if futures.fates is not None:
        return futures.fates.realisation.astype(np.int64)
    return np.arange(len(futures))


def _joined(days: Sequence[Recording]) -> Recording:
    """Return several recordings as one, each of which is as likely as any other."""
    return replace(Recording.pooled(days), others=tuple(one.path for one in days[1:]))


def _part(recording: Recording, particles: Offsets) -> Recording:
    """Return some vehicles of a recording, together as likely as all of them."""
    part = recording.take(particles)
    total, mine = float(recording.futures.weight.sum()), float(part.futures.weight.sum())
    if mine <= 0.0:
        return part
    return replace(part, futures=part.futures.reweighted(part.futures.weight * (total / mine)))
