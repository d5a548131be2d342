"""Where the target is, road by road, before and after a flight, and at all times in between."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Ints
from planner.futures.edges_driven import NO_EDGE
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork


class RoadOdds(NamedTuple):
    """What a flight does for a road, in the words of search theory; (R,) each."""

    poc_before: Floats  # the target is there as the sensor goes on (containment)
    pod: Floats  # if it is there then, the flight finds it, wherever (detection); 0 on empty roads
    pos: Floats  # it is there then, and is found: the product of both (success)
    poc_after: Floats  # it is there as the sensor goes off, and was not found


class Cloud(NamedTuple):
    """Where targets that are not found yet are at a time; (S,) of them."""

    time_s: float
    xy_m: Floats  # (S, 2) metres
    weight: Floats  # (S,) probability


@dataclass(frozen=True, eq=False)
class Odds:
    """Fresh targets and what a flight makes of them."""

    futures: Futures
    seen_at: Floats  # (N,) seconds, when each is first seen; inf: never
    network: RoadNetwork
    from_s: float  # when the sensor goes on
    to_s: float  # when it goes off for good

    @cached_property
    def roads(self) -> RoadOdds:
        """What the flight does for each road."""
        found = self.seen_at <= self.to_s
        before = self._by_road(self.from_s, np.ones(len(found), bool))
        pos = self._by_road(self.from_s, found)
        pod = np.divide(pos, before, out=np.zeros_like(pos), where=before > 0.0)
        return RoadOdds(before, pod, pos, self._by_road(self.to_s, ~found))

    def _by_road(self, time_s: float, which: Flags) -> Floats:
        """Return the probability that the target is one of these and on each road, (R,)."""
        there = which & ~np.isnan(self.futures.positions(time_s)[:, 0])
        edge = self.futures.edges.at(time_s)
        there &= edge != NO_EDGE
        road, weight = self.network.edge_road[edge[there]], self.futures.weight[there]
        return np.asarray(np.bincount(road, weight, len(self.network.road_ids)), np.float64)

    def cloud(self, time_s: float) -> Cloud:
        """Return where the targets are at a time that are not found before it."""
        xy_m = self.futures.positions(time_s)
        there = ~np.isnan(xy_m[:, 0]) & (self.seen_at > time_s)
        return Cloud(time_s, xy_m[there], self.futures.weight[there])

    def on_edges(self, begin_s: float, end_s: float) -> Floats:
        """Return how long the target is on each edge and not found, (E,) expected seconds."""
        edge, from_s, to_s, weight = self._drives
        seconds = np.clip(np.minimum(to_s, end_s) - np.maximum(from_s, begin_s), 0.0, None)
        return np.asarray(
            np.bincount(edge, seconds * weight, len(self.network.edge_ids)), np.float64
        )

    @cached_property
    def _drives(self) -> tuple[Ints, Floats, Floats, Floats]:
        """Edges, from when to when a target is on them and not found, and how probable it is."""
        edges, futures = self.futures.edges, self.futures
        who = edges.particle
        leaves_s = np.append(edges.time_s[1:], np.inf)[: len(who)]
        leaves_s[edges.first_change[1:][np.diff(edges.first_change) > 0] - 1] = np.inf
        gone_s = np.where(futures.gone, futures.end_s, np.inf)
        to_s = np.minimum(leaves_s, np.minimum(gone_s, self.seen_at)[who])
        known = edges.edge != NO_EDGE
        return edges.edge[known], edges.time_s[known], to_s[known], futures.weight[who[known]]
