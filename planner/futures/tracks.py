"""From motion sampled in towns, with the edges driven, to futures of few knots."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets, first_kept, first_of_parts
from planner.checked import finite, number, offsets, same_length
from planner.errors import InputError
from planner.futures.edges_driven import NO_EDGE, EdgesDriven
from planner.futures.futures import Futures
from planner.futures.kernels.thinning import SampleColumns, farthest_reach
from planner.futures.rides import Ride
from planner.network.road_network import RoadNetwork


class Tracks(NamedTuple):
    """Sampled motion of N particles, and when each comes onto which edge."""

    first_sample: Offsets  # (N + 1,) where a particle's samples start
    time_s: Floats  # (S,) seconds on the target's clock, rising within a particle
    x_m: Floats  # (S,) metres
    y_m: Floats  # (S,) metres
    first_change: Offsets  # (N + 1,) where a particle's changes of edge start
    change_s: Floats  # (C,) seconds, rising within a particle
    change_edge: Ints  # (C,) the edge driven from then on


def tracks_of_rides(rides: Sequence[Ride], network: RoadNetwork, *, step_s: float) -> Tracks:
    """Return what vehicles did as columns; the inside of a junction counts to the edge after it.

    Parameters
    ----------
    step_s
        Between two samples of a ride.
    """
    motion = [motion_of(ride, step_s) for ride in rides]
    changes = [_changes(ride, network, step_s) for ride in rides]
    time_s, x_m, y_m = np.concatenate(motion).T
    rows = np.array([row for some in changes for row in some], dtype=np.float64).reshape(-1, 2)
    return Tracks(
        first_sample=first_of_parts(motion),
        time_s=time_s,
        x_m=x_m,
        y_m=y_m,
        first_change=first_of_parts(changes),
        change_s=rows[:, 0],
        change_edge=rows[:, 1].astype(np.int32),
    )


def motion_of(ride: Ride, step_s: float) -> Floats:
    """Return time, x and y of a ride's samples, its arrival among them, (S, 3).

    Where a vehicle was on no road it moved straight from where it was seen before to where it was
    seen next; before and after all of these it stood.
    """
    xy_m = _bridged(np.frombuffer(ride.xy_m, np.float64).reshape(-1, 2))
    time_s = ride.from_s + step_s * np.arange(len(xy_m))
    sampled = np.column_stack([time_s, xy_m])
    if ride.arrival is None:
        return sampled
    after_s, x_m, y_m = ride.arrival
    return np.vstack([sampled, [time_s[-1] + after_s, x_m, y_m]])


def _bridged(xy_m: Floats) -> Floats:
    """Return places of which some were not known, NaN."""
    unknown = np.isnan(xy_m[:, 0])
    if not unknown.any():
        return xy_m
    sample = np.arange(len(xy_m))
    seen = sample[~unknown]
    return np.column_stack([np.interp(sample, seen, column[~unknown]) for column in xy_m.T])


def _changes(ride: Ride, network: RoadNetwork, step_s: float) -> list[tuple[float, int]]:
    """Return when a vehicle came onto which edge."""
    found: list[tuple[float, int]] = []
    counted: str | None = None  # the edge that the junction counts to in which it is
    for sample, road, onto in ride.roads:
        if onto != counted:
            found.append((ride.from_s + step_s * sample, network.edge_index.get(onto, NO_EDGE)))
        counted = onto if road.startswith(":") else None
    return found


def futures_of_tracks(
    tracks: Tracks, *, tolerance_m: float, every_s: float | None = None
) -> Futures:
    """Return the futures of tracks, one per particle; all weigh the same and stay.

    At the time of every sample a future is within the tolerance of it. A change of edge needs no
    knot.

    Parameters
    ----------
    tolerance_m
        How far a future may be from where the particle was sampled, metres.
    every_s
        A sample at a multiple of this is a knot, so that what comes before does not depend on what
        comes after it; seconds. None: nowhere.

    Raises
    ------
    InputError
        If columns do not fit each other, or times do not rise.
    """
    tolerance_m = number("tolerance_m", tolerance_m, above=0.0)
    samples = same_length(time_s=tracks.time_s, x_m=tracks.x_m, y_m=tracks.y_m)
    first = np.array(tracks.first_sample, np.int64)
    offsets("first_sample", first, max(0, len(first) - 1), samples)
    count = len(first) - 1
    # Copies, which are all of the one kind that compiled code is made for.
    columns = [np.array(column, np.float64) for column in (tracks.time_s, tracks.x_m, tracks.y_m)]
    time_s, x_m, y_m = columns
    finite(time_s=time_s, x_m=x_m, y_m=y_m)
    _refuse_falling(first, time_s)
    fixed = np.zeros(len(time_s), bool) if every_s is None else time_s % every_s == 0.0
    stays = farthest_reach(SampleColumns(first, time_s, x_m, y_m), tolerance_m, fixed)
    return Futures(
        time_s=time_s[stays],
        x_m=x_m[stays],
        y_m=y_m[stays],
        first_knot=first_kept(first, stays),
        weight=np.full(count, 1.0 / count),
        gone=np.zeros(count, dtype=bool),
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
