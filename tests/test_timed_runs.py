"""tools/verify.py times the waypoints of a real aircraft itself, and finds times that are false."""

import json
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.as_flown import Battery, as_flown, line_flown
from planner.flight.law import Aircraft, FlightLaw
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.search.problem import Budget
from planner.search.rate import rate
from support.certified_runs import reseal, write_certified
from support.grid_instance import grid_futures, grid_problem

TOOLS = Path(__file__).parents[1] / "tools"
REAL = FlightLaw(
    40.0,
    acceleration_mps2=1.4,
    corner_m=2.0,
    climb_mps=2.5,
    descend_mps=1.5,
    altitude_m=100.0,
    wind_mps=(3.0, -2.0),
)
RATES = ("acceleration_mps2", "corner_m", "climb_mps", "descend_mps")


@pytest.fixture(autouse=True)
def _on_path(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(TOOLS)


def said_of(law: FlightLaw) -> dict[str, Any]:
    """What plan.json says of an aircraft."""
    rates = {key: getattr(law, key) for key in RATES}
    return {
        **{key: rate if np.isfinite(rate) else None for key, rate in rates.items()},
        "hover": law.can_hover,
        "min_speed_mps": law.min_speed_mps or None,
        "reserve_s": 0.0,
        "wind_mps": list(law.wind_mps),
        "headwind_mps": 0.0,
    }


def drawn(seed: int, law: FlightLaw, *, lands: bool = True) -> Track:
    rng = np.random.default_rng(seed)
    many = int(rng.integers(2, 25))
    xy_m = np.cumsum(rng.normal(0, 1, (many, 2)) * rng.choice([3.0, 80.0, 900.0], (many, 1)), 0)
    hold_s = rng.choice([0.0, 1.0], many) * rng.uniform(1, 60, many)
    return line_flown(xy_m, hold_s, law, up_s=500.0, lands=lands)[0]


def claims(track: Track, law: FlightLaw, *, lands: bool = True) -> dict[str, float]:
    """What verify.py finds, by name; 0: as it should be."""
    flight = {
        "altitude_m": law.altitude_m,
        "speed_mps": law.speed_mps,
        "aircraft": said_of(law),
        "landing": {} if lands else None,
        "sensor_on": track.sensor_on.tolist(),
    }
    fields = import_module("verify_files").Fields("plan.json: uavs[0]", flight)
    rows = np.stack([track.time_s, track.x_m, track.y_m], axis=1)
    timed = import_module("verify_times").timed_again(fields, rows)
    return {name: found for name, _, found in timed}


@given(
    st.integers(0, 10**6),
    st.floats(4.0, 30.0),
    st.sampled_from([0.8, 1.4, 4.0, np.inf]),
    st.sampled_from([0.5, 2.0, np.inf]),
    st.sampled_from([(0.0, 0.0), (3.0, -1.0)]),
    st.booleans(),
)
def test_two_ways_to_time_a_flight_agree(
    seed: int, mps: float, rate: float, corner_m: float, wind: tuple[float, float], lands: bool
) -> None:
    law = replace(REAL, speed_mps=mps, acceleration_mps2=rate, corner_m=corner_m, wind_mps=wind)
    assert set(claims(drawn(seed, law, lands=lands), law, lands=lands).values()) == {0.0}


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.floats(0.05, 30.0), st.booleans())
def test_a_piece_that_takes_longer_or_less_is_found(seed: int, off_s: float, longer: bool) -> None:
    track = drawn(seed, REAL)
    lasts_s = np.diff(track.time_s)
    moves = np.flatnonzero(np.hypot(np.diff(track.x_m), np.diff(track.y_m)))
    piece = int(moves[seed % len(moves)])
    change_s = off_s if longer else -min(off_s, float(lasts_s[piece]))
    time_s = track.time_s.copy()
    time_s[piece + 1 :] += change_s
    false = replace(track, time_s=time_s, sensor_on=np.zeros((0, 2)))
    found = claims(false, REAL)["times by the flight law"]
    assert found == pytest.approx(abs(change_s) if abs(change_s) > 0.011 else found, abs=0.011)


def test_climb_descent_and_sensor() -> None:
    track = line_flown(
        np.array([[0.0, 0.0], [900.0, 0.0]]), np.zeros(2), REAL, up_s=500.0, lands=True
    )[0]
    begins_s, ends_s = float(track.time_s[0]), track.end_s
    quick = track.time_s.copy()
    quick[0] += 30.0
    quick[-1] -= 50.0
    found = claims(replace(track, time_s=quick), REAL)
    assert found["time for the climb"] == pytest.approx(30.0)
    assert found["time for the descent"] == pytest.approx(50.0)
    early = replace(track, sensor_on=np.array([[begins_s, ends_s]]))
    assert claims(early, REAL)["sensor on at height only"] == pytest.approx(100.0 / 1.5)


def test_what_cannot_hover_does_not() -> None:
    law = replace(REAL, min_speed_mps=12.0)
    line_m = np.array([[0.0, 0.0], [900.0, 0.0], [2000.0, 0.0]])
    track = line_flown(line_m, np.zeros(3), law, up_s=500.0, lands=True)[0]
    assert claims(track, law)["hovering of what cannot hover"] == 0.0
    time_s = track.time_s.copy()
    time_s[-1] += 30.0
    found = claims(replace(track, time_s=time_s), law)
    assert found["hovering of what cannot hover"] == pytest.approx(30.0)


def test_an_ideal_aircraft_has_no_times_to_check() -> None:
    verify_times, verify_files = (import_module(f"verify_{name}") for name in ("times", "files"))
    assert list(verify_times.timed_again(verify_files.Fields("plan.json", {}), None)) == []


@pytest.fixture(scope="module")
def real_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A certified run of an aircraft that climbs, brakes and turns."""
    folder = tmp_path_factory.mktemp("real")
    problem = grid_problem(grid_futures(12, np.random.default_rng(3), size=3), size=3)
    problem = problem.replace(objective=Objective(3000.0), sensor=Sensor(500.0))
    uav = replace(problem.uav, speed_mps=40.0, altitude_m=100.0, aircraft=Aircraft(REAL))
    xy_m = np.array([[uav.x_m, uav.y_m], [9000.0, 0.0], [9000.0, -4000.0], [0.0, 0.0]])
    hold_s = np.array([0.0, 0.0, 60.0, 0.0])
    up_s = uav.take_off_s + REAL.climb_s
    track, _ = line_flown(xy_m, hold_s, REAL, up_s=up_s, lands=False)
    write_certified(folder, problem.replace(uav=uav), Plan("flown", (track,), ((),)))
    return folder


@pytest.fixture(scope="module")
def road_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A certified run of that aircraft along roads."""
    folder = tmp_path_factory.mktemp("roads")
    problem = grid_problem(grid_futures(12, np.random.default_rng(3), size=3), size=3)
    problem = problem.replace(objective=Objective(3000.0), sensor=Sensor(500.0))
    up_s = problem.uav.take_off_s + REAL.climb_s
    at_height = problem.replace(uav=replace(problem.uav, take_off_s=up_s))
    planned = rate(at_height, budget=Budget(), rng=np.random.default_rng(1)).plan
    battery = Battery(np.inf, 0.0, None, 0.0)
    plan = as_flown(planned, REAL, battery)
    uav = replace(problem.uav, speed_mps=40.0, altitude_m=100.0, aircraft=Aircraft(REAL))
    write_certified(folder, problem.replace(uav=uav), plan)
    return folder


def verdict(
    run: Path, folder: Path, capsys: pytest.CaptureFixture[str], forge: Callable[[Any], None]
) -> tuple[int, str]:
    """What verify.py says of a run with its flight changed by a forger."""
    for path in run.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    content = json.loads((folder / "plan.json").read_text())
    forge(content["uavs"][0])
    (folder / "plan.json").write_text(json.dumps(content))
    reseal(folder)
    code = import_module("verify").main([str(folder)])
    said = capsys.readouterr()
    return code, "".join(line for line in said.out.splitlines() if "WRONG" in line) + said.err


@pytest.fixture
def judged(
    real_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> Callable[[Callable[[Any], None]], tuple[int, str]]:
    return lambda forge: verdict(real_run, tmp_path, capsys, forge)


def renamed(flight: Any) -> None:
    """One road by two names."""
    flight["legs"][0]["road"] = flight["legs"][-1]["road"]


def elsewhere(flight: Any) -> None:
    """A road that is flown a little later than it is."""
    leg = flight["legs"][1]
    leg["start_s"], leg["end_s"] = leg["start_s"] + 5.0, leg["end_s"] + 5.0


def test_roads_are_flown_when_the_plan_says_so(
    road_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert verdict(road_run, tmp_path, capsys, lambda _: None) == (0, "")
    for forge in (renamed, elsewhere):
        code, said = verdict(road_run, tmp_path, capsys, forge)
        assert code == 1
        assert "flight as its class allows" in said


def later(flight: Any) -> None:
    """The last waypoint is reached ten seconds later, by flying slowly."""
    flight["waypoints"][-1][0] += 10.0


def without_braking(flight: Any) -> None:
    """At full speed from the first corner to the second, where it has to stop."""
    rows = flight["waypoints"]
    stop = next(i for i in range(3, len(rows) - 1) if rows[i][1:3] == rows[i + 1][1:3])
    sooner_s = 2.0
    for row in rows[stop:]:
        row[0] -= sooner_s
    flight["sensor_on"][-1][1] -= sooner_s


FORGERIES: dict[str, tuple[Callable[[Any], None], str]] = {
    "later": (later, "times by the flight law"),
    "without braking": (without_braking, "times by the flight law"),
    "a quicker aircraft": (
        lambda flight: flight["aircraft"].update(acceleration_mps2=3.0),
        "times by the flight law",
    ),
    "wider corners": (
        lambda flight: flight["aircraft"].update(corner_m=50.0),
        "times by the flight law",
    ),
    "at once": (
        lambda flight: flight["aircraft"].update(acceleration_mps2=None),
        "times by the flight law",
    ),
    "another wind": (
        lambda flight: flight["aircraft"].update(wind_mps=[-3.0, 2.0]),
        "times by the flight law",
    ),
    "up at once": (
        lambda flight: flight["aircraft"].update(climb_mps=0.5),
        "time for the climb",
    ),
    "a slow climb": (
        lambda flight: flight["aircraft"].update(climb_mps=0.5),
        "climb_mps of the scenario",
    ),
    "a descent at once": (
        lambda flight: flight["aircraft"].update(descend_mps=None),
        "descend_mps of the scenario",
    ),
    "no hovering": (
        lambda flight: flight["aircraft"].update(hover=False),
        "hover of the scenario",
    ),
    "a least speed": (
        lambda flight: flight["aircraft"].update(min_speed_mps=5.0),
        "min_speed_mps of the scenario",
    ),
    "no wind": (
        lambda flight: flight["aircraft"].update(wind_mps=[0.0, 0.0]),
        "wind to the east of the scenario",
    ),
    "a wind of three numbers": (
        lambda flight: flight["aircraft"].update(wind_mps=[3.0, -2.0, 0.0]),
        "wind_mps should be",
    ),
    "a wind that is no number": (
        lambda flight: flight["aircraft"].update(wind_mps=[float("nan"), -2.0]),
        "NaN",
    ),
    "lower": (lambda flight: flight.update(altitude_m=1.0), "altitude of the scenario"),
    "a landing": (
        lambda flight: flight.update(landing={"x_m": 0.0, "y_m": 0.0}),
        "landing of the scenario",
    ),
    "the ideal aircraft": (lambda flight: flight.pop("aircraft"), "has an aircraft if"),
    "a rate of 0": (
        lambda flight: flight["aircraft"].update(acceleration_mps2=0),
        "should be a number above zero",
    ),
    "a wind of one number": (
        lambda flight: flight["aircraft"].update(wind_mps=[1.0]),
        "wind_mps should be two numbers",
    ),
    "a wind of texts": (
        lambda flight: flight["aircraft"].update(wind_mps=["1", "2"]),
        "wind_mps should be two numbers",
    ),
    "an aircraft of nothing": (lambda flight: flight.update(aircraft=None), "should be an object"),
}


def test_the_honest_run_holds(judged: Any) -> None:
    assert judged(lambda _: None) == (0, "")


@pytest.mark.parametrize("forged", FORGERIES)
def test_false_times_are_refused(forged: str, judged: Any) -> None:
    forge, said = FORGERIES[forged]
    code, wrong = judged(forge)
    assert code in (1, 2)
    assert said in wrong
