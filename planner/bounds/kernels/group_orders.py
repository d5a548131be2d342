"""The best order in which one UAV sees a few particles, compiled.

Time is divided into equal bins; a sighting counts from the start of its bin. As many as there are
bins stands for never.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Ints
from planner.jit import compiled


class Whereabouts(NamedTuple):
    """Where the particles of a group are, one row each, (n, bins)."""

    x_m: Floats  # at a bin's start
    y_m: Floats
    strays_m: Floats  # no place within the bin is farther than this from the one at its start
    is_there: Flags  # at some moment of the bin


@compiled
def onward(places: Whereabouts, around_m: float, flown_m: float) -> Ints:
    """Return when, after seeing a particle in a bin, the UAV may see another one, (n, n, bins).

    By the first particle, the second one, and the bin of the first sighting: the earliest bin of
    the second, which never falls from bin to bin. Where the first particle is faster than the UAV,
    the UAV is taken to fly on as fast as that.

    Parameters
    ----------
    around_m
        How much nearer than the two particles the UAV's two places can be: twice the radius.
    flown_m
        How far the UAV flies in a bin.
    """
    n, bins = places.x_m.shape
    found = np.full((n, n, bins), bins, dtype=np.int32)
    for k in range(n):
        step_m = max(flown_m, places.strays_m[k].max())
        for j in range(n):
            to = 0
            for at in range(bins if j != k else 0):
                to, wide_m = max(to, at), around_m + places.strays_m[k, at]
                while to < bins:
                    reach_m = wide_m + places.strays_m[j, to] + (to - at + 1) * step_m
                    dx = places.x_m[j, to] - places.x_m[k, at]
                    dy = places.y_m[j, to] - places.y_m[k, at]
                    if places.is_there[j, to] and dx * dx + dy * dy <= reach_m * reach_m:
                        break
                    to += 1
                found[k, j, at] = to
    return found


@compiled
def most_reward(first: Ints, onward_to: Ints, reward: Floats) -> float:
    """Return the most that one flight can earn with a group, whatever the order.

    A state is a set of particles seen and the last one of them. It holds the earliest bin and the
    most reward of all orders that lead to it, which may be those of two different orders.

    Parameters
    ----------
    first
        The first bin in which each particle may be seen at all, (n,).
    onward_to
        As of `onward`, (n, n, bins).
    reward
        Of seeing each particle in each bin, (n, bins), never rising.
    """
    n, bins = reward.shape
    seen_in = np.full((1 << n, n), bins, dtype=np.int32)
    earned, most = np.zeros((1 << n, n)), 0.0
    for k in range(n):
        if first[k] < bins:
            seen_in[1 << k, k], earned[1 << k, k] = first[k], reward[k, first[k]]
    for seen in range(1, 1 << n):
        for last in range(n):
            at, so_far = seen_in[seen, last], earned[seen, last]
            if at >= bins:
                continue
            most = max(most, so_far)
            for k in range(n):
                to = max(first[k], onward_to[last, k, at])
                if (seen >> k) & 1 or to >= bins:
                    continue
                both = seen | 1 << k
                seen_in[both, k] = min(seen_in[both, k], to)
                earned[both, k] = max(earned[both, k], so_far + reward[k, to])
    return most
