"""Futures that a user brings: those to plan on, and those kept out to evaluate the plan on."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from planner.arrays import Offsets
from planner.futures.store import Recording, read_recording
from planner.mission.opening import OpenScenario
from planner.streams import stream

KEPT_OUT = 0.2  # share of the vehicles that no planner sees
ENOUGH = 100  # vehicles from which on some are kept out


@dataclass(frozen=True)
class OwnFutures:
    """A file of futures, and which of its times is the scenario's time 0."""

    path: Path
    begin_s: float | None = None  # seconds on the file's clock; None: its own time 0


@dataclass(frozen=True, eq=False)
class Split:
    """A recording in two parts that share no vehicle."""

    planning: Recording
    kept_out: Recording | None  # None: too few vehicles to spare some


def read_split(own: OwnFutures, opened: OpenScenario) -> Split:
    """Return a user's futures in two parts: the same ones for the same scenario seed.

    What rode in traffic is parted by its realisations: vehicles of one queue behind each other, and
    a plan that knows some of them knows where the others are.

    Raises
    ------
    InputError
        As `planner.futures.store.read_recording`.
    """
    search = opened.scenario.search
    recording = read_recording(
        own.path, opened.network, begin_s=own.begin_s, horizon_s=search.horizon_s
    )
    fates = recording.futures.fates
    many = len(recording.futures)
    group = np.arange(many) if fates is None else fates.realisation
    groups = np.unique(group)
    if many < ENOUGH or len(groups) < 2:
        return Split(recording, None)
    order = stream(search.seed, "kept out").permutation(len(groups))
    spared = groups[order[: max(1, round(KEPT_OUT * len(groups)))]]
    out = np.isin(group, spared)
    return Split(*(_part(recording, np.flatnonzero(some)) for some in (~out, out)))


def _part(recording: Recording, particles: Offsets) -> Recording:
    """Return some vehicles of a recording, together as likely as all of them."""
    futures = recording.futures.take(particles)
    total, mine = float(recording.futures.weight.sum()), float(futures.weight.sum())
    if mine > 0.0:
        futures = replace(futures, weight=futures.weight * (total / mine))
    chosen = particles.tolist()
    return replace(
        recording,
        futures=futures,
        speed_mps=tuple(recording.speed_mps[k] for k in chosen),
        route=tuple(recording.route[k] for k in chosen),
    )
