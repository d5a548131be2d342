"""False alarms: by chance, and where a car looks like the target."""

import numpy as np

from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.mission.alarms import Compared, by_chance, by_lookalikes


def test_by_chance_alarms_come_after_so_much_search() -> None:
    (track,) = [a_flight()]
    alarm = by_chance([100.0, 50.0])
    assert [alarm(track, now_s) for now_s in (10.0, 200.0, 400.0)] == [110.0, 250.0, np.inf]


def test_each_car_that_looks_like_the_target_is_checked_once() -> None:
    """Cars rest at 1,000 and 3,000 m of a straight flight at 10 m/s, another one far away."""
    flight = a_flight()
    cars = Futures(
        np.zeros(3),
        np.array([3000.0, 1000.0, 2000.0]),
        np.array([0.0, 0.0, 5000.0]),
        np.arange(4),
        np.full(3, 1 / 3),
        np.zeros(3, dtype=bool),
    )
    alarm = by_lookalikes(cars, 100.0)
    assert alarm(flight, 0.0) == 90.0
    # It has stood still for a minute meanwhile, where the car still is.
    late = flight.until(90.0).then(a_flight(150.0, 900.0))
    assert alarm(late, 150.0) == 350.0
    assert alarm(late, 410.0) == np.inf
    assert by_lookalikes(cars.take(np.zeros(0, dtype=np.int64)), 100.0)(flight, 0.0) == np.inf


def test_what_is_saved_is_a_ratio_of_means() -> None:
    found = Compared((100.0, 300.0), (80.0, 220.0))
    assert found.saved == 0.25
    low, high = found.interval
    assert low < 0.25 < high
    assert Compared((100.0,), (80.0,)).interval == (-np.inf, np.inf)


def a_flight(from_s: float = 0.0, from_m: float = 0.0) -> Track:
    time_s = np.array([from_s, from_s + 500.0])
    return Track(time_s, np.array([from_m, from_m + 5000.0]), np.zeros(2), time_s[None, :])
