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
    """Return futures in which each particle is nowhere before a time of its own, (N,) seconds.

    For a time of infinity it is never there.
    """
    pieces = [_from(futures, k, from_s[k]) for k in range(len(futures))]
    return _of_pieces(futures, pieces, futures.gone)


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


def _from(futures: Futures, k: int, from_s: float) -> Piece:
    time_s, x_m, y_m, edge = _piece(futures, k)
    over = futures.gone[k] and from_s > futures.end_s[k]
    if len(time_s) == 0 or from_s == np.inf or over:
        return time_s[:0], x_m[:0], y_m[:0], edge[:0]
    if from_s <= time_s[0]:
        return time_s, x_m, y_m, edge
    kept = int(np.searchsorted(time_s, from_s, side="right"))
    start_x_m, start_y_m = futures.xy(k, from_s)
    return (
        np.append(from_s, time_s[kept:]),
        np.append(start_x_m, x_m[kept:]),
        np.append(start_y_m, y_m[kept:]),
        edge[kept - 1 :],
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
