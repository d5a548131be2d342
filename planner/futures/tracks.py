"""From motion sampled in towns, with the edges driven, to futures of few knots."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.belief.particles import Particles
from planner.checked import finite, number, offsets, same_length
from planner.errors import InputError
from planner.futures.edges_driven import EdgesDriven
from planner.futures.futures import Futures
from planner.futures.kernels.thinning import SampleColumns, farthest_reach


class Tracks(NamedTuple):
    """Sampled motion of N particles, and when each comes onto which edge."""

    first_sample: Offsets  # (N + 1,) where a particle's samples start
    time_s: Floats  # (S,) seconds on the target's clock, rising within a particle
    x_m: Floats  # (S,) metres
    y_m: Floats  # (S,) metres
    first_change: Offsets  # (N + 1,) where a particle's changes of edge start
    change_s: Floats  # (C,) seconds, rising within a particle
    change_edge: Ints  # (C,) the edge driven from then on


def futures_of_tracks(tracks: Tracks, particles: Particles, *, tolerance_m: float) -> Futures:
    """Return the futures of tracks, one per particle, with the particles' weights and ends.

    At the time of every sample a future is within the tolerance of it. A change of edge needs no
    knot.

    Parameters
    ----------
    tolerance_m
        How far a future may be from where the particle was sampled, metres.

    Raises
    ------
    InputError
        If columns do not fit each other or the particles, or times do not rise.
    """
    tolerance_m = number("tolerance_m", tolerance_m, above=0.0)
    samples = same_length(time_s=tracks.time_s, x_m=tracks.x_m, y_m=tracks.y_m)
    first = np.array(tracks.first_sample, np.int64)
    offsets("first_sample", first, len(particles), samples)
    # Copies, which are all of the one kind that compiled code is made for.
    columns = [np.array(column, np.float64) for column in (tracks.time_s, tracks.x_m, tracks.y_m)]
    time_s, x_m, y_m = columns
    finite(time_s=time_s, x_m=x_m, y_m=y_m)
    _refuse_falling(first, time_s)
    stays = farthest_reach(SampleColumns(first, time_s, x_m, y_m), tolerance_m)
    return Futures(
        time_s=time_s[stays],
        x_m=x_m[stays],
        y_m=y_m[stays],
        first_knot=np.concatenate(([0], np.cumsum(stays)))[first],
        weight=particles.weight,
        gone=particles.gone,
        target=particles.target,
        edges=EdgesDriven(tracks.first_change, tracks.change_s, tracks.change_edge),
    )


def _refuse_falling(first: Offsets, time_s: Floats) -> None:
    """Refuse times that do not rise: between samples that are left out nobody would see them."""
    rises = np.diff(time_s) > 0.0
    rises[first[(first > 0) & (first < len(time_s))] - 1] = True
    if not rises.all():
        k = int(np.argmin(rises))
        particle = int(np.searchsorted(first, k, side="right")) - 1
        raise InputError(
            f"time_s: particle {particle} has samples at {time_s[k]:g} and {time_s[k + 1]:g} s; "
            "times must rise from sample to sample"
        )
