"""What a planner is asked: a network, futures on it, a UAV, and what counts as success."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from planner.arrays import Floats, Ints
from planner.checked import choice, flag, indices, instance, lengths, set_fields, whole
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.detection.survival import Searched
from planner.flight.airspace import Airspace
from planner.flight.legs import Legs
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork
from planner.progress import Progress, silent
from planner.search.state import SearchState
from planner.search.stop import NEVER, Stop

Directions = Literal["own", "both", "nearest end"]


@dataclass(frozen=True, eq=False)
class Problem:
    """One planning problem: where to fly one UAV. Copy it with ``replace`` to vary it."""

    network: RoadNetwork
    futures: Futures
    uav: Uav
    sensor: Sensor
    objective: Objective
    holdout: Futures | None = None  # other particles to choose plans on; none may be seen yet
    # many particles that have not been driven by SUMO, to search on before plans are chosen
    proposals: Futures | None = None
    start: SearchState | None = None  # where the search stands; None: before take-off
    flown: tuple[Searched, ...] = ()  # flights of others that are decided, still to come or not
    airspace: Airspace | None = None  # where the UAV may fly; None: anywhere
    others: tuple[Uav, ...] = ()  # UAVs of the same fleet, for what all together can do at best

    def __post_init__(self) -> None:
        kinds = {
            "network": RoadNetwork,
            "futures": Futures,
            "uav": Uav,
            "sensor": Sensor,
            "objective": Objective,
        }
        for name, kind in kinds.items():
            instance(name, getattr(self, name), kind)
        if self.start is not None:
            lengths(len(self.futures), start=self.start.seen_at)

    def replace(self, **changes: Any) -> "Problem":
        """Return a copy with some fields changed."""
        return replace(self, **changes)

    @property
    def uavs(self) -> tuple[Uav, ...]:
        """All UAVs of the fleet, its own first."""
        return (self.uav, *self.others)

    @property
    def flying(self) -> tuple[Uav, ...]:
        """Those of the fleet that fly from now on."""
        return tuple(uav for uav in self.uavs if uav.sorties)

    @property
    def horizon_s(self) -> float:
        """What a target not found by then counts as, seconds; the search ends there."""
        return self.objective.horizon_s

    @cached_property
    def first_state(self) -> SearchState:
        """The state from which every planner starts."""
        if self.start is not None:
            return self.start
        unseen = np.full(len(self.futures), np.inf)
        uav = self.uav.at_height
        return SearchState.of_sightings(uav.take_off_s, uav.x_m, uav.y_m, unseen)

    @cached_property
    def uav_at_start(self) -> Uav:
        """The UAV as it flies on from the first state, at its height."""
        at, uav = self.start, self.uav.at_height
        return uav if at is None else uav.resumed(at.time_s, at.x_m, at.y_m)

    @cached_property
    def weight_at_start(self) -> Floats:
        """Probability that the target is a particle, still unseen in the first state, (N,)."""
        return self.futures.weight * self.first_state.miss

    @cached_property
    def legs(self) -> Legs:
        """The legs that the UAV can fly here: each road in both directions."""
        return Legs.of(self.network, self.uav)


@dataclass(frozen=True)
class Budget:
    """How much a planner may do; in units of work, so that the same budget gives the same plan.

    A unit of work is one simulated leg, or what takes about as long: some microseconds.
    """

    roads: int = 16  # at most so many legs in the plan ("depth")
    work: int = 80_000  # what-if flights of methods that choose between many orders
    free: bool = False  # whether `best` may leave the roads
    stop: Stop = NEVER  # asked often; once it says so, the best so far is returned
    on_progress: Progress = silent  # is given the work done, all work, and the best value

    def __post_init__(self) -> None:
        counts = {name: whole(name, getattr(self, name)) for name in ("roads", "work")}
        set_fields(self, {**counts, "free": flag("free", self.free)})

    def part(self, work: int, *, after: int = 0) -> "Budget":
        """Return the budget of a part of a search over roads, begun after some units of work."""

        def on_progress(done: int, total: int, note: str = "", /) -> None:  # noqa: ARG001
            self.on_progress(after + done, self.work, note)

        return replace(self, work=work, free=False, on_progress=on_progress)


def candidate_legs(
    problem: Problem,
    state: SearchState,
    *,
    directions: Directions = "both",
    removed: Sequence[int] | frozenset[int] = frozenset(),
) -> Ints:
    """Return the legs that may be flown next, (C,) rising leg indices.

    Parameters
    ----------
    directions
        Each road in its "own" direction, in "both", or from its "nearest end", seen from the
        UAV's place (the own direction if both are equally near). A road that targets drive both
        ways has two directions of its own.
    removed
        Roads that are not flown any more. Legs from whose end the UAV could not come home
        before its landing never are.
    """
    legs = problem.legs
    choice("directions", directions, Directions)
    removed = [whole("removed", road) for road in removed]
    indices(len(legs) // 2, removed=np.array(removed, dtype=np.int64))
    transit_s = state.to_legs_s(legs)
    end_s = state.time_s + transit_s + legs.duration_s
    allowed = end_s + legs.home_s[legs.to_node] <= problem.uav.at_height.landing_s
    allowed[[leg for road in removed for leg in Legs.both(road)]] = False
    if directions == "own":
        allowed[1::2] &= problem.network.both_ways
    elif directions == "nearest end":
        reverse = transit_s[1::2] < transit_s[::2]
        allowed[::2] &= ~reverse
        allowed[1::2] &= reverse
    return np.flatnonzero(allowed).astype(np.int32)
