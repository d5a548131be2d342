"""From sampled motion to the few knots between which it is straight and at constant speed."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets, first_of_parts, first_rows
from planner.futures.edges_driven import NO_EDGE, EdgesDriven
from planner.futures.fcd import SAME_S, Samples
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork

TOLERANCE_M = 1.0  # how far a dropped sample may lie from the straight, even motion
EXACT_M = 1e-3  # lanes that differ less from the drawn road are as long as it
LATE = 0.01  # of the time between two samples: digits that a file lacks make a crossing later


class Knots:
    """Knot columns in the making, sorted by particle and time."""

    def __init__(self, particle: Ints, time_s: Floats, xy_m: Floats, edge: Ints) -> None:
        self.particle = particle
        self.time_s = time_s
        self.xy_m = xy_m
        self.edge = edge

    @classmethod
    def merged(cls, parts: Sequence["Knots"]) -> "Knots":
        """Return all parts as one, sorted; of knots at the same time the last part's stays."""
        particle = np.concatenate([part.particle for part in parts])
        time_s = np.concatenate([part.time_s for part in parts])
        order = np.lexsort((time_s, particle))
        merged = cls(
            particle[order],
            time_s[order],
            np.concatenate([part.xy_m for part in parts])[order],
            np.concatenate([part.edge for part in parts])[order],
        )
        again = np.diff(merged.particle) == 0
        again &= np.diff(merged.time_s) < SAME_S
        return merged.take(np.append(~again, True))

    def take(self, rows: Flags) -> "Knots":
        """Return some of the knots."""
        return Knots(self.particle[rows], self.time_s[rows], self.xy_m[rows], self.edge[rows])

    def thinned(self, tolerance_m: float) -> "Knots":
        """Return the knots without those that straight, even motion passes within a tolerance.

        The first and the last knot of a particle and every change of edge stay. Between knots
        that stay, the one that lies farthest off is kept until none lies off (Ramer, Douglas and
        Peucker, in space and time), all stretches at once.
        """
        stays = np.diff(self.particle, prepend=-1) != 0
        stays |= np.diff(self.particle, append=-1) != 0
        stays |= np.diff(self.edge, prepend=NO_EDGE - 1) != 0
        open_ = ~stays
        while open_.any():
            farthest, settled = self._farthest(stays, open_, tolerance_m)
            stays[farthest] = True
            open_[farthest] = False
            open_[settled] = False
        return self.take(stays)

    def _farthest(self, stays: Flags, open_: Flags, tolerance_m: float) -> tuple[Offsets, Offsets]:
        """Rows to keep, one per stretch that bends, and all rows of stretches that do not."""
        kept = np.flatnonzero(stays)
        rows = np.flatnonzero(open_)
        stretch = np.searchsorted(kept, rows) - 1
        a, b = kept[stretch], kept[stretch + 1]
        share = (self.time_s[rows] - self.time_s[a]) / (self.time_s[b] - self.time_s[a])
        chord = self.xy_m[a] + (self.xy_m[b] - self.xy_m[a]) * share[:, None]
        off_m = np.linalg.norm(self.xy_m[rows] - chord, axis=1)
        first = np.flatnonzero(np.diff(stretch, prepend=-1))
        most_m = np.repeat(np.maximum.reduceat(off_m, first), np.diff(np.append(first, len(rows))))
        candidates = np.flatnonzero((off_m == most_m) & (off_m > tolerance_m))
        one_each = candidates[np.diff(stretch[candidates], prepend=-1) != 0]
        return rows[one_each], rows[most_m <= tolerance_m]


class DrivenRoutes:
    """The edges each vehicle drives, one flat column, with the pace on each."""

    def __init__(self, edges: Sequence[Ints], speeds_mps: Sequence[Floats] | None) -> None:
        self.first = first_of_parts(edges)
        self.edge = np.concatenate(edges)
        self.drawn = speeds_mps is not None
        speed_mps = np.ones(len(self.edge)) if speeds_mps is None else np.concatenate(speeds_mps)
        self.pace = 1.0 / speed_mps  # (M,) s/m where speeds are drawn, else 1

    def driven(self, edge_length_m: Floats) -> Floats:
        """Return metres times pace from each route's start to the end of each of its edges, (M,).

        Summed route by route: a vehicle's knots must not depend on the others, to the last bit.
        """
        cost = edge_length_m[self.edge] * self.pace
        stretches = pairwise(self.first.tolist())
        return np.concatenate([np.cumsum(cost[first:after]) for first, after in stretches])

    @classmethod
    def shown(cls, samples: Samples) -> "DrivenRoutes":
        """Return the routes that samples show, for files that do not hold them."""
        change = np.diff(samples.vehicle, prepend=-1) != 0
        change |= np.diff(samples.edge, prepend=NO_EDGE - 1) != 0
        starts = np.flatnonzero(change)
        count = np.bincount(samples.vehicle[starts], minlength=len(samples.names))
        return cls(np.split(samples.edge[starts], np.cumsum(count)[:-1]), None)


def futures_of_samples(
    samples: Samples,
    network: RoadNetwork,
    *,
    routes: DrivenRoutes | None = None,
    ended: tuple[float, float] = (-np.inf, np.inf),
    tolerance_m: float = TOLERANCE_M,
) -> Futures:
    """Return the futures that samples show, thinned to knots, one particle per vehicle.

    Knots stand at every change of edge, at the time that the distance left on the edge and the
    speed give: SUMO's speed is constant within a step. All weights are equal and all vehicles
    stay at their ends.

    Parameters
    ----------
    routes
        The planned routes where they are known; edges shorter than a step's drive may be missing
        in the samples, and a vehicle last seen on its way is taken to its route's end.
    ended
        A vehicle whose last sample is older than the first number has reached its route's end,
        within a step of the second number, both in seconds.
    tolerance_m
        How far the futures may be from a sample, metres.
    """
    on = Knots(
        samples.vehicle, samples.time_s, np.stack([samples.x_m, samples.y_m], 1), samples.edge
    )
    parts = [on]
    followed = routes or DrivenRoutes.shown(samples)
    place = _route_places(samples, followed)
    parts.append(_crossings(samples, network, followed, place, shown=routes is None))
    if routes is not None:
        parts.append(_arrivals(samples, network, routes, place, ended))
    knots = Knots.merged(parts).thinned(tolerance_m)
    count = np.bincount(knots.particle, minlength=len(samples.names))
    return Futures(
        time_s=knots.time_s,
        x_m=knots.xy_m[:, 0],
        y_m=knots.xy_m[:, 1],
        first_knot=first_rows(count),
        weight=np.full(len(count), 1.0 / len(count)),
        gone=np.zeros(len(count), dtype=bool),
        edges=EdgesDriven.of_rows(len(count), knots.particle, knots.time_s, knots.edge),
    )


def _route_places(samples: Samples, routes: DrivenRoutes) -> Offsets:
    """Place of each sample in the flat routes, (S,): the next visit of its edge."""
    starts = np.diff(samples.vehicle, prepend=-1) != 0
    starts |= np.diff(samples.edge, prepend=NO_EDGE - 1) != 0
    rows = np.flatnonzero(starts)
    place = np.empty(len(rows), dtype=np.int64)
    edges, last_vehicle, at = routes.edge.tolist(), -1, -1
    stretches = zip(samples.vehicle[rows].tolist(), samples.edge[rows].tolist(), strict=True)
    for i, (vehicle, edge) in enumerate(stretches):
        at = int(routes.first[vehicle]) if vehicle != last_vehicle else at + 1
        while edges[at] != edge:
            at += 1
        place[i], last_vehicle = at, vehicle
    return np.repeat(place, np.diff(np.append(rows, len(samples.vehicle))))


class _Left(NamedTuple):
    """Samples after which vehicles leave edges."""

    rows: Offsets  # (k,) of the samples
    edges: Offsets  # (k,) how many edges each leaves
    speed_mps: Floats  # (k,) at which it drives there, if the routes have none
    latest_s: Floats  # (k,) when the last of them is left at the latest
    onto_m: Floats  # (k,) how far it has driven by then on the edge it is on; NaN where it stops


def _crossings(
    samples: Samples, network: RoadNetwork, routes: DrivenRoutes, place: Offsets, *, shown: bool
) -> Knots:
    """Knots at the ends of all edges that are left between two samples of a vehicle.

    Samples of every step hold the speed that a vehicle had all the way. Files that show their
    routes only may hold fewer; there a vehicle may have braked.
    """
    known = (samples.edge != NO_EDGE) & ~np.isnan(samples.along_m) & ~np.isnan(samples.speed_mps)
    onward = (np.diff(samples.vehicle) == 0) & (np.diff(place) > 0)
    rows = np.flatnonzero(onward & known[:-1] & known[1:])
    left = _Left(
        rows=rows,
        edges=place[rows + 1] - place[rows],
        speed_mps=samples.speed_mps[rows + 1],
        latest_s=samples.time_s[rows + 1],
        onto_m=samples.along_m[rows + 1] if shown else np.full(len(rows), np.nan),
    )
    return _ends_of_edges(samples, network, routes, place, left)


def _arrivals(
    samples: Samples,
    network: RoadNetwork,
    routes: DrivenRoutes,
    place: Offsets,
    ended: tuple[float, float],
) -> Knots:
    """Knots at the ends of the edges left after the last sample of vehicles that arrived."""
    ended_before_s, step_s = ended
    last = np.flatnonzero(np.diff(samples.vehicle, append=-1) != 0)
    rows = last[samples.time_s[last] < ended_before_s]
    left = _Left(
        rows=rows,
        edges=routes.first[samples.vehicle[rows] + 1] - place[rows],
        speed_mps=samples.speed_mps[rows],
        latest_s=samples.time_s[rows] + step_s,
        onto_m=np.full(len(rows), np.nan),
    )
    return _ends_of_edges(samples, network, routes, place, left)


def _ends_of_edges(
    samples: Samples, network: RoadNetwork, routes: DrivenRoutes, place: Offsets, left: _Left
) -> Knots:
    """Knots at the ends of the next edges after given samples."""
    nth = np.arange(left.edges.sum()) - np.repeat(np.cumsum(left.edges) - left.edges, left.edges)
    row = np.repeat(left.rows, left.edges)
    at = place[row] + nth
    length_m = network.edge_length_m[routes.edge]
    driven = routes.driven(network.edge_length_m)
    rest = (length_m[place[row]] - samples.along_m[row]) * routes.pace[place[row]]
    ahead = rest + driven[at] - driven[place[row]]  # seconds; metres where no speed is drawn
    last = np.repeat(np.cumsum(left.edges) - 1, left.edges)
    onto = (
        np.repeat(left.onto_m, left.edges) * routes.pace[np.minimum(at[last] + 1, len(driven) - 1)]
    )
    speed = np.ones(len(row)) if routes.drawn else np.repeat(left.speed_mps, left.edges)
    latest_s = np.repeat(left.latest_s, left.edges)
    time_s = _times(samples.time_s[row], latest_s, speed, ahead, ahead[last] + onto)
    goal = at + 1 == routes.first[samples.vehicle[row] + 1]
    return Knots(
        samples.vehicle[row],
        time_s,
        _points(samples, network, row, routes.edge[at], time_s),
        routes.edge[np.where(goal, at, np.minimum(at + 1, len(routes.edge) - 1))],
    )


def _times(
    since_s: Floats, latest_s: Floats, speed: Floats, ahead: Floats, in_all: Floats
) -> Floats:
    """Return when vehicles that sampled at ``since_s`` have driven ``ahead``, (k,) seconds.

    Their speed says so. Where it is none, or says that they come too late, they are taken to drive
    evenly: ``in_all`` is what they have driven at the latest time, NaN where that is not known.
    """
    lasts_s = latest_s - since_s
    after_s = np.divide(ahead, speed, out=np.full(len(ahead), np.inf), where=speed > 0.0)
    late = (after_s > (1.0 + LATE) * lasts_s) & ~np.isnan(in_all)
    share = np.divide(ahead, in_all, out=np.zeros(len(ahead)), where=in_all > 0.0)
    after_s = np.where(late, np.clip(share, 0.0, 1.0) * lasts_s, after_s)
    time_s = np.minimum(since_s + after_s, latest_s)
    # An edge may be left before the sample on it where that lies beyond the edge's end.
    return np.where(time_s < since_s - SAME_S, since_s, time_s)


def _points(
    samples: Samples, network: RoadNetwork, row: Offsets, edge: Ints, time_s: Floats
) -> Floats:
    """Where vehicles are when they leave edges after given samples, (k, 2) metres."""
    xy_m = np.stack([samples.x_m, samples.y_m], axis=1)
    left = samples.edge[row]
    onward = network.edge_xy(left, network.edge_length_m[left])
    onward -= network.edge_xy(left, samples.along_m[row])
    first = (edge == left)[:, None]
    drawn = np.where(first, xy_m[row] + onward, network.edge_xy(edge, network.edge_length_m[edge]))
    # Where junctions have a size, lanes end before the drawn road does.
    exact = np.abs(network.edge_length_m - network.edge_lines.length_m) < EXACT_M
    after = np.minimum(row + 1, len(xy_m) - 1)
    arriving = (samples.vehicle[after] != samples.vehicle[row]) | (after == row)
    step_s = np.where(arriving, 1.0, samples.time_s[after] - samples.time_s[row])
    share = (time_s - samples.time_s[row]) / step_s
    between = xy_m[row] + (xy_m[after] - xy_m[row]) * share[:, None]
    rest_m = np.maximum(0.0, network.edge_length_m[left] - samples.along_m[row])
    reach = np.minimum(1.0, rest_m / np.maximum(np.linalg.norm(onward, axis=1), rest_m + EXACT_M))
    ahead = xy_m[row] + onward * reach[:, None]
    inexact = np.where(arriving[:, None], ahead, between)
    return np.where(exact[edge][:, None], drawn, inexact)
