"""What a flight that has seen nothing says of the target, by hand."""

from dataclasses import replace

import numpy as np
import pytest

from planner.arrays import Floats
from planner.detection.evaluation import Evaluation
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.mission.debrief import still_unseen
from planner.report.debrief import Apart

# Three that stand still, the third one twice as likely as each other; in a fifth of all cases there
# is no target.
STANDING = Futures(
    time_s=np.zeros(3),
    x_m=np.array([0.0, 1000.0, 2000.0]),
    y_m=np.zeros(3),
    first_knot=np.arange(4),
    weight=np.array([0.2, 0.2, 0.4]),
    gone=np.zeros(3, dtype=bool),
)
SENSOR = Sensor(60.0)
# Along them at 10 m/s, with the sensor on past the second one: it sees the first and the third.
TRACK = Track(
    np.array([0.0, 300.0]),
    np.array([0.0, 3000.0]),
    np.zeros(2),
    np.array([[0.0, 50.0], [150.0, 300.0]]),
)


def test_what_would_have_been_seen_is_ruled_out_and_the_rest_is_likelier() -> None:
    left = still_unseen(STANDING, TRACK, SENSOR, 300.0)
    assert left.x_m.tolist() == [1000.0]
    assert left.weight.tolist() == pytest.approx([0.2 / 0.4])  # the other half: there is none
    half_way = still_unseen(STANDING, TRACK, SENSOR, 100.0)
    assert half_way.weight.tolist() == pytest.approx([0.2 / 0.8, 0.4 / 0.8])
    before = still_unseen(STANDING, TRACK, SENSOR, -1.0)
    assert before.weight.tolist() == STANDING.weight.tolist()


def test_it_is_as_many_draws_say() -> None:
    rng = np.random.default_rng(1)
    drawn = rng.choice(4, 100_000, p=[*STANDING.weight, 0.2])  # 3: no target
    not_seen = drawn[(drawn == 1) | (drawn == 3)]
    left = still_unseen(STANDING, TRACK, SENSOR, 300.0)
    assert np.mean(not_seen == 1) == pytest.approx(left.weight[0], abs=0.01)


def test_nothing_is_left_of_those_that_were_all_seen() -> None:
    certain = replace(STANDING, weight=np.array([0.25, 0.25, 0.5]))
    everything = replace(TRACK, sensor_on=np.array([[0.0, 300.0]]))
    assert len(still_unseen(certain, everything, SENSOR, 300.0)) == 0


def weighted(weight: Floats) -> Evaluation:
    """Return an evaluation of so many targets, of whom nobody asks when they are found."""
    when_s = np.zeros(len(weight))
    return Evaluation(when_s, weight, when_s, Objective(300.0))


def test_pairs_are_held_against_each_other() -> None:
    one, other = np.array([3.0, 5.0, 4.0, 8.0]), np.array([1.0, 2.0, 3.0, 4.0])
    apart = Apart.of(weighted(np.full(4, 0.25)), one, other)
    error = np.std(one - other, ddof=1) / 2.0
    assert apart == pytest.approx((2.5, 2.5 - 1.96 * error, 2.5 + 1.96 * error), abs=1e-3)
    assert Apart.of(weighted(np.zeros(4)), one, other) == (0.0, 0.0, 0.0)
    assert np.isinf(Apart.of(weighted(np.ones(1)), one[:1], other[:1]).high)
