"""Routes that a user knows, each with its probability."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.arrays import Flags, Floats, Frozen, Ints, Offsets, first_of_parts, freeze, rows_taken
from planner.belief.route_edges import route_edges
from planner.checked import offsets, weights
from planner.network.road_network import RoadNetwork


@dataclass(frozen=True, eq=False)
class KnownRoutes(Frozen):
    """Routes of a net, in which each edge leads to the next."""

    first: Offsets  # (K + 1,) where a route starts in edge
    edge: Ints  # (M,) edge indices, one route after the other
    probability: Floats  # (K,) sums to one

    def __post_init__(self) -> None:
        freeze(self, first=np.int64, edge=np.int32, probability=np.float64)
        offsets("first", self.first, len(self.probability), len(self.edge))
        weights("probability", self.probability)

    @classmethod
    def of(
        cls, given: Mapping[tuple[str, ...], float], network: RoadNetwork, path: Path
    ) -> "KnownRoutes":
        """Return routes given by the names of their edges, each with its weight.

        Raises
        ------
        InputError
            If an edge is not in the network, or leads nowhere where a route goes; the file's path
            stands in the text.
        """
        remedy = "make the routes with duarouter on this net"
        routes = [route_edges(names, network, where=str(path), remedy=remedy) for names in given]
        weight = np.array(list(given.values()))
        return cls(first_of_parts(routes), np.concatenate(routes), weight / weight.sum())

    def passes(self, edges: int) -> Flags:
        """Return which of so many edges are on a route that is taken at all, (E,)."""
        found = np.zeros(edges, bool)
        found[self.edge[np.repeat(self.probability > 0, np.diff(self.first))]] = True
        return found

    def onward(self, start: Offsets, u: Floats) -> tuple[Offsets, Ints]:
        """Return where the routes begin, and their edges, of targets that are on some route.

        Parameters
        ----------
        start
            (N,) the edges on which they are.
        u
            (N,) the shares of the routes by that edge, from 0 up to but not including 1.
        """
        route = np.repeat(np.arange(len(self.probability)), np.diff(self.first))
        # The first time only that a route comes by an edge.
        _, place = np.unique(
            np.column_stack((self.edge, route)), axis=0, return_index=True
        )  # by edge, and then by route
        probability = self.probability[route[place]]
        place, probability = place[probability > 0], probability[probability > 0]
        edge = self.edge[place].astype(np.int64)
        total = np.concatenate(([0.0], np.cumsum(probability)))
        begins = np.searchsorted(edge, start)
        ends = np.searchsorted(edge, start, side="right")
        sought = total[begins] + u * (total[ends] - total[begins])
        row = np.clip(np.searchsorted(total, sought, side="right") - 1, begins, ends - 1)
        taken = place[row]
        after = self.first[route[taken] + 1]
        rows, first = rows_taken(np.append(0, np.cumsum(after - taken)), np.arange(len(taken)))
        shift = np.repeat(taken - first[:-1], after - taken)
        return first, self.edge[rows + shift]
