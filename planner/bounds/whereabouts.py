"""Where a particle is at many times: what bounds that sample time are made of."""

import numpy as np

from planner.arrays import Flags, Floats
from planner.futures.futures import Futures


def places_at(futures: Futures, k: int, at_s: Floats) -> Floats:
    """Return where a particle is at some times, (2, times) metres; where it began or ended."""
    knots = _knots(futures, k)
    return np.stack(
        [np.interp(at_s, futures.time_s[knots], of[knots]) for of in (futures.x_m, futures.y_m)]
    )


def driven_at(futures: Futures, k: int, at_s: Floats) -> Floats:
    """Return how far a particle has driven by some times, (times,) metres."""
    knots = _knots(futures, k)
    steps_m = np.hypot(np.diff(futures.x_m[knots]), np.diff(futures.y_m[knots]))
    driven_m = np.append(0.0, np.cumsum(steps_m))
    return np.asarray(np.interp(at_s, futures.time_s[knots], driven_m))


def is_there(futures: Futures, k: int, edges_s: Floats) -> Flags:
    """Return whether a particle is there at some moment between an edge and the next, (spans,)."""
    time_s = futures.time_s[_knots(futures, k)]
    left_s = time_s[-1] if futures.gone[k] else np.inf
    return np.asarray((edges_s[1:] >= time_s[0]) & (edges_s[:-1] <= left_s))


def _knots(futures: Futures, k: int) -> slice:
    return slice(int(futures.first_knot[k]), int(futures.first_knot[k + 1]))
