"""Certificates hold, are checked by a program that shares no code, and cannot be tampered with."""

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

from planner.arrays import Floats
from planner.bounds.certificate import Effort, certified, gap_of
from planner.detection.chase import chased_alone
from planner.detection.evaluate import evaluate
from planner.detection.first_detection import first_detection
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.errors import InputError
from planner.flight.plan import FlownLeg, Plan
from planner.flight.track import Track
from planner.intervals import lower_limit
from planner.mission.bounds import stored_bound
from planner.mission.certificate_file import (
    MOTION,
    NET,
    PRICES,
    WEIGHTS,
    read_certificate,
    write_better,
)
from planner.search.plan import plan_of_legs, plan_of_wait
from planner.search.problem import Problem
from planner.search.rate import rate_order
from planner.search.stop import WorkDone
from planner.search.what_if import WhatIf
from support.cases import some_in_the_gate
from support.certified_runs import reseal, write_certified
from support.grid_instance import grid_futures, grid_problem
from support.search_instances import random_problem

VERIFY = Path(__file__).parents[2] / "tools" / "verify.py"


@pytest.fixture
def wrong_claims(monkeypatch: pytest.MonkeyPatch) -> Callable[[Path], list[Any]]:
    """What verify.py, called as a module, finds wrong."""
    monkeypatch.syspath_prepend(VERIFY.parent)
    checker = import_module("verify")

    def found(folder: Path) -> list[Any]:
        with np.errstate(divide="ignore", invalid="ignore"):
            run = checker.Run(checker.read_inputs(folder))
            return [claim for claim in run.claims() if not claim.wrong <= 1e-6]

    return found


def verify(folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(VERIFY), str(folder)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def small_problem(**changes: object) -> Problem:
    problem = grid_problem(grid_futures(40, np.random.default_rng(3), size=3), size=3)
    return problem.replace(objective=Objective(3000.0), **changes)


def rate_plan(problem: Problem) -> Plan:
    return plan_of_legs(problem, "rate", rate_order(WhatIf(problem)))


@pytest.mark.parametrize("seed", [1, 2, 6, 9])
def test_another_program_finds_the_same(seed: int, tmp_path: Path) -> None:
    problem = random_problem(seed)
    problem = (
        problem if seed % 2 else problem.replace(objective=Objective(problem.horizon_s, 900.0))
    )
    write_certified(tmp_path, problem, rate_plan(problem))
    done = verify(tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    told = json.loads((tmp_path / "plan.json").read_text())["certificate"]
    assert told["plan_class"] == "roads"
    assert told["particles"] == len(problem.futures)


@pytest.mark.parametrize("seed", some_in_the_gate(48, 15))
def test_no_honest_certificate_is_refused(
    seed: int, tmp_path: Path, wrong_claims: Callable[[Path], list[Any]]
) -> None:
    """However long the search for prices went on, and however often it split."""
    problem = random_problem(seed, particles=25).replace(objective=Objective(1000.0))
    by_s = 700.0 if seed % 5 == 0 else None
    problem = problem.replace(objective=Objective(1000.0, by_s))
    write_certified(tmp_path, problem, rate_plan(problem), steps=(40, 160, 400)[seed % 3])
    assert wrong_claims(tmp_path) == []


def test_flights_get_the_bound_of_physics(tmp_path: Path) -> None:
    problem = small_problem()
    write_certified(tmp_path, problem, plan_of_wait(problem, "wait", 30_000.0, -30_000.0))
    told = json.loads((tmp_path / "plan.json").read_text())["certificate"]
    assert told["plan_class"] == "free"
    assert told["lower_bound_s"] < told["computed_bound"]
    assert told["computed_gap"] < told["gap"]
    assert verify(tmp_path).returncode == 0


def test_a_stored_bound_for_any_flight_is_worked_out_again(tmp_path: Path) -> None:
    problem = small_problem()
    plan = plan_of_wait(problem, "wait", 30_000.0, -30_000.0)
    write_certified(tmp_path, problem, plan, steps=600)
    path = tmp_path / "plan.json"
    content = json.loads(path.read_text())
    bound = content["certificate"]["computed_bound"]
    content["certificate"]["computed_bound"] = 0.9 * plan.take_off_s
    path.write_text(json.dumps(content))
    assert stored_bound(path, plan, problem) == {("free", plan.take_off_s): bound}


@pytest.mark.parametrize("seed", range(12))
def test_earliest_is_reached_and_never_undercut(seed: int) -> None:
    """Whoever flies straight to where the particle is met meets it then, and nobody sooner."""
    problem = random_problem(seed)
    uav, radius_m = problem.uav, problem.sensor.radius_m
    met_s = chased_alone(problem.futures, uav, problem.sensor)
    assert np.all(met_s >= uav.take_off_s)
    for k in np.flatnonzero(met_s < problem.horizon_s).tolist():
        x, y = problem.futures.xy(k, met_s[k])
        reach_m = radius_m + uav.speed_mps * (met_s[k] - uav.take_off_s)
        assert np.hypot(x - uav.x_m, y - uav.y_m) <= reach_m + 1e-6
    rng = np.random.default_rng(seed)
    for _ in range(20):
        places = np.vstack([[(uav.x_m, uav.y_m)], rng.uniform(-8000, 12000, (6, 2))])
        lasts_s = np.hypot(*np.diff(places, axis=0).T) / uav.speed_mps
        time_s = uav.take_off_s + np.concatenate(([0.0], np.cumsum(lasts_s)))
        track = Track(time_s, places[:, 0], places[:, 1], np.array([[time_s[0], time_s[-1]]]))
        assert np.all(first_detection(problem.futures, track, radius_m) >= met_s - 1e-6)


def change_parquet(path: Path, column: str, change: Callable[[Floats], Floats]) -> None:
    table = pyarrow.parquet.read_table(path)
    values = change(np.array(table[column].to_pylist())).tolist()
    table = table.set_column(table.column_names.index(column), column, pyarrow.array(values))
    pyarrow.parquet.write_table(table, path)


def one_more(add: float) -> Callable[[Floats], Floats]:
    """What adds something to the middle one of some values."""
    return lambda values: values + add * (np.arange(len(values)) == len(values) // 2)


@pytest.mark.parametrize(
    "tampered",
    ["price", "negative", "weight", "motion", "waypoint", "speed", "bound", "gap", "node", "bin"],
)
def test_tampering_is_refused(tampered: str, tmp_path: Path) -> None:
    problem = small_problem()
    write_certified(tmp_path, problem, rate_plan(problem), steps=5)
    assert verify(tmp_path).returncode == 0
    if tampered == "price":
        change_parquet(tmp_path / PRICES, "price", lambda prices: prices[..., ::-1])
    elif tampered == "negative":
        change_parquet(tmp_path / PRICES, "price", lambda prices: prices - 3000.0)
    elif tampered == "weight":
        change_parquet(tmp_path / WEIGHTS, "weight", one_more(0.001))
    elif tampered == "motion":
        change_parquet(tmp_path / MOTION, "x_m", lambda x_m: x_m + 50.0)
    elif tampered == "node":
        net = json.loads((tmp_path / NET).read_text())
        net["node_xy_m"] = (np.array(net["node_xy_m"]) + 8000.0).tolist()
        (tmp_path / NET).write_text(json.dumps(net))
    else:
        plan = json.loads((tmp_path / "plan.json").read_text())
        if tampered == "waypoint":
            plan["uavs"][0]["waypoints"][2][1] += 600.0
        elif tampered == "bound":
            plan["certificate"]["lower_bound_s"] += 1.0
        elif tampered == "gap":
            plan["certificate"]["gap"] *= 0.9
        elif tampered == "speed":
            plan["certificate"]["speed_mps"] *= 0.9
        else:
            plan["certificate"]["bin_s"] *= 2.0
        (tmp_path / "plan.json").write_text(json.dumps(plan))
    assert verify(tmp_path).returncode == 1


def test_columns_are_read_by_name(tmp_path: Path) -> None:
    """In another order they say the same; under another's name they do not; without one nothing."""
    problem = small_problem()
    write_certified(tmp_path, problem, rate_plan(problem), steps=5)
    table = pyarrow.parquet.read_table(tmp_path / MOTION)
    pyarrow.parquet.write_table(table.select(table.column_names[::-1]), tmp_path / MOTION)
    assert verify(tmp_path).returncode == 0
    other = {"x_m": "y_m", "y_m": "x_m"}
    swapped = table.rename_columns([other.get(name, name) for name in table.column_names])
    pyarrow.parquet.write_table(swapped, tmp_path / MOTION)
    assert verify(tmp_path).returncode == 1
    for name in table.column_names:
        renamed = [f"{one}_" if one == name else one for one in table.column_names]
        pyarrow.parquet.write_table(table.rename_columns(renamed), tmp_path / MOTION)
        done = verify(tmp_path)
        assert (done.returncode, name in done.stderr) == (2, True)


def test_a_sensor_that_sees_in_transit_is_refused(tmp_path: Path) -> None:
    """The plan claims what its flight would see with a sensor that is on all the time."""
    problem = small_problem()
    problem = problem.replace(sensor=replace(problem.sensor, detects_in_transit=False))
    plan = rate_plan(problem)
    write_certified(tmp_path, problem, plan, steps=5)
    assert verify(tmp_path).returncode == 0
    track = plan.tracks[0]
    on = np.array([[track.time_s[0], track.time_s[-1]]])
    seeing = evaluate(
        (replace(track, sensor_on=on),), problem.futures, problem.sensor, problem.objective
    )
    content = json.loads((tmp_path / "plan.json").read_text())
    value, certificate = seeing.expected_detection_time_s, content["certificate"]
    assert value < content["planned"]["expected_detection_time_s"] - 0.1
    content["uavs"][0]["sensor_on"] = on.tolist()
    content["planned"]["expected_detection_time_s"] = value
    certificate["gap"] = abs(value / certificate["lower_bound_s"] - 1.0)
    (tmp_path / "plan.json").write_text(json.dumps(content))
    done = verify(tmp_path)
    assert done.returncode == 1
    assert "expected_detection_time_s" in done.stdout


def wrong(folder: Path) -> list[str]:
    """What verify.py says does not hold."""
    lines = verify(folder).stdout.splitlines()
    return [line.split(":")[0] for line in lines if line.endswith("WRONG")]


def flown(plan: Plan, places: list[complex], speed_mps: float) -> Plan:
    """Return the plan with another flight, of which all that is claimed will be true."""
    x_m, y_m = np.real(places), np.imag(places)
    lasts_s = np.abs(np.diff(places)) / speed_mps
    time_s = plan.tracks[0].time_s[0] + np.concatenate(([0.0], np.cumsum(lasts_s)))
    track = Track(time_s, x_m, y_m, np.array([[time_s[0], time_s[-1]]]))
    return replace(plan, tracks=(track,))


@pytest.mark.parametrize("forged", ["bends", "back", "slow", "wait"])
def test_flights_that_are_no_whole_hops_are_refused(forged: str, tmp_path: Path) -> None:
    problem = random_problem(7)
    problem = problem.replace(sensor=replace(problem.sensor, detects_in_transit=True))
    plan, uav = rate_plan(problem), problem.uav
    start, legs = complex(uav.x_m, uav.y_m), problem.legs
    curved = np.flatnonzero(np.diff(legs.first_point) > 2)[:3]
    ways = [slice(legs.first_point[leg], legs.first_point[leg + 1]) for leg in curved]
    roads = [list(legs.x_m[way] + 1j * legs.y_m[way]) for way in ways]
    whole = flown(plan, [start, *roads[0], *roads[2]], uav.speed_mps)
    time_s, first = whole.tracks[0].time_s, len(roads[0])
    named = (
        FlownLeg(int(curved[0]), time_s[0], time_s[1], time_s[first]),
        FlownLeg(int(curved[2]), time_s[first], time_s[first + 1], time_s[-1]),
    )
    whole = replace(whole, legs=(named,))
    write_certified(tmp_path, problem, whole, steps=1)
    assert wrong(tmp_path) == []
    if forged == "bends":
        other = flown(plan, [start, roads[0][1], roads[2][1]], uav.speed_mps)
    elif forged == "back":
        other = flown(plan, [start, *roads[0][:2], roads[0][0]], uav.speed_mps)
    else:
        track = whole.tracks[0]
        time_s = np.array(track.time_s)
        time_s[2:] += 20.0
        places = (track.x_m, track.y_m)
        if forged == "wait":
            time_s = np.insert(time_s, 2, time_s[1] + 20.0)
            places = (np.insert(track.x_m, 2, track.x_m[1]), np.insert(track.y_m, 2, track.y_m[1]))
        on = np.array([[time_s[0], time_s[-1]]])
        other = replace(plan, tracks=(Track(time_s, *places, on),))
    write_certified(tmp_path, problem, other, steps=1)
    assert wrong(tmp_path) == ["flight as its class allows"]


@pytest.mark.parametrize("forged", ["a centimetre", "time runs back"])
def test_nobody_is_a_little_faster(forged: str, tmp_path: Path) -> None:
    """Each of many waypoints comes a bit too soon; or a place is left before it is reached."""
    problem = small_problem()
    plan, speed_mps = plan_of_wait(problem, "wait", 30_000.0, -30_000.0), problem.uav.speed_mps
    track = plan.tracks[0]
    time_s = np.linspace(track.time_s[0], track.time_s[1], 400)
    track = Track(time_s, *track.xy(time_s).T, np.array([[time_s[0], time_s[-1]]]))
    write_certified(tmp_path, problem, replace(plan, tracks=(track,)))
    assert wrong(tmp_path) == []
    if forged == "a centimetre":
        early_s = time_s - np.arange(400) * 0.009 / speed_mps
        track = replace(track, time_s=early_s)
        write_certified(tmp_path, problem, replace(plan, tracks=(track,)))
    else:
        content = json.loads((tmp_path / "plan.json").read_text())
        ways = content["uavs"][0]["waypoints"]
        ways.append([ways[-1][0] - 1e-6, *ways[-1][1:]])
        (tmp_path / "plan.json").write_text(json.dumps(content))
        reseal(tmp_path)
    assert wrong(tmp_path) == ["flight as its class allows"]


@pytest.mark.parametrize("forged", ["negative", "above one", "not a number"])
def test_weights_that_are_no_probabilities_are_refused(forged: str, tmp_path: Path) -> None:
    problem = small_problem()
    write_certified(tmp_path, problem, rate_plan(problem), steps=5)
    factor = {"negative": -0.5, "above one": 1.2, "not a number": np.nan}[forged]
    change_parquet(tmp_path / WEIGHTS, "weight", lambda values: values * factor)
    assert "weights are probabilities" in wrong(tmp_path)


@pytest.mark.parametrize("part", ["planned", "certificate"])
def test_every_claim_is_checked(part: str, tmp_path: Path) -> None:
    """Also with the true figures in the net's file, which used to have the last word."""
    problem = small_problem()
    write_certified(tmp_path, problem, rate_plan(problem), steps=5)
    true = json.loads((tmp_path / "plan.json").read_text())
    net = json.loads((tmp_path / NET).read_text())
    (tmp_path / NET).write_text(json.dumps({**true["planned"], **true["certificate"], **net}))
    names = {
        "planned": ("expected_detection_time_s", "detection_probability", "particles"),
        "certificate": ("lower_bound_s", "gap", "particles"),
    }
    for name in names[part]:
        content = json.loads(json.dumps(true))
        content[part][name] += 1
        (tmp_path / "plan.json").write_text(json.dumps(content))
        assert name in wrong(tmp_path)
        del content[part][name]
        (tmp_path / "plan.json").write_text(json.dumps(content))
        assert verify(tmp_path).returncode == 2


def test_what_is_assumed_is_said(tmp_path: Path) -> None:
    problem = small_problem()
    write_certified(tmp_path, problem, rate_plan(problem), steps=1)
    uav, first = problem.uav, verify(tmp_path).stdout.splitlines()[0]
    assert first.startswith("assumed: ")
    for said in (f"speed_mps {uav.speed_mps},", "horizon_s 3000.0,", "landing_s None", "take-off"):
        assert said in first


@pytest.mark.parametrize("damage", ["cut off", "no table", "short prices", "no net", "a list"])
def test_bad_files_get_one_line(damage: str, tmp_path: Path) -> None:
    problem = small_problem()
    write_certified(tmp_path, problem, rate_plan(problem), steps=1)
    if damage == "cut off":
        (tmp_path / "plan.json").write_text((tmp_path / "plan.json").read_text()[:-9])
    elif damage == "no table":
        (tmp_path / MOTION).write_bytes(b"no table")
    elif damage == "short prices":
        columns = {
            "flight": pyarrow.array([[]], pyarrow.list_(pyarrow.int64())),
            "price": pyarrow.array([[1.0]]),
        }
        pyarrow.parquet.write_table(pyarrow.table(columns), tmp_path / PRICES)
    elif damage == "no net":
        (tmp_path / NET).unlink()
    else:
        (tmp_path / "plan.json").write_text("[]")
    done = verify(tmp_path)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert "planner certify" in done.stderr.splitlines()[-1]


@pytest.mark.parametrize("horizon_s", [60.0, 150.0, 400.0])
@pytest.mark.parametrize("by_s", [None, 0.5, 50.0])
def test_short_searches_are_verified(
    horizon_s: float, by_s: float | None, tmp_path: Path, wrong_claims: Callable[[Path], list[Any]]
) -> None:
    problem = small_problem().replace(objective=Objective(horizon_s, by_s))
    write_certified(tmp_path, problem, rate_plan(problem), steps=5)
    assert wrong_claims(tmp_path) == []


@pytest.mark.parametrize("transit", [False, True])
def test_waiting_is_verified(
    transit: bool, tmp_path: Path, wrong_claims: Callable[[Path], list[Any]]
) -> None:
    problem = small_problem().replace(sensor=Sensor(500.0, detects_in_transit=transit))
    write_certified(tmp_path, problem, plan_of_wait(problem, "wait", 15000.0, -15000.0))
    assert wrong_claims(tmp_path) == []


def test_the_bound_of_physics_counts_from_take_off(tmp_path: Path) -> None:
    problem = small_problem()
    late = replace(problem.uav, take_off_s=500.0)
    problem = problem.replace(uav=late)
    write_certified(tmp_path, problem, plan_of_wait(problem, "wait", 15000.0, -15000.0))
    assert wrong(tmp_path) == []
    content = json.loads((tmp_path / "plan.json").read_text())
    content["certificate"]["lower_bound_s"] *= 1.0001
    (tmp_path / "plan.json").write_text(json.dumps(content))
    assert "lower_bound_s" in wrong(tmp_path)


def test_nothing_else_in_the_file_has_a_say(tmp_path: Path) -> None:
    problem = small_problem()
    write_certified(tmp_path, problem, rate_plan(problem), steps=5)
    content = json.loads((tmp_path / "plan.json").read_text())
    content["certificate"]["__dict__"] = {"radius_m": 1000.0}
    content["certificate"]["roads"] = []
    (tmp_path / "plan.json").write_text(json.dumps(content))
    assert wrong(tmp_path) == []
    assert "radius_m 500.0," in verify(tmp_path).stdout
    content["uavs"].append(content["uavs"][0])
    (tmp_path / "plan.json").write_text(json.dumps(content))
    assert verify(tmp_path).returncode == 2


def test_a_stored_certificate_is_read_back(tmp_path: Path) -> None:
    problem, path = small_problem(), tmp_path / "plan.json"
    write_certified(tmp_path, problem, rate_plan(problem), steps=5)
    content = json.loads(path.read_text())
    stored = read_certificate(path)
    assert stored is not None
    assert stored.content() == content["certificate"]
    assert stored.bound == content["certificate"]["lower_bound_s"]
    bound = {"lower_bound_s": "high"}, {"upper_bound_probability": 0.5}, {"lower_bound_s": None}
    for broken in ([], "none", {}, *(content["certificate"] | change for change in bound)):
        path.write_text(json.dumps(content | {"certificate": broken}))
        with pytest.raises(InputError, match="its certificate is broken"):
            read_certificate(path)
    del content["certificate"]
    path.write_text(json.dumps(content))
    assert read_certificate(path) is None


def test_a_broken_certificate_is_replaced(tmp_path: Path) -> None:
    problem, path = small_problem(), tmp_path / "plan.json"
    plan = rate_plan(problem)
    write_certified(tmp_path, problem, plan, steps=5)
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content | {"certificate": {"gap": 0.0}}))
    certificate = certified(problem, plan, Effort(stop=WorkDone(5)))
    stays, is_earlier = write_better(tmp_path, path, problem, certificate, (1.0, 10))
    assert (stays.sets, is_earlier) == (10, False)
    assert verify(tmp_path).returncode == 0
    again, is_earlier = write_better(tmp_path, path, problem, certificate)
    assert (again, is_earlier) == (stays, False)


def test_a_gap_may_be_asked_for() -> None:
    problem = small_problem()
    plan = rate_plan(problem)
    wide = certified(problem, plan, Effort())
    heard = [gap_of(wide.value, point.value) for point in wide.trace]
    assert heard == sorted(heard, reverse=True)
    assert wide.gap <= heard[-1] < heard[0]
    asked = certified(problem, plan, Effort(gap=0.5 * (heard[0] + wide.gap)))
    assert wide.gap <= asked.gap <= 0.5 * (heard[0] + wide.gap)


def test_whoever_flies_on_after_landing_is_refused(tmp_path: Path) -> None:
    problem = small_problem()
    uav = replace(problem.uav, max_flight_time_s=1500.0)
    problem = problem.replace(uav=uav)
    write_certified(tmp_path, problem, rate_plan(problem), steps=5)
    assert verify(tmp_path).returncode == 0
    content = json.loads((tmp_path / "plan.json").read_text())
    content["certificate"]["landing_s"] = content["uavs"][0]["waypoints"][-1][0] - 10.0
    (tmp_path / "plan.json").write_text(json.dumps(content))
    done = verify(tmp_path)
    assert done.returncode == 1
    assert "claimed True, found False: WRONG" in done.stdout


def test_landing_only_lowers_what_is_possible() -> None:
    """The bound leaves the landing out, so it holds for plans that have to land in time."""
    problem = small_problem()
    uav = replace(problem.uav, max_flight_time_s=1500.0)
    problem = problem.replace(uav=uav)
    certificate = certified(problem, rate_plan(problem), Effort(stop=WorkDone(30)))
    assert certificate.bound <= certificate.value


def test_lower_limit_is_students() -> None:
    """Four values 1, 2, 3, 4: mean 2.5, deviation 1.29099, t(0.95, 3) = 2.35336."""
    limit = lower_limit(np.array([1.0, 2.0, 3.0, 4.0]))
    assert limit == pytest.approx(2.5 - 2.35336 * 1.29099 / 2, abs=1e-4)
