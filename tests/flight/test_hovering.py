"""Where a plan would fly to and fro on one short road, a real aircraft hovers over its middle."""

from dataclasses import replace

import numpy as np
import pytest

from planner.flight.hovering import hovering
from planner.flight.law import Aircraft, FlightLaw
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from support.search_instances import random_problem


def problem_on_roads(acceleration_mps2: float) -> Problem:
    """The roads of Figure 3, some of them short to a slow starter."""
    problem = random_problem(1)
    law = FlightLaw(25.0, acceleration_mps2, 2.0)
    uav = replace(problem.uav, speed_mps=25.0, aircraft=Aircraft(law))
    sensor = replace(problem.sensor, detects_in_transit=True)
    return problem.replace(uav=uav, sensor=sensor)


@pytest.mark.parametrize(
    ("order", "flown"),
    [
        ([0, 1, 0], [0]),
        ([0, 1, 0, 1], [0, 1]),
        ([4, 0, 1, 0, 1, 0, 3], [4, 0, 3]),
        ([0, 1], [0, 1]),  # out and back
        ([0, 0, 0], [0, 0, 0]),  # the same way each time
        ([2, 4, 2, 4], [2, 4, 2, 4]),
    ],
)
def test_runs_on_a_short_road_become_one_flight(order: list[int], flown: list[int]) -> None:
    legs = problem_on_roads(0.01).legs
    found = hovering(legs, order, 0.0)
    assert [one.leg for one in found] == flown
    saved = len(order) - len(flown)
    turn_s = legs.law.speed_mps / legs.law.acceleration_mps2
    assert sum(one.hover_s for one in found) == pytest.approx(
        saved * (legs.duration_s[0] + turn_s) if saved else 0.0
    )


def test_a_long_road_is_flown() -> None:
    legs = problem_on_roads(5.0).legs
    assert [one.leg for one in hovering(legs, [0, 1, 0, 1], 1.0)] == [0, 1, 0, 1]
    length_m = float(legs.duration_s[0]) * legs.law.speed_mps
    assert [one.leg for one in hovering(legs, [0, 1, 0, 1], length_m / 2)] == [0, 1]


def test_it_stays_over_the_middle_of_the_road() -> None:
    problem = problem_on_roads(5.0)
    legs = problem.legs
    half_m = float(legs.duration_s[0]) * legs.law.speed_mps / 2.0
    wide = problem.replace(sensor=replace(problem.sensor, radius_m=half_m))
    plan = plan_of_legs(wide, "any", [0, 1, 0, 1, 0, 4])
    (track,), (flown,) = plan.tracks, plan.legs
    assert [leg.leg for leg in flown] == [0, 4]
    stays = np.flatnonzero(
        (np.diff(track.x_m) == 0.0) & (np.diff(track.y_m) == 0.0) & (np.diff(track.time_s) > 1.0)
    )
    (stop,) = stays.tolist()
    assert flown[0].start_s < track.time_s[stop] < track.time_s[stop + 1] < flown[0].end_s
    ends = legs.node_xy_m[[legs.from_node[0], legs.to_node[0]]]
    assert track.x_m[stop] == pytest.approx(ends[:, 0].mean())
    assert track.y_m[stop] == pytest.approx(ends[:, 1].mean())
