"""What is told of a real aircraft's plan: its figures, its corners, and what timing costs."""

from io import StringIO

import numpy as np
import pytest

from planner.cli.printing import console
from planner.detection.evaluate import evaluate
from planner.detection.mistimed import TIMINGS, Timing, mistimed
from planner.flight.track import Track
from planner.report.real_flight import aircraft_line, corners_line, timing_table
from planner.report.tables import FRESH
from planner.scenario.draft import read_scenario
from planner.search.plan import plan_of_legs
from support.search_instances import random_problem


def test_a_track_at_another_pace_and_later() -> None:
    track = Track([100.0, 140.0, 200.0], [0.0, 0.0, 9.0], [0.0] * 3, [[140.0, 200.0]])
    slow = Timing(pace=1.5).of(track)
    assert slow.time_s.tolist() == [100.0, 160.0, 250.0]
    assert slow.sensor_on.tolist() == [[160.0, 250.0]]
    late = Timing(late_s=10.0).of(track)
    assert late.time_s.tolist() == [110.0, 150.0, 210.0]
    same = Timing().of(track)
    assert np.array_equal(same.time_s, track.time_s)


@pytest.mark.parametrize("seed", range(3))
def test_each_is_evaluated_at_its_own_times(seed: int) -> None:
    problem = random_problem(seed)
    plan = plan_of_legs(problem, "any", [0, 5, 2])
    judged = (problem.futures, problem.sensor, problem.objective)
    found = mistimed(plan.tracks, *judged)
    assert [one.timing for one in found] == [*TIMINGS]
    for one in found:
        again = evaluate([one.timing.of(track) for track in plan.tracks], *judged)
        assert np.array_equal(one.evaluated.seen_at, again.seen_at)


def test_the_table_fits_eighty_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    problem = random_problem(1)
    plan = plan_of_legs(problem, "any", [0, 5, 2])
    judged = (problem.futures, problem.sensor, problem.objective)
    file = StringIO()
    table = timing_table(evaluate(plan.tracks, *judged), mistimed(plan.tracks, *judged), FRESH)
    console(file).print(table)
    lines = file.getvalue().splitlines()
    assert max(map(len, lines)) <= 80
    names = ("as planned", "in 0.97 of its time", "in 1.03 of its time", "10 s late")
    for name in names:
        (line,) = (line for line in lines if name in line)
        assert line.rstrip().endswith("%")
        assert (" s later " in line or " s sooner " in line) == (name != "as planned")
    assert "turns of more than 30 degrees" in corners_line(plan)


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        ((), "aircraft: multicopter, 15 m/s, 1.4 m/s2, corners within 2 m, up to 100 m at 2.5 m/s"),
        ((), "--set uav.aircraft=NAME: fixed-wing, vtol, ideal, or a file"),
        ((), "in the air for 0:25:00 with 0:05:00 in reserve"),
        (("uav.aircraft=fixed-wing",), "aircraft: fixed-wing, untested, 15 m/s, at least 12 m/s"),
        (("uav.link_m=900",), "within 900 m of its start"),
        (("uav.wind={speed_mps=4,from_deg=90}",), "wind 4 m/s from 90 degrees"),
        (("uav.aircraft=ideal", "uav.climb_mps=3"), "aircraft: 15 m/s, up to 100 m at 3 m/s"),
    ],
)
def test_the_line_of_an_aircraft(overrides: tuple[str, ...], said: str) -> None:
    assert said in aircraft_line(read_scenario("berlin", overrides=overrides).uav)
