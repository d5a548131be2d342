"""Which places are near a road: looked up on a grid, as many as there may be."""

import numpy as np

from planner.arrays import Flags, Floats, Ints
from planner.network.road_network import RoadNetwork

NEAR_M = 1000.0
PART = 0.02  # of a net's extent: as near as that is near enough


class Nearness:
    """The squares of a grid that hold a road, and those beside them."""

    def __init__(self, network: RoadNetwork) -> None:
        self.low_m = network.edge_shape_xy_m.min(axis=0)
        self.high_m = network.edge_shape_xy_m.max(axis=0)
        self.extent_m = float((self.high_m - self.low_m).max())
        self.near_m = max(NEAR_M, PART * self.extent_m)
        x, y = self._cells(*_points(network, self.near_m / 2).T)
        # Two squares beyond on each side: those beside roads, and those that are near none.
        near = np.zeros((x.max() + 3, y.max() + 3), dtype=bool)
        for right in (-1, 0, 1):
            for up in (-1, 0, 1):
                near[x + right, y + up] = True
        self._near = near

    def _cells(self, x_m: Floats, y_m: Floats) -> tuple[Ints, Ints]:
        cells = [
            np.clip((column - low) // self.near_m + 2, 0, 1e6).astype(np.intp)
            for column, low in ((x_m, self.low_m[0]), (y_m, self.low_m[1]))
        ]
        return cells[0], cells[1]

    def near(self, x_m: Floats, y_m: Floats) -> Flags:
        """Return which places, in metres, are within about ``near_m`` of a road, (k,)."""
        x, y = self._cells(x_m, y_m)
        inside = (x < self._near.shape[0]) & (y < self._near.shape[1])
        return np.asarray(inside & self._near[np.where(inside, x, 0), np.where(inside, y, 0)])

    def holds(self, x_m: Floats, y_m: Floats) -> bool:
        """Return whether all places are in the rectangle around the roads, or near it."""
        return all(
            column.min() >= low - self.near_m and column.max() <= high + self.near_m
            for column, low, high in zip((x_m, y_m), self.low_m, self.high_m, strict=True)
        )


def _points(network: RoadNetwork, step_m: float) -> Floats:
    """Return points on all edges, at most a step apart, (k, 2) metres."""
    length_m = network.edge_lines.length_m
    count = np.ceil(length_m / step_m).astype(np.int64) + 1
    edge = np.repeat(np.arange(len(count)), count)
    nth = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    share = nth / np.maximum(count - 1, 1)[edge]
    return network.edge_lines.at(edge, share * length_m[edge])


def off_edges(network: RoadNetwork, edge: Ints, x_m: Floats, y_m: Floats) -> Floats:
    """Return how far each place lies from the nearest point of its own edge, (k,) metres."""
    places_m = np.stack([x_m, y_m], axis=1)
    return network.edge_lines.off(edge, places_m, places_m)
