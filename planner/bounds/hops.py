"""Movements from node to node, of which the flight of every road plan is made up."""

from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Ints, Offsets, freeze
from planner.flight.legs import Legs
from planner.search.problem import Problem

Segments = list[tuple[float, float, float, float, float, float]]


@dataclass(frozen=True, eq=False)
class Hops:
    """All legs in leg order, then the straight flights between nodes that are no legs.

    Any road plan is, after its first flight, a chain of them. A straight flight that a straight
    road makes too, or that passes over a node between its ends, is left out: it is that leg, or
    two hops.
    """

    from_node: Ints  # (h,) node index
    to_node: Ints  # (h,) node index
    duration_s: Floats  # (h,) seconds
    first_point: Offsets  # (h + 1,) where a hop's points start
    after_s: Floats  # (Q,) seconds from the hop's start
    x_m: Floats  # (Q,) metres
    y_m: Floats  # (Q,) metres
    legs: int  # so many are legs; the others see only if the sensor is on in transit

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

    def wide(self, hop: int, slack_s: float) -> Floats:
        """Return the hop's segments, resting at both ends for ``slack_s`` seconds more, (S, 6).

        Columns: from and to, seconds after the hop's start; place at from; velocity.
        """
        end_s, rests = self.duration_s[hop], (0.0, 0.0)
        start, end = self.first_point[hop], self.first_point[hop + 1] - 1
        before = (-slack_s, 0.0, self.x_m[start], self.y_m[start], *rests)
        after = (end_s, end_s + slack_s, self.x_m[end], self.y_m[end], *rests)
        return np.array([before, *self._flown(hop), after], dtype=np.float64)

    def core(self, hop: int, slack_s: float) -> Floats:
        """Return the hop's segments without the first and last ``slack_s`` seconds, (S, 6)."""
        end_s = self.duration_s[hop] - slack_s
        cut: Segments = []
        for from_s, to_s, x, y, vx, vy in self._flown(hop):
            later_s = max(from_s, slack_s)
            if later_s < min(to_s, end_s):
                place = (x + vx * (later_s - from_s), y + vy * (later_s - from_s))
                cut.append((later_s, min(to_s, end_s), *place, vx, vy))
        return np.array(cut, dtype=np.float64).reshape(-1, 6)

    def _flown(self, hop: int) -> Segments:
        flown: Segments = []
        for i in range(self.first_point[hop], self.first_point[hop + 1] - 1):
            lasts_s = self.after_s[i + 1] - self.after_s[i]
            if lasts_s > 0.0:
                vx, vy = (float(c[i + 1] - c[i]) / lasts_s for c in (self.x_m, self.y_m))
                span = (float(self.after_s[i]), float(self.after_s[i + 1]))
                flown.append((*span, float(self.x_m[i]), float(self.y_m[i]), vx, vy))
        return flown


def hops_of(problem: Problem) -> Hops:
    """Return the movements of a problem's road plans."""
    legs = problem.legs
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
        if np.any(xy[a] != xy[b]) and (a, b) not in roads and not passes_over(xy, xy[a], xy[b])
    ]


def passes_over(nodes_m: Floats, start_m: Floats, end_m: Floats) -> bool:
    """Tell whether a straight flight passes over a node between its ends, all x, y in metres."""
    way, away = end_m - start_m, nodes_m - start_m
    far_m = float(np.hypot(*way))
    along, aside = away @ way / far_m, np.abs(away @ (-way[1], way[0])) / far_m
    between = (along > 1e-6 * far_m) & (along < (1 - 1e-6) * far_m)
    return bool(np.any(between & (aside < 1e-9 * far_m)))
