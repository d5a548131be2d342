"""Hops: the movements from node to node that the flight of every road plan consists of."""

from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Frozen, Ints, Offsets, freeze
from planner.bounds.kernels.meetings import Motion
from planner.flight.legs import Legs


@dataclass(frozen=True, eq=False)
class Hops(Frozen):
    """All legs in leg order, then the straight flights between nodes that are no legs.

    After its first flight, any road plan is a chain of hops. Straight flights along a straight
    road or over a node between their ends are left out: they are that leg, or two hops. Between
    two nodes at one place there is a flight of no length.
    """

    from_node: Ints  # (h,) node index
    to_node: Ints  # (h,) node index
    duration_s: Floats  # (h,) seconds
    first_point: Offsets  # (h + 1,) where a hop's points start
    after_s: Floats  # (Q,) seconds from the hop's start
    x_m: Floats  # (Q,) metres
    y_m: Floats  # (Q,) metres
    legs: int  # the first so many are legs; the others see only if the sensor is on in transit

    def __post_init__(self) -> None:
        freeze(
            self,
            from_node=np.int64,
            to_node=np.int64,
            duration_s=np.float64,
            first_point=np.int64,
            after_s=np.float64,
            x_m=np.float64,
            y_m=np.float64,
        )

    def __len__(self) -> int:
        return len(self.from_node)

    def motion(self, hop: int) -> Motion:
        """Return how a hop is flown, by seconds after its start."""
        points = slice(self.first_point[hop], self.first_point[hop + 1])
        after_s, x_m, y_m = self.after_s[points], self.x_m[points], self.y_m[points]
        lasts_s = np.diff(after_s)
        moves = lasts_s > 0.0
        return Motion(
            from_s=after_s[:-1][moves],
            to_s=after_s[1:][moves],
            x_m=x_m[:-1][moves],
            y_m=y_m[:-1][moves],
            vx_mps=np.diff(x_m)[moves] / lasts_s[moves],
            vy_mps=np.diff(y_m)[moves] / lasts_s[moves],
        )


def hops_of(legs: Legs) -> Hops:
    """Return the hops of all plans that fly these legs."""
    flights = straight_flights(legs)
    ends = np.array(flights, dtype=np.int64).reshape(-1, 2)
    place = legs.node_xy_m[ends]  # (flights, 2, 2)
    lasts_s = np.linalg.norm(place[:, 1] - place[:, 0], axis=1) / legs.speed_mps
    after_s = np.stack([np.zeros(len(ends)), lasts_s], axis=1).ravel()
    further = legs.first_point[-1] + 2 * np.arange(1, len(ends) + 1)
    return Hops(
        from_node=np.concatenate([legs.from_node, ends[:, 0]]),
        to_node=np.concatenate([legs.to_node, ends[:, 1]]),
        duration_s=np.concatenate([legs.duration_s, lasts_s]),
        first_point=np.concatenate([legs.first_point, further]),
        after_s=np.concatenate([legs.after_s, after_s]),
        x_m=np.concatenate([legs.x_m, place[:, :, 0].ravel()]),
        y_m=np.concatenate([legs.y_m, place[:, :, 1].ravel()]),
        legs=len(legs),
    )


def straight_flights(legs: Legs) -> list[tuple[int, int]]:
    """Return the ordered pairs of nodes whose straight flight is neither a leg nor two hops."""
    xy, straight = legs.node_xy_m, np.diff(legs.first_point) == 2
    ends = np.stack([legs.from_node, legs.to_node], axis=1)[straight]
    roads = set(map(tuple, ends.tolist()))
    return [
        (a, b)
        for a in range(len(xy))
        for b in range(len(xy))
        if a != b and (a, b) not in roads and not passes_over(xy, xy[a], xy[b])
    ]


def passes_over(nodes_m: Floats, start_m: Floats, end_m: Floats) -> bool:
    """Tell whether a straight flight passes over a node between its ends, all x, y in metres."""
    way, away = end_m - start_m, nodes_m - start_m
    far_m = float(np.hypot(*way))
    if far_m == 0.0:
        return False
    along, aside = away @ way / far_m, np.abs(away @ (-way[1], way[0])) / far_m
    between = (along > 1e-6 * far_m) & (along < (1 - 1e-6) * far_m)
    return bool(np.any(between & (aside < 1e-9 * far_m)))
