"""What flights over free waypoints earn, one after the other, on the same particles."""

import numpy as np

from planner.arrays import Floats
from planner.detection.first_detection import columns
from planner.detection.kernels.closest_approach import Window
from planner.search.kernels.cells import grid_of
from planner.search.kernels.motion import fastest
from planner.search.kernels.waypoints import (
    LEFT,
    Bar,
    Change,
    FlightLimits,
    Surroundings,
    Unseen,
    WaypointFlight,
    sweep,
)
from planner.search.kernels.what_if import FirstSightings
from planner.search.problem import Problem
from planner.search.what_if import goal_of


class WaypointRewards:
    """Whoever asks it what flights earn: it looks up only particles near a flight."""

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
    uav, futures, objective = problem.uav_at_start, columns(problem.futures), problem.objective
    radius_m, ends_s = float(problem.sensor.radius_m), float(objective.ends_s)
    span = Window(float(uav.take_off_s), ends_s)
    grid = grid_of(futures, radius_m, float(fastest(futures)), span)
    home_x_m, home_y_m = (np.inf, np.inf) if uav.return_to_m is None else uav.return_to_m
    limits = FlightLimits(
        float(home_x_m), float(home_y_m), float(uav.landing_s), ends_s, float(uav.speed_mps)
    )
    return Surroundings(grid, radius_m, problem.weight_at_start, limits, goal_of(problem.objective))
