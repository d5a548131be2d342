"""A planning problem as a Gymnasium environment: one UAV, and each action is the next leg.

Only who asks for it needs Gymnasium: pip install 'sumo-search-planner[gym]'.
"""

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from planner.arrays import Floats
from planner.errors import NotApplicableError
from planner.flight.plan import Plan
from planner.futures.edges_driven import NO_EDGE
from planner.futures.state_at import state_at
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem, candidate_legs
from planner.search.state import SearchState
from planner.search.stepwise import after_flight, earned
from planner.search.what_if import WhatIf

Observation = dict[str, NDArray[np.float32]]
Step = tuple[Observation, float, bool, bool, dict[str, Any]]
ROUNDING = 1e-3  # by which float32 may leave the bounds of places, as a share of their extent


class RoadSearch(gym.Env[Observation, np.int64]):
    """Flies one UAV leg by leg against a problem's particles, exactly as planners simulate it.

    Actions are legs: ``2 * road`` along a road, ``2 * road + 1`` against it. Observations tell the
    ``time`` as a share of the horizon, (1,), the ``place`` of the UAV, (2,) metres, and the
    ``unseen`` probability that the target is on each road now and has not been seen, (roads,).
    Rewards are what the leg's new sightings are worth by the problem's objective, so that an
    episode's sum is the plan's. ``info["action_mask"]`` says which legs can be flown; another one
    ends the flight, as the time does. Nothing is left to chance: the belief is all particles.

    Raises
    ------
    NotApplicableError
        If the sensor misses what it sees, or the UAV does not fly at even speed and straight.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012  (as Gymnasium has it)

    def __init__(self, problem: Problem) -> None:
        if not problem.sensor.is_perfect or problem.uav.aircraft or problem.airspace:
            raise NotApplicableError(
                "RoadSearch flies the ideal aircraft with a perfect sensor and no airspace; set "
                "uav.aircraft=ideal and sensor.detects=1, and leave [airspace] out"
            )
        self.problem, self._engine = problem, WhatIf(problem)
        self._roads = len(problem.network.road_ids)
        self.state: SearchState = problem.first_state
        self.action_space = gym.spaces.Discrete(len(problem.legs))
        low_m, high_m = _extent(problem)
        spaces: Any = gym.spaces.Dict(
            {
                "time": gym.spaces.Box(0.0, 1.0, (1,), np.float32),
                "place": gym.spaces.Box(low_m, high_m, (2,), np.float32),
                "unseen": gym.spaces.Box(0.0, 1.0, (self._roads,), np.float32),
            }
        )
        self.observation_space = spaces

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Return what is observed before the first leg."""
        super().reset(seed=seed, options=options)
        self.state = self.problem.first_state
        return self._observation(), self._info()

    def step(self, action: np.int64 | int) -> Step:
        """Fly a leg; the flight is over when it cannot be flown, or no sighting pays any more."""
        if not self.action_mask()[action]:
            return self._observation(), 0.0, True, False, self._info()
        flights = self._engine.fly(self.state, np.array([action], dtype=np.int32))
        reward = float(earned(self.problem, self.state, flights)[0])
        self.state = after_flight(self.problem, self.state, flights, 0)
        is_over = not self.action_mask().any()
        return self._observation(), reward, is_over, False, self._info()

    def action_mask(self) -> NDArray[np.int8]:
        """Return which legs can be flown next, (L,) 1 or 0: those with a way home in time."""
        mask = np.zeros(len(self.problem.legs), dtype=np.int8)
        if self.state.time_s < self.problem.objective.ends_s:
            mask[candidate_legs(self.problem, self.state)] = 1
        return mask

    def gains(self) -> Floats:
        """Return the reward of each leg if it were flown next, (L,); -inf: it cannot be."""
        found = np.full(len(self.problem.legs), -np.inf)
        legs = np.flatnonzero(self.action_mask()).astype(np.int32)
        found[legs] = earned(self.problem, self.state, self._engine.fly(self.state, legs))
        return found

    def plan(self, name: str = "agent") -> Plan:
        """Return the flight so far as a plan, to be evaluated on fresh targets."""
        return plan_of_legs(self.problem, name, self.state.order)

    def _observation(self) -> Observation:
        at, horizon_s = self.state, self.problem.horizon_s
        time_s = min(at.time_s, horizon_s)
        belief = state_at(self.problem.futures, self.problem.network, time_s)
        known = belief.edge != NO_EDGE
        unseen = (belief.weight * at.miss[belief.particle])[known]
        road = self.problem.network.edge_road[belief.edge[known]]
        on_road = np.bincount(road, weights=unseen, minlength=self._roads)
        return {
            "time": np.array([time_s / horizon_s], dtype=np.float32),
            "place": np.array([at.x_m, at.y_m], dtype=np.float32),
            "unseen": np.clip(on_road, 0.0, 1.0).astype(np.float32),
        }

    def _info(self) -> dict[str, Any]:
        return {"action_mask": self.action_mask(), "time_s": self.state.time_s}


def _extent(problem: Problem) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the corners of where the UAV can be: between its start and all nodes, metres."""
    first = problem.first_state
    places = np.vstack([problem.legs.node_xy_m, [[first.x_m, first.y_m]]])
    low_m, high_m = places.min(axis=0), places.max(axis=0)
    spare_m = ROUNDING * (1.0 + high_m - low_m)
    return (low_m - spare_m).astype(np.float32), (high_m + spare_m).astype(np.float32)
