"""Where the target is, road by road, before and after a flight, and at all times in between."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.survival import Survival
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
    survival: Survival | None = None  # where a sensor may miss, in place of `seen_at`

    @cached_property
    def roads(self) -> RoadOdds:
        """What the flight does for each road."""
        weight, unseen = self.futures.weight, self._unseen(self.to_s)
        before = self._by_road(self.from_s, weight)
        pos = self._by_road(self.from_s, weight * (1.0 - unseen))
        pod = np.divide(pos, before, out=np.zeros_like(pos), where=before > 0.0)
        return RoadOdds(before, pod, pos, self._by_road(self.to_s, weight * unseen))

    def _unseen(self, time_s: float) -> Floats:
        """Return how probably each target is not found after a time, (N,)."""
        if self.survival is not None:
            return self.survival.at(time_s)
        return np.asarray(self.seen_at > time_s, dtype=np.float64)

    def _by_road(self, time_s: float, each: Floats) -> Floats:
        """Return the probability that the target is on each road, (R,); ``each`` is (N,)."""
        there = ~np.isnan(self.futures.positions(time_s)[:, 0])
        edge = self.futures.edges.at(time_s)
        there &= edge != NO_EDGE
        road, weight = self.network.edge_road[edge[there]], each[there]
        return np.asarray(np.bincount(road, weight, len(self.network.road_ids)), np.float64)

    def cloud(self, time_s: float) -> Cloud:
        """Return where the targets are at a time that are not found before it."""
        xy_m = self.futures.positions(time_s)
        unseen = self._unseen(time_s)
        there = ~np.isnan(xy_m[:, 0]) & (unseen > 0.0)
        return Cloud(time_s, xy_m[there], self.futures.weight[there] * unseen[there])

    def on_edges(self, begin_s: float, end_s: float) -> Floats:
        """Return how long the target is on each edge and not found, (E,) expected seconds."""
        edge, from_s, to_s, who = self._drives
        from_s, to_s = np.maximum(from_s, begin_s), np.minimum(to_s, end_s)
        weight, seconds = self.futures.weight[who], np.clip(to_s - from_s, 0.0, None)
        if self.survival is not None:
            some = seconds > 0.0
            until = [self.survival.lasts_s(time_s[some], who[some]) for time_s in (from_s, to_s)]
            seconds[some] = until[1] - until[0]
        return np.asarray(
            np.bincount(edge, seconds * weight, len(self.network.edge_ids)), np.float64
        )

    @cached_property
    def _drives(self) -> tuple[Ints, Floats, Floats, Ints]:
        """Edges, from when to when a target is on them and not found for certain, and which."""
        edges, futures = self.futures.edges, self.futures
        who = edges.particle
        leaves_s = np.append(edges.time_s[1:], np.inf)[: len(who)]
        leaves_s[edges.first_change[1:][np.diff(edges.first_change) > 0] - 1] = np.inf
        gone_s = np.where(futures.gone, futures.end_s, np.inf)
        over_s = gone_s if self.survival is not None else np.minimum(gone_s, self.seen_at)
        to_s, known = np.minimum(leaves_s, over_s[who]), edges.edge != NO_EDGE
        return edges.edge[known], edges.time_s[known], to_s[known], who[known]
