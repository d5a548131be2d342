"""The legs that a UAV can fly on a network: each road in both directions."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Frozen, Ints, Offsets, first_of_parts, freeze
from planner.errors import InputError
from planner.flight.law import FlightLaw
from planner.flight.uav import Uav
from planner.network.road_network import RoadNetwork

AGAINST = "!"  # before the name of a road that is flown against its direction


@dataclass(frozen=True, eq=False)
class Legs(Frozen):
    """Each road flown in its own direction (leg ``2 * road``) and against it (one more).

    L = 2 R legs. Points are those of the roads, turned round for the reverse legs.
    """

    from_node: Ints  # (L,) node index
    to_node: Ints  # (L,) node index
    duration_s: Floats  # (L,) seconds to fly the road
    first_point: Offsets  # (L + 1,) where a leg's points start
    x_m: Floats  # (Q,) metres
    y_m: Floats  # (Q,) metres
    after_s: Floats  # (Q,) seconds of flight from the leg's start to the point
    node_xy_m: Floats  # (V, 2) metres
    home_s: Floats  # (V,) seconds of flight from a node to where the UAV has to land; 0: anywhere
    speed_mps: float  # of the UAV
    road_ids: tuple[str, ...]  # (R,)
    first_way: Floats  # (L, 2) unit vectors, in which direction legs begin; 0, 0: they go nowhere
    last_way: Floats  # (L, 2) and end
    law: FlightLaw  # by which corners delay the UAV

    def __post_init__(self) -> None:
        freeze(
            self,
            from_node=np.int32,
            to_node=np.int32,
            duration_s=np.float64,
            first_point=np.int64,
            x_m=np.float64,
            y_m=np.float64,
            after_s=np.float64,
            node_xy_m=np.float64,
            home_s=np.float64,
            first_way=np.float64,
            last_way=np.float64,
        )

    @classmethod
    def of(cls, network: RoadNetwork, uav: Uav) -> "Legs":
        """Return the legs of a network for a UAV."""
        shapes = [network.shape(road) for road in range(len(network.road_ids))]
        turned = [points for shape in shapes for points in (shape, shape[::-1])]
        law = FlightLaw(uav.speed_mps) if uav.aircraft is None else uav.aircraft.law
        after = [_after_s(points, law) for points in turned]
        ways = np.array([_ends(points) for points in turned])
        ends = np.stack([network.road_from, network.road_to], axis=1)
        points = np.concatenate(turned)
        return cls(
            from_node=ends.ravel(),
            to_node=ends[:, ::-1].ravel(),
            duration_s=np.array([times[-1] for times in after]),
            first_point=first_of_parts(turned),
            x_m=points[:, 0],
            y_m=points[:, 1],
            after_s=np.concatenate(after),
            node_xy_m=network.node_xy_m,
            home_s=uav.homeward_s(network.node_xy_m),
            speed_mps=uav.speed_mps,
            road_ids=network.road_ids,
            first_way=ways[:, 0],
            last_way=ways[:, 1],
            law=law,
        )

    def __len__(self) -> int:
        return len(self.from_node)

    @staticmethod
    def along(road: int) -> int:
        """Return the leg that flies a road in the road's own direction."""
        return 2 * road

    @staticmethod
    def both(road: int) -> tuple[int, int]:
        """Return the legs that fly a road: in its own direction, and against it."""
        return 2 * road, 2 * road + 1

    @staticmethod
    def road(leg: int) -> int:
        """Return the index of the road that a leg flies."""
        return leg // 2

    @staticmethod
    def reverse(leg: int) -> int:
        """Return the leg that flies the same road the other way."""
        return leg ^ 1

    @staticmethod
    def is_against(leg: int) -> bool:
        """Tell whether a leg flies its road against the road's own direction."""
        return leg % 2 == 1

    def ends(self, leg: int) -> tuple[int, int]:
        """Return the indices of the nodes at which a leg begins and ends."""
        return int(self.from_node[leg]), int(self.to_node[leg])

    def transit_s(self, x_m: float, y_m: float) -> Floats:
        """Return the seconds of straight flight from a point to the start of each leg, (L,)."""
        offset = self.node_xy_m - (x_m, y_m)
        seconds = np.hypot(offset[:, 0], offset[:, 1]) / self.speed_mps
        return np.asarray(seconds[self.from_node])

    def turns_s(self, x_m: float, y_m: float, before: int | None) -> Floats:
        """Return the seconds lost at the corners on the way to each leg, (L,); 0 if ideal.

        Parameters
        ----------
        before
            The leg that ends at the point; None: the UAV is at rest there.
        """
        if math.isinf(self.law.acceleration_mps2):
            return np.zeros(len(self))
        heading = np.zeros(2) if before is None else self.last_way[before]
        ways = unit(self.node_xy_m - (x_m, y_m))[self.from_node]
        ways[np.all(ways == 0.0, axis=1)] = heading
        headings = np.broadcast_to(heading, ways.shape)
        return np.asarray(
            self.law.corner_loss_s(headings, ways) + self.law.corner_loss_s(ways, self.first_way)
        )


def leg_ends(network: RoadNetwork, leg: int) -> tuple[str, str]:
    """Return the names of the nodes at which a leg begins and ends."""
    road = Legs.road(leg)
    ends = network.node_ids[network.road_from[road]], network.node_ids[network.road_to[road]]
    return (ends[1], ends[0]) if Legs.is_against(leg) else ends


def leg_names(network: RoadNetwork, legs: Iterable[int]) -> list[str]:
    """Return the names of legs, as `legs_named` reads them."""
    return [AGAINST * Legs.is_against(leg) + network.road_ids[Legs.road(leg)] for leg in legs]


def legs_named(network: RoadNetwork, names: Iterable[str]) -> list[int]:
    """Return the legs with these names: those of roads, after a ``!`` where flown against.

    Raises
    ------
    InputError
        If one is no road of the network.
    """
    legs: list[int] = []
    for name in names:
        road = network.road_index.get(name.removeprefix(AGAINST))
        if road is None:
            raise InputError(f"{name}: is not a road of {network.path.name}; correct the plan")
        legs.append(Legs.both(road)[name.startswith(AGAINST)])
    return legs


def _after_s(points: Floats, law: FlightLaw) -> Floats:
    """Return when the points of a polyline are passed, (k,) seconds, corners counted."""
    steps = np.diff(points, axis=0)
    after_s = np.concatenate(([0.0], np.cumsum(np.linalg.norm(steps, axis=1)))) / law.speed_mps
    if math.isinf(law.acceleration_mps2):
        return after_s
    moves = np.append(True, steps.any(axis=1))
    ways = unit(steps[moves[1:]])
    lost_s = np.zeros(len(points))
    lost_s[np.flatnonzero(moves)[2:]] = law.corner_loss_s(ways[:-1], ways[1:])
    return np.asarray(after_s + np.cumsum(lost_s))


def _ends(points: Floats) -> tuple[Floats, Floats]:
    """Return in which direction a polyline begins and ends, each (2,)."""
    ways = unit(np.diff(points, axis=0))
    moves = ways[ways.any(axis=1)]
    return (moves[0], moves[-1]) if len(moves) else (np.zeros(2), np.zeros(2))


def unit(offset: Floats) -> Floats:
    """Return the directions of vectors, (..., 2); 0, 0 of those of no length."""
    length = np.hypot(offset[..., 0], offset[..., 1])[..., None]
    return np.divide(offset, length, out=np.zeros(np.shape(offset)), where=length > 0.0)
