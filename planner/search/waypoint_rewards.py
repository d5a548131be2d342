"""What flights over free waypoints earn, one after the other, on the same particles."""

from weakref import WeakKeyDictionary

import numpy as np

from planner.arrays import Floats
from planner.detection.first_detection import columns
from planner.detection.kernels.closest_approach import Window
from planner.futures.futures import Futures
from planner.search.kernels.cells import SpaceTimeGrid, grid_of
from planner.search.kernels.motion import fastest
from planner.search.kernels.waypoint_pieces import FlightLimits
from planner.search.kernels.waypoints import (
    LEFT,
    Bar,
    Change,
    FirstSightings,
    Surroundings,
    Unseen,
    WaypointFlight,
    sweep,
)
from planner.search.problem import Problem
from planner.search.what_if import goal_of, turning_of

# The last grid that was made of futures, as long as they live: patterns tuned one after the other
# ask for the same one. Nothing ever changes it.
_grids: WeakKeyDictionary[Futures, tuple[tuple[float, Window], SpaceTimeGrid]]
_grids = WeakKeyDictionary()


class WaypointRewards:
    """Says what flights earn; it looks up only the particles near a flight."""

    def __init__(self, problem: Problem) -> None:
        self._uav, particles = problem.uav_at_start, len(problem.futures)
        self._around = surroundings(problem)
        self._rank = np.zeros(particles, dtype=np.int64)  # nobody is known as seen
        self._last_round = np.full(particles, -1)
        self._found = FirstSightings(np.zeros(particles, np.int32), np.zeros(particles))
        self._round = 0

    def of(self, waypoints: Floats) -> float:
        """Return the expected reward of the flight that ``plan_of_waypoints`` makes of these.

        Parameters
        ----------
        waypoints
            (W, 3): x and y in metres, and how long to hover there in seconds, less than forever.
        """
        self._round += 1
        many = len(waypoints) + 1
        flight = WaypointFlight(np.zeros((3, many)), np.zeros((4, many)), self._found)
        flight.way[:2, 0], flight.way[:, 1:] = (self._uav.x_m, self._uav.y_m), waypoints.T
        flight.marks[LEFT, 0] = self._uav.take_off_s
        everyone = Unseen(self._rank, self._last_round, 0, self._round)
        no_bar = Bar(-np.inf, 0.0, flight.marks, many)
        return float(sweep(flight, Change(many, 1), everyone, self._around, no_bar))


def surroundings(problem: Problem) -> Surroundings:
    """Return what a sweep has to know, as its kernel takes it."""
    uav, objective = problem.uav_at_start, problem.objective
    radius_m, ends_s = float(problem.sensor.radius_m), float(objective.ends_s)
    grid = _grid(problem.futures, radius_m, Window(float(uav.take_off_s), ends_s))
    home_x_m, home_y_m = (np.inf, np.inf) if uav.return_to_m is None else uav.return_to_m
    limits = FlightLimits(
        float(home_x_m),
        float(home_y_m),
        float(uav.landing_s - uav.turns_home_s),
        ends_s,
        float(uav.speed_mps),
        turning_of(problem.legs.law),
    )
    return Surroundings(
        grid, radius_m, problem.weight_at_start, limits, goal_of(problem, problem.futures)
    )


def _grid(futures: Futures, radius_m: float, span: Window) -> SpaceTimeGrid:
    known = _grids.get(futures)
    if known is None or known[0] != (radius_m, span):
        of = columns(futures)
        known = (radius_m, span), grid_of(of, radius_m, float(fastest(of)), span)
        _grids[futures] = known
    return known[1]
