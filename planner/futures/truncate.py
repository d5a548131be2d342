"""Futures cut short: targets that stop for good on their way, and those not looked at any more."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from planner.arrays import Flags, Floats, Ints
from planner.futures.futures import NO_EDGE, Futures

Piece = tuple[Floats, Floats, Floats, Ints]  # time_s, x_m, y_m, edge of one particle's knots


def parked(futures: Futures, rng: np.random.Generator) -> Futures:
    """Return the same targets, each of which stops somewhere on its way and rests there.

    Each time of the way, from the first knot to the last, is as likely as another; the shares are
    spread evenly over the targets, in an order drawn from ``rng``. Targets that never set out
    stay as they are.
    """
    share = (rng.permutation(len(futures)) + 0.5) / max(len(futures), 1)
    pieces, gone = [], futures.gone.copy()
    for k in range(len(futures)):
        piece = _piece(futures, k)
        if len(piece[0]) > 1:
            first_s, last_s = piece[0][0], piece[0][-1]
            piece = _until(futures, k, float(first_s + share[k] * (last_s - first_s)))
            gone[k] = False
        pieces.append(piece)
    return _of_pieces(futures, pieces, gone)


def after(futures: Futures, from_s: Floats) -> Futures:
    """Return futures in which each particle is nowhere before its own time, (N,) seconds.

    For a time of infinity it is never there.
    """
    first, counts = futures.first_knot[:-1], np.diff(futures.first_knot)
    particle = np.repeat(np.arange(len(futures)), counts)
    over = (from_s == np.inf) | (futures.gone & (from_s > futures.end_s))
    passed = np.bincount(particle[futures.time_s <= from_s[particle]], minlength=len(futures))
    cut = ~over & (passed > 0)
    left = _started(futures, (first + passed - 1)[cut], from_s[cut])
    earliest = np.where(cut, first + passed - 1, first)
    kept = (np.arange(len(particle)) >= earliest[particle]) & ~over[particle]
    still = np.bincount(particle[kept], minlength=len(futures))
    return replace(
        left,
        time_s=left.time_s[kept],
        x_m=left.x_m[kept],
        y_m=left.y_m[kept],
        edge=left.edge[kept],
        first_knot=np.concatenate(([0], np.cumsum(still))),
    )


def _started(futures: Futures, knot: Ints, at_s: Floats) -> Futures:
    """Return futures in which each of some knots is moved on, to a time before the next one."""
    time_s, x_m, y_m = futures.time_s.copy(), futures.x_m.copy(), futures.y_m.copy()
    rests = np.isin(knot + 1, futures.first_knot)
    following = np.where(rests, knot, knot + 1)
    lasts_s = np.where(rests, 1.0, time_s[following] - time_s[knot])
    for column in (x_m, y_m):
        slope = (column[following] - column[knot]) / lasts_s
        column[knot] = slope * (at_s - time_s[knot]) + column[knot]
    time_s[knot] = at_s
    return replace(futures, time_s=time_s, x_m=x_m, y_m=y_m)


def _piece(futures: Futures, k: int) -> Piece:
    knots = slice(futures.first_knot[k], futures.first_knot[k + 1])
    return futures.time_s[knots], futures.x_m[knots], futures.y_m[knots], futures.edge[knots]


def _until(futures: Futures, k: int, stop_s: float) -> Piece:
    time_s, x_m, y_m, edge = _piece(futures, k)
    kept = int(np.searchsorted(time_s, stop_s))
    stop_x_m, stop_y_m = futures.xy(k, stop_s)
    return (
        np.append(time_s[:kept], stop_s),
        np.append(x_m[:kept], stop_x_m),
        np.append(y_m[:kept], stop_y_m),
        np.append(edge[:kept], NO_EDGE),
    )


def _of_pieces(futures: Futures, pieces: Iterable[Piece], gone: Flags) -> Futures:
    pieces = list(pieces)
    time_s, x_m, y_m, edge = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    counts = [len(piece[0]) for piece in pieces]
    return replace(
        futures,
        time_s=time_s,
        x_m=x_m,
        y_m=y_m,
        edge=edge,
        first_knot=np.concatenate(([0], np.cumsum(counts))),
        gone=gone,
    )
