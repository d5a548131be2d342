"""What no flight surpasses, and who has left by when, against the slow way and by hand."""

import numpy as np
import pytest

from planner.detection.chase import chased_alone
from planner.detection.objective import Objective
from planner.detection.prospects import gone_by, prospects
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from support.search_instances import strayed

STEP_S = 0.5


def first_tick_in_reach(futures: Futures, particle: int, uav: Uav, radius_m: float) -> float:
    """The first of many close moments at which a particle lies within what can be reached."""
    moments_s = np.arange(uav.take_off_s, 3000.0, STEP_S)
    away_m = np.hypot(*(futures.xy(particle, moments_s) - (uav.x_m, uav.y_m)).T)
    reach_m = radius_m + uav.speed_mps * (moments_s - uav.take_off_s)
    inside = away_m <= reach_m  # false where it is nowhere
    return float(moments_s[np.argmax(inside)]) if inside.any() else np.inf


@pytest.mark.parametrize("seed", range(6))
def test_nobody_is_chased_down_sooner_or_later_than_step_by_step(seed: int) -> None:
    rng = np.random.default_rng(seed)
    futures = strayed(rng, 30)
    uav = Uav(x_m=500.0, y_m=-2000.0, take_off_s=float(rng.uniform(0, 400)), speed_mps=14.0)
    exact_s = chased_alone(futures, uav, Sensor(60.0))
    for particle, seen_s in enumerate(exact_s.tolist()):
        tick_s = first_tick_in_reach(futures, particle, uav, 60.0)
        if np.isfinite(tick_s):
            assert tick_s - STEP_S - 1e-6 <= seen_s <= tick_s + 1e-6
    assert np.isfinite(exact_s).any()


def test_who_has_left_by_when() -> None:
    """One drives off at 400 s, one is cut at the horizon, one rests, one was never there."""
    futures = Futures(
        time_s=[0.0, 400.0, 0.0, 1000.0, 0.0, 10.0],
        x_m=[0.0, 4000.0, 0.0, 1000.0, 0.0, 1e6],
        y_m=[0.0] * 6,
        first_knot=[0, 2, 4, 6, 6],
        weight=[0.3, 0.3, 0.2, 0.2],
        gone=[True, True, False, True],
    )
    assert [gone_by(futures, time_s) for time_s in (300.0, 400.5, 1000.0)] == [0.0, 0.3, 0.3]
    uav = Uav(x_m=0.0, y_m=0.0, take_off_s=200.0, speed_mps=20.0)
    found = prospects(futures, [uav], Sensor(50.0), Objective(1000.0))
    assert found.gone_by == ((300.0, 0.0), (600.0, 0.3))
    assert found.many_leave
    # Ahead by 2,000 and 200 m at take-off; the UAV gains 10 and 19 m/s. The third: too late.
    assert found.ceiling.seen_at == pytest.approx([395.0, 200.0 + 150.0 / 19.0, 50197.5, np.inf])
    assert found.ceiling.detection_probability == pytest.approx(0.6)
