"""Truncated futures: targets that stop for good on their way, or are there from a time on only."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Ints, first_kept, first_of_parts, first_rows
from planner.futures.edges_driven import EdgesDriven
from planner.futures.futures import Futures


class OwnKnots(NamedTuple):
    """One particle's knots, as the columns of `Futures`."""

    time_s: Floats
    x_m: Floats
    y_m: Floats


def parked(futures: Futures, rng: np.random.Generator) -> Futures:
    """Return the same targets, each of which stops somewhere on its way and rests there.

    Each time of the way, from the first knot to the last, is as likely as another; the shares are
    spread evenly over the targets, in an order drawn from ``rng``. Targets that never set out
    stay as they are.
    """
    share = (rng.permutation(len(futures)) + 0.5) / max(len(futures), 1)
    parts, gone, stop_s = [], futures.gone.copy(), np.full(len(futures), np.inf)
    for k in range(len(futures)):
        knots = _knots(futures, k)
        if len(knots.time_s) > 1:
            first_s, last_s = knots.time_s[0], knots.time_s[-1]
            stop_s[k] = first_s + share[k] * (last_s - first_s)
            knots = _until(futures, k, float(stop_s[k]))
            gone[k] = False
        parts.append(knots)
    return replace(_joined(futures, parts, gone), edges=futures.edges.until(stop_s))


def after(futures: Futures, from_s: Floats) -> Futures:
    """Return futures in which each particle is nowhere before its own time, (N,) seconds.

    For a time of infinity it is never there.
    """
    first, particle = futures.first_knot[:-1], futures.particle
    over = (from_s == np.inf) | (futures.gone & (from_s > futures.end_s))
    passed = np.bincount(particle[futures.time_s <= from_s[particle]], minlength=len(futures))
    cut = ~over & (passed > 0)
    left = _started(futures, (first + passed - 1)[cut], from_s[cut])
    earliest = np.where(cut, first + passed - 1, first)
    kept = (np.arange(len(particle)) >= earliest[particle]) & ~over[particle]
    return replace(
        left,
        time_s=left.time_s[kept],
        x_m=left.x_m[kept],
        y_m=left.y_m[kept],
        first_knot=first_kept(futures.first_knot, kept),
        edges=futures.edges.since(np.where(over, np.inf, from_s)),
    )


def delayed(futures: Futures, by_s: Floats) -> Futures:
    """Return the same motion of each particle so much later, (N,) seconds."""
    changes = np.repeat(by_s, np.diff(futures.edges.first_change))
    edges = replace(futures.edges, time_s=futures.edges.time_s + changes)
    return replace(futures, time_s=futures.time_s + by_s[futures.particle], edges=edges)


def stopped(futures: Futures, stop_s: Floats) -> Futures:
    """Return the same motion of each particle up to its own time, (N,) seconds, none after it."""
    kept = futures.time_s < stop_s[futures.particle]
    kept[futures.first_knot[:-1][np.diff(futures.first_knot) > 0]] = True
    cut = np.flatnonzero(futures.end_s > stop_s)
    before = (first_kept(futures.first_knot, kept)[1:] - 1)[cut]
    rows = np.flatnonzero(kept)[before]
    share = (stop_s[cut] - futures.time_s[rows]) / (futures.time_s[rows + 1] - futures.time_s[rows])
    columns = {
        "x_m": futures.x_m[rows] + share * (futures.x_m[rows + 1] - futures.x_m[rows]),
        "y_m": futures.y_m[rows] + share * (futures.y_m[rows + 1] - futures.y_m[rows]),
        "time_s": stop_s[cut],
    }
    moves = columns["time_s"] > futures.time_s[rows]
    ends: dict[str, Any] = {
        name: np.insert(getattr(futures, name)[kept], before[moves] + 1, column[moves])
        for name, column in columns.items()
    }
    counts = np.diff(first_kept(futures.first_knot, kept))
    counts[cut[moves]] += 1
    edges = _changes_before(futures.edges, stop_s)
    return replace(futures, first_knot=first_rows(counts), edges=edges, **ends)


def _changes_before(edges: EdgesDriven, stop_s: Floats) -> EdgesDriven:
    """Return the changes of edge before each particle's own time: it stays on the last one."""
    kept = edges.time_s < stop_s[edges.particle]
    kept[edges.first_change[:-1][np.diff(edges.first_change) > 0]] = True
    return EdgesDriven(first_kept(edges.first_change, kept), edges.time_s[kept], edges.edge[kept])


def recorded_until(futures: Futures, until_s: float) -> Futures:
    """Return the knots and the changes of edge up to a time, and no others."""
    knots, changes = futures.time_s <= until_s, futures.edges.time_s <= until_s
    return replace(
        futures,
        time_s=futures.time_s[knots],
        x_m=futures.x_m[knots],
        y_m=futures.y_m[knots],
        first_knot=first_kept(futures.first_knot, knots),
        edges=EdgesDriven(
            first_kept(futures.edges.first_change, changes),
            futures.edges.time_s[changes],
            futures.edges.edge[changes],
        ),
    )


def begun_at(futures: Futures, begin_s: float) -> Futures:
    """Return the same futures on a clock whose time 0 is the given time; nothing is before it."""
    edges = replace(futures.edges, time_s=futures.edges.time_s - begin_s)
    shifted = replace(futures, time_s=futures.time_s - begin_s, edges=edges)
    return after(shifted, np.zeros(len(futures)))


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


def _knots(futures: Futures, k: int) -> OwnKnots:
    rows = slice(futures.first_knot[k], futures.first_knot[k + 1])
    return OwnKnots(futures.time_s[rows], futures.x_m[rows], futures.y_m[rows])


def _until(futures: Futures, k: int, stop_s: float) -> OwnKnots:
    time_s, x_m, y_m = _knots(futures, k)
    kept = int(np.searchsorted(time_s, stop_s))
    stop_x_m, stop_y_m = futures.xy(k, stop_s)
    return OwnKnots(
        np.append(time_s[:kept], stop_s),
        np.append(x_m[:kept], stop_x_m),
        np.append(y_m[:kept], stop_y_m),
    )


def _joined(futures: Futures, parts: Sequence[OwnKnots], gone: Flags) -> Futures:
    time_s, x_m, y_m = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    return replace(
        futures,
        time_s=time_s,
        x_m=x_m,
        y_m=y_m,
        first_knot=first_of_parts([part.time_s for part in parts]),
        gone=gone,
    )
