"""What a planner is asked: a network, futures on it, UAVs, and what counts as success."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from planner.arrays import Floats, Ints, Offsets, freeze
from planner.detection.objective import Objective
from planner.detection.track import Sensor
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork


@dataclass(frozen=True)
class Uav:
    """One UAV and when and where it takes off."""

    x_m: float
    y_m: float
    take_off_s: float  # seconds on the target's clock
    speed_mps: float
    altitude_m: float = 0.0  # above ground; carried through to plan.json
    max_flight_time_s: float = np.inf
    return_to_m: tuple[float, float] | None = None  # x, y where it has to land; None: anywhere

    @property
    def landing_s(self) -> float:
        """The latest time in the air, seconds on the target's clock."""
        return self.take_off_s + self.max_flight_time_s


@dataclass(frozen=True, eq=False)
class Problem:
    """One planning problem; a variant of it is a copy (``replace``).

    ``uavs`` has one entry so far.
    """

    network: RoadNetwork
    futures: Futures
    uavs: tuple[Uav, ...]
    sensor: Sensor
    horizon_s: float  # a target not seen by then counts as this much
    by_s: float | None = None  # None: least expected time; else most probably found by then
    judges: Futures | None = None  # other particles, on which plans are chosen between

    def replace(self, **changes: Any) -> "Problem":
        """Return a copy with some fields changed."""
        return replace(self, **changes)

    @property
    def objective(self) -> Objective:
        """What the search is for."""
        return Objective(self.horizon_s, self.by_s)

    @cached_property
    def home_s(self) -> Floats:
        """Seconds of flight from each node to where the UAV has to land, (V,); 0 if anywhere."""
        home = self.uavs[0].return_to_m
        if home is None:
            return np.zeros(len(self.network.node_ids))
        offset = self.network.node_xy_m - home
        return np.asarray(np.hypot(offset[:, 0], offset[:, 1]) / self.uavs[0].speed_mps)

    @cached_property
    def legs(self) -> "Legs":
        """The legs that a UAV can fly here: each road in both directions."""
        return Legs.of(self.network, self.uavs[0].speed_mps)

    @cached_property
    def world(self) -> Any:
        """The futures indexed by road and time, as the what-if engine's kernels take them."""
        from planner.search.what_if import world_of

        return world_of(self)


@dataclass(frozen=True)
class Budget:
    """How much a planner may do; in units of work, so that the same budget gives the same plan.

    A unit of work is one leg flown in thought, or what takes about as long: some microseconds.
    """

    roads: int = 16  # at most so many legs in the plan ("depth")
    work: int = 80_000  # what-if flights of methods that choose between many orders
    free: bool = False  # whether `best` may leave the roads
    stop: Callable[[], bool] = bool  # asked often; once it says so, the best so far is returned
    told: Callable[[float, int], None] | None = None  # hears the best value and the work done


@dataclass(frozen=True, eq=False)
class Legs:
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
    speed_mps: float  # of the UAV

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
        )

    @classmethod
    def of(cls, network: RoadNetwork, speed_mps: float) -> "Legs":
        """Return the legs of a network for a UAV of the given speed, m/s."""
        shapes = [network.shape(road) for road in range(len(network.road_ids))]
        turned = [points for shape in shapes for points in (shape, shape[::-1])]
        steps = [np.linalg.norm(np.diff(points, axis=0), axis=1) for points in turned]
        after = [np.concatenate(([0.0], np.cumsum(step))) / speed_mps for step in steps]
        ends = np.stack([network.road_from, network.road_to], axis=1)
        points = np.concatenate(turned)
        return cls(
            from_node=ends.ravel(),
            to_node=ends[:, ::-1].ravel(),
            duration_s=np.array([times[-1] for times in after]),
            first_point=np.concatenate(([0], np.cumsum([len(points) for points in turned]))),
            x_m=points[:, 0],
            y_m=points[:, 1],
            after_s=np.concatenate(after),
            node_xy_m=network.node_xy_m,
            speed_mps=speed_mps,
        )

    def __len__(self) -> int:
        return len(self.from_node)

    def transit_s(self, x_m: float, y_m: float) -> Floats:
        """Return the seconds of straight flight from a point to the start of each leg, (L,)."""
        offset = self.node_xy_m - (x_m, y_m)
        seconds = np.hypot(offset[:, 0], offset[:, 1]) / self.speed_mps
        return np.asarray(seconds[self.from_node])
