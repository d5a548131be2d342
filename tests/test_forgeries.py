"""tools/verify.py takes what an honest run holds, and none of many ways to forge one."""

import json
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pytest

from planner.bounds.certificate import Effort, certified
from planner.bounds.hops import hops_of
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.mission.certificate_file import read_certificate, write_better
from planner.search.plan import plan_of_legs, plan_of_wait
from planner.search.problem import Problem
from planner.search.rate import rate_order
from planner.search.stop import WorkDone
from planner.search.what_if import WhatIf
from support.certified_runs import reseal, write_certified
from support.forger import TOOLS, Forger, climbs_for_ever, verdicts
from support.grid_instance import grid_futures, grid_problem

JSON = ("plan.json", "run.json", "net.json")
CHECKER = (
    "verify.py",
    "verify_inputs.py",
    "verify_files.py",
    "verify_misses.py",
    "verify_uavs.py",
    "verify_flight.py",
    "verify_plan.py",
    "verify_aircraft.py",
    "verify_asked.py",
    "verify_times.py",
    "verify_odds.py",
    "verify_sight.py",
    "verify_spans.py",
    "verify_bound.py",
)
PARQUET = ("motion.parquet", "weights.parquet", "prices.parquet")


def small_problem(by_s: float | None = None) -> Problem:
    problem = grid_problem(grid_futures(12, np.random.default_rng(3), size=3), size=3)
    return problem.replace(objective=Objective(3000.0, by_s))


@pytest.fixture(scope="session")
def honest_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a plan that is not the best: its gap is no zero that a forgery might leave as it is."""
    folder = tmp_path_factory.mktemp("honest")
    problem = small_problem()
    order = rate_order(WhatIf(problem))[::-1]
    write_certified(folder, problem, plan_of_legs(problem, "rate", order))
    return folder


@pytest.fixture(scope="session")
def hovering_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("hovering")
    problem = small_problem()
    write_certified(folder, problem, plan_of_wait(problem, "wait", 15_000.0, -15_000.0))
    return folder


@pytest.fixture
def verdict(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[[Path], int]:
    return verdicts(monkeypatch, capsys)


def link(forger: Forger) -> None:
    path = forger.folder / "net.json"
    path.rename(forger.folder / "other.json")
    path.symlink_to(forger.folder / "other.json")


def pipe(forger: Forger) -> None:
    (forger.folder / "plan.json").unlink()
    os.mkfifo(forger.folder / "plan.json")


def faster(forger: Forger) -> None:
    """All flown in half the time, with a speed to match in the certificate."""
    start_s = forger.json("plan.json")["uavs"][0]["waypoints"][0][0]

    def sooner(time_s: float) -> float:
        return start_s + (time_s - start_s) / 2

    flight = forger.json("plan.json")
    uav = flight["uavs"][0]
    uav["waypoints"] = [[sooner(t), x, y] for t, x, y in uav["waypoints"]]
    uav["sensor_on"] = [[sooner(a), sooner(b)] for a, b in uav["sensor_on"]]
    for leg in uav["legs"]:
        leg |= {key: sooner(leg[key]) for key in ("depart_s", "start_s", "end_s")}
    flight["certificate"]["speed_mps"] *= 2
    forger.write("plan.json", flight)
    reseal(forger.folder)


def fewer_roads(forger: Forger) -> None:
    content = forger.json("net.json")
    content["roads"] = content["roads"][2:]
    forger.write("net.json", content)


def one_way(forger: Forger) -> None:
    forger.put("net.json", "roads", lambda roads: roads[:-1])


def moved_together(forger: Forger) -> None:
    """Two particles change their weights."""
    forger.column("weights.parquet", "weight", lambda w: [2 * w[0], 0.0, *w[2:]])


def twice_there(forger: Forger) -> None:
    """A particle is also where another one is."""

    def also(table: Any) -> Any:
        whose = [0] * table.num_rows
        again = table.set_column(0, "particle", pyarrow.array(whose, pyarrow.int64()))
        return pyarrow.concat_tables([table, again])

    forger.table("motion.parquet", also)


def nobody(forger: Forger) -> None:
    """Neither particles nor prices for them."""
    for name in ("motion.parquet", "weights.parquet"):
        forger.table(name, lambda table: table.slice(0, 0))
    forger.column("prices.parquet", "price", lambda rows: [[] for _ in rows])


def other_names(forger: Forger) -> None:
    """All roads that the plan names bear the name of one."""
    content = forger.json("plan.json")
    for leg in content["uavs"][0]["legs"]:
        leg["road"] = content["uavs"][0]["legs"][0]["road"]
    forger.write("plan.json", content)
    reseal(forger.folder)


def as_a_deadline(forger: Forger) -> None:
    content = forger.json("plan.json")
    content["planned"] |= {"objective": "probability", "found_by_s": 2000.0}
    content["planned"]["found_by_probability"] = content["planned"]["detection_probability"]
    bound = content["certificate"]
    del bound["lower_bound_s"]
    bound |= {"upper_bound_probability": 1.0, "gap": 0.0}
    forger.write("plan.json", content)
    reseal(forger.folder)


Forgery = Callable[[Forger], None]


def cert(key: str, value: Any) -> Forgery:
    return lambda f: f.put("plan.json", "certificate", key, value)


def planned(key: str, value: Any) -> Forgery:
    return lambda f: f.put("plan.json", "planned", key, value)


def uav(*keys: Any) -> Forgery:
    return lambda f: f.put("plan.json", "uavs", 0, *keys)


def scenario(*keys: Any) -> Forgery:
    return lambda f: f.put("run.json", "scenario", *keys)


def new_key(part: str, key: str, value: Any) -> Forgery:
    return lambda f: f.put("plan.json", part, lambda content: content | {key: value})


FORGERIES: dict[str, Forgery] = {
    # the certificate
    "bound too good": cert("lower_bound_s", lambda bound: bound + 1.0),
    "bound as the plan": lambda f: f.put(
        "plan.json",
        "certificate",
        "lower_bound_s",
        f.json("plan.json")["planned"]["expected_detection_time_s"],
    ),
    "gap smaller": cert("gap", lambda gap: 0.9 * gap),
    "gap null": cert("gap", None),
    "gap negative": cert("gap", -0.1),
    "gap a text": cert("gap", "0.0"),
    "no gap": lambda f: f.drop("plan.json", "certificate", "gap"),
    "two bounds": new_key("certificate", "upper_bound_probability", 1e-6),
    "the other bound": as_a_deadline,
    "bound true": cert("lower_bound_s", True),
    "transit as a text": cert("transit", "false"),
    "transit as a number": cert("transit", 1),
    "transit off": cert("transit", False),
    "landing at zero": cert("landing_s", 0),
    "landing false": cert("landing_s", False),
    "landing later": cert("landing_s", 1e6),
    "free": cert("plan_class", "free"),
    "free, with no bins": lambda f: (cert("plan_class", "free")(f), cert("bin_s", 0.0)(f))[0],
    "another class": cert("plan_class", "ROADS"),
    "slower": cert("speed_mps", lambda speed: 0.9 * speed),
    "faster": faster,
    "particles one more": cert("particles", lambda n: n + 1),
    "particles as a float": cert("particles", float),
    "longer bins": cert("bin_s", lambda bin_s: 2 * bin_s),
    "negative bins": cert("bin_s", -1.0),
    "tiny bins": cert("bin_s", 1e-7),
    "bins of almost nothing": cert("bin_s", 1e-300),
    "no bins": cert("bin_s", 0.0),
    "limit without sets": new_key("certificate", "true_optimum_limit", 1.0),
    "certificate a list": lambda f: f.put("plan.json", "certificate", []),
    "no certificate": lambda f: f.drop("plan.json", "certificate"),
    # what was planned
    "found sooner": planned("expected_detection_time_s", lambda value: 0.9 * value),
    "found more often": planned("detection_probability", 0.123),
    "a deadline beside a time": new_key("planned", "found_by_probability", 0.999),
    "a deadline of zero": lambda f: f.put(
        "plan.json",
        "planned",
        lambda content: (
            content | {"objective": "probability", "found_by_s": 0, "found_by_probability": 1.0}
        ),
    ),
    "wider radius": planned("radius_m", lambda radius: 1.5 * radius),
    "longer horizon": planned("horizon_s", lambda horizon: 2 * horizon),
    "horizon true": planned("horizon_s", True),
    "another objective": planned("objective", "best"),
    # the flight
    "a waypoint moved": uav("waypoints", 2, 1, lambda x: x + 600.0),
    "a waypoint sooner": uav("waypoints", 2, 0, lambda t: t - 5.0),
    "a waypoint left out": uav("waypoints", lambda points: points[:1] + points[2:]),
    "a waypoint of two numbers": uav("waypoints", 1, [0.0, 1.0]),
    "a waypoint of texts": uav("waypoints", 1, ["0", "1", "2"]),
    "no waypoints": uav("waypoints", []),
    "sensor longer on": uav("sensor_on", lambda on: [[on[0][0], on[-1][1]], [1e7, 1e8]][::-1]),
    "a road not flown": uav("legs", 1, "start_s", lambda t: t + 1.0),
    "no roads": uav("legs", []),
    "roads of one name": other_names,
    "a road without its name": lambda f: f.drop("plan.json", "uavs", 0, "legs", 0, "road"),
    "two flights": lambda f: f.put("plan.json", "uavs", lambda uavs: uavs * 2),
    "no flight": lambda f: f.put("plan.json", "uavs", []),
    "another schema": lambda f: f.put("plan.json", "schema", "planner.plan/3"),
    # the aircraft, and where it is
    "on another net": lambda f: f.put("plan.json", "network", "sha256", "0" * 64),
    "on no net": lambda f: f.drop("plan.json", "network"),
    "an offset of one number": lambda f: f.put("plan.json", "network", "net_offset_m", [0.0]),
    "a projection of a number": lambda f: f.put("plan.json", "network", "projection", 33),
    "on the Earth": lambda f: f.put("plan.json", "network", "projection", "+proj=utm +zone=33"),
    "an aircraft that climbs for ever": climbs_for_ever,
    "the same, as the first schema has it": lambda f: (
        climbs_for_ever(f),
        f.put("plan.json", "schema", "planner.plan/1"),
    )[0],
    "higher": uav("altitude_m", lambda altitude_m: altitude_m + 1.0),
    "below the ground": uav("altitude_m", -1.0),
    "as fast as it likes": uav("speed_mps", lambda speed: 2 * speed),
    "no speed": uav("speed_mps", None),
    "as long as it likes": uav("max_flight_time_s", 1e5),
    "from another place": uav("start", "x_m", lambda x: x + 1.0),
    "from a list": uav("start", [0.0, 0.0]),
    "from a place in degrees": uav("start", lambda start: start | {"lon": 13.5, "lat": 52.4}),
    "to a landing of a text": uav("landing", "start"),
    "to a landing of one number": uav("landing", {"x_m": 0.0}),
    "a sighting of a number": lambda f: f.put("plan.json", "sighted_at", 5),
    # the net
    "nodes elsewhere": lambda f: f.put("net.json", "node_xy_m", 0, [9e3, 9e3]),
    "fewer roads": fewer_roads,
    "a road one way": one_way,
    "a road to another node": lambda f: f.put("net.json", "roads", 0, 1, 5),
    "a road to no node": lambda f: f.put("net.json", "roads", 0, 1, 500),
    "a road to node -1": lambda f: f.put("net.json", "roads", 0, 1, -1),
    "a road to node true": lambda f: f.put("net.json", "roads", 0, 1, True),
    "a net without nodes": lambda f: f.put("net.json", "node_xy_m", []),
    # motion, weights and prices
    "motion beside": lambda f: f.column(
        "motion.parquet", "x_m", lambda values: [x + 50.0 for x in values]
    ),
    "motion of nobody": lambda f: f.column(
        "motion.parquet", "particle", lambda whose: [*whose[:-1], 12], pyarrow.int64()
    ),
    "motion of particle -1": lambda f: f.column(
        "motion.parquet", "particle", lambda whose: [-1, *whose[1:]], pyarrow.int64()
    ),
    "motion not a number": lambda f: f.column(
        "motion.parquet", "vx_mps", lambda values: [float("nan"), *values[1:]]
    ),
    "motion backwards in time": lambda f: f.column(
        "motion.parquet", "to_s", lambda values: [-1.0, *values[1:]]
    ),
    "motion cut off": lambda f: f.table("motion.parquet", lambda table: table.slice(0, 20)),
    "motion twice": twice_there,
    "x as y": lambda f: f.table(
        "motion.parquet",
        lambda table: table.rename_columns(
            [{"x_m": "y_m", "y_m": "x_m"}.get(name, name) for name in table.column_names]
        ),
    ),
    "a column twice": lambda f: f.table(
        "motion.parquet", lambda table: table.append_column("x_m", table["y_m"])
    ),
    "a column of texts": lambda f: f.column(
        "motion.parquet", "x_m", lambda values: list(map(str, values))
    ),
    "a column of small floats": lambda f: f.column(
        "motion.parquet", "x_m", lambda values: values, pyarrow.float32()
    ),
    "a null": lambda f: f.column("weights.parquet", "weight", lambda w: [None, *w[1:]]),
    "no column": lambda f: f.table("weights.parquet", lambda table: table.drop_columns("weight")),
    "weights moved": moved_together,
    "weights of more": lambda f: f.table(
        "weights.parquet", lambda table: pyarrow.concat_tables([table, table])
    ),
    "weights negative": lambda f: f.column(
        "weights.parquet", "weight", lambda w: [-w[0], 2 * w[0] + w[1], *w[2:]]
    ),
    "weights not a number": lambda f: f.column(
        "weights.parquet", "weight", lambda w: [float("nan"), *w[1:]]
    ),
    "weights infinite": lambda f: f.column(
        "weights.parquet", "weight", lambda w: [float("inf"), *w[1:]]
    ),
    "nobody there": nobody,
    "nobody moves": lambda f: f.table("motion.parquet", lambda table: table.slice(0, 0)),
    "prices not a number": lambda f: f.column(
        "prices.parquet", "price", lambda rows: [[float("nan")] * len(row) for row in rows]
    ),
    "prices of none": lambda f: f.table("prices.parquet", lambda table: table.slice(0, 0)),
    "prices negative": lambda f: f.column(
        "prices.parquet", "price", lambda rows: [[-p - 1 for p in row] for row in rows]
    ),
    "prices turned round": lambda f: f.column(
        "prices.parquet", "price", lambda rows: [row[::-1] for row in rows]
    ),
    "prices too few": lambda f: f.column(
        "prices.parquet", "price", lambda rows: [row[:-1] for row in rows]
    ),
    "prices infinite": lambda f: f.column(
        "prices.parquet", "price", lambda rows: [[float("inf")] * len(row) for row in rows]
    ),
    "prices twice": lambda f: f.table(
        "prices.parquet", lambda table: pyarrow.concat_tables([table, table])
    ),
    # the record
    "another radius asked for": scenario("sensor", "radius_m", 1.0),
    "another speed asked for": scenario("uav", "speed_mps", 1e3),
    "another start asked for": scenario("uav", "start", "x_m", 1.0),
    "another aircraft asked for": scenario("uav", "climb_mps", 0.001),
    "one in the air asked for": scenario("uav", "in_air", {"place": {"x_m": 0.0, "y_m": 0.0}}),
    "another height asked for": scenario("uav", "altitude_m", 1.0),
    "another horizon asked for": scenario("search", "horizon_s", 99.0),
    "another seed": lambda f: f.put("run.json", "seed", 2),
    "digest of motion": lambda f: f.put("run.json", "sha256", "motion", "0" * 64),
    "digest of roads": lambda f: f.put("run.json", "sha256", "roads", "0" * 64),
    "digest of the scenario": lambda f: f.put("run.json", "sha256", "scenario", "0" * 64),
    "digest of nothing": lambda f: (
        f.put("run.json", "sha256", "plan", None) or f.put("run.json", "sha256", {})
    ),
    "evaluated otherwise": lambda f: f.text("plan.json", '"seed": 1', '"seed": 7'),
    # files that are none
    **{
        f"{name} missing": lambda f, name=name: (f.folder / name).unlink()
        for name in JSON + PARQUET
    },
    **{
        f"{name} cut": lambda f, name=name: (f.folder / name).write_bytes(
            (f.folder / name).read_bytes()[:-20]
        )
        for name in JSON + PARQUET
    },
    "nested deeply": lambda f: (f.folder / "plan.json").write_text("[" * 100_000) and None,
    "nested deeply in a key": lambda f: f.text("net.json", "{", '{"a": ' + "[" * 50_000),
    "not a number": cert("gap", float("nan")),
    "infinite": planned("horizon_s", float("inf")),
    "beyond all bounds": lambda f: f.text("plan.json", '"horizon_s": 3000.0', '"horizon_s": 1e999'),
    "of many digits": lambda f: f.text(
        "plan.json", '"particles": 12', '"particles": ' + "1" * 5000
    ),
    "huge": planned("radius_m", 1e300),
    "a key twice": lambda f: f.text("plan.json", '"gap":', '"gap": 0.0, "gap":'),
    "no UTF-8": lambda f: (f.folder / "run.json").write_bytes(b"\xff\xfe{}") and None,
    "a link": link,
    "a pipe": pipe,
}


@pytest.mark.parametrize("forged", FORGERIES)
def test_forgeries_are_refused(
    forged: str, honest_run: Path, tmp_path: Path, verdict: Callable[[Path], int]
) -> None:
    shutil.copytree(honest_run, tmp_path / "run")
    FORGERIES[forged](Forger(tmp_path / "run"))
    assert verdict(tmp_path / "run") in (1, 2)


def test_a_plan_of_schema_1_is_read(
    honest_run: Path, tmp_path: Path, verdict: Callable[[Path], int]
) -> None:
    shutil.copytree(honest_run, tmp_path / "run")
    forger = Forger(tmp_path / "run")
    content = forger.json("plan.json")
    for key in ("network", "sighted_at"):
        del content[key]
    for key in ("altitude_m", "speed_mps", "max_flight_time_s", "start", "landing"):
        del content["uavs"][0][key]
    forger.write("plan.json", content | {"schema": "planner.plan/1"})
    reseal(forger.folder)
    assert verdict(forger.folder) == 0


def test_degrees_beside_the_metres_are_read(
    honest_run: Path, tmp_path: Path, verdict: Callable[[Path], int]
) -> None:
    shutil.copytree(honest_run, tmp_path / "run")
    forger = Forger(tmp_path / "run")
    content, degrees = forger.json("plan.json"), {"lon": 13.5, "lat": 52.4}
    content["network"]["projection"] = "+proj=utm +zone=33"
    flight = content["uavs"][0]
    flight["start"] |= degrees
    flight["waypoints"] = [[*point, 13.5, 52.4] for point in flight["waypoints"]]
    forger.write("plan.json", content)
    reseal(forger.folder)
    assert verdict(forger.folder) == 0
    for key, value in (("lon", 181.0), ("lat", -91.0)):
        uav("start", key, value)(forger)
        assert verdict(forger.folder) == 2
        uav("start", key, degrees[key])(forger)
    uav("waypoints", 3, 4, 91.0)(forger)
    assert verdict(forger.folder) == 2


def test_there_are_many_kinds() -> None:
    assert len(FORGERIES) >= 100


def test_the_honest_pass(
    honest_run: Path, hovering_run: Path, verdict: Callable[[Path], int]
) -> None:
    assert verdict(honest_run) == 0
    assert verdict(hovering_run) == 0


def test_a_flight_off_the_roads_says_so(
    hovering_run: Path, tmp_path: Path, verdict: Callable[[Path], int]
) -> None:
    for change in (("plan_class", "roads"), ("bin_s", 2.0), ("landing_s", 1.0)):
        shutil.copytree(hovering_run, tmp_path / change[0])
        cert(*change)(Forger(tmp_path / change[0]))
        assert verdict(tmp_path / change[0]) in (1, 2), change


def honest_of_nothing() -> Iterator[Problem]:
    """Whatever is flown sees nobody in time; or all are seen at once."""
    yield small_problem(by_s=0.01)
    problem = small_problem()
    start = grid_futures(12, np.random.default_rng(3), size=3).positions(0.0).mean(axis=0)
    here = replace(problem.uav, x_m=float(start[0]), y_m=float(start[1]), take_off_s=0.0)
    yield problem.replace(uav=here, sensor=Sensor(1e6))


@pytest.mark.parametrize("number", [0, 1])
def test_values_of_zero_are_honest(
    number: int, tmp_path: Path, verdict: Callable[[Path], int]
) -> None:
    problem = list(honest_of_nothing())[number]
    write_certified(
        tmp_path, problem, plan_of_wait(problem, "wait", problem.uav.x_m, problem.uav.y_m)
    )
    stored = read_certificate(tmp_path / "plan.json")
    assert stored is not None
    assert stored.bound == pytest.approx(0.0, abs=1e-9)
    assert verdict(tmp_path) == 0


def test_a_certificate_that_lies_is_made_anew(tmp_path: Path) -> None:
    """Its gap is not believed: the bound is worked out again from the prices."""
    problem = small_problem()
    plan = plan_of_legs(problem, "rate", rate_order(WhatIf(problem))[::-1])
    write_certified(tmp_path, problem, plan, steps=200)
    path, honest = tmp_path / "plan.json", read_certificate(tmp_path / "plan.json")
    weak = certified(problem, plan, Effort(stop=WorkDone(3)))
    stays, is_earlier = write_better(tmp_path, path, problem, weak)
    assert (stays, is_earlier) == (honest, True)
    value = json.loads(path.read_text())["planned"]["expected_detection_time_s"]
    assert honest is not None
    assert honest.bound < value - 1.0
    Forger(tmp_path).put(
        "plan.json", "certificate", lambda c: c | {"gap": 0.0, "lower_bound_s": value}
    )
    stays, is_earlier = write_better(tmp_path, path, problem, weak)
    assert (stays.bound, is_earlier) == (weak.bound, False)


def test_nodes_at_one_place_are_joined(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever stands at one of them stands at the other: a flight of no length leads there."""
    legs = small_problem().legs
    at_one = np.vstack([legs.node_xy_m, legs.node_xy_m[:1]])
    hops = hops_of(replace(legs, node_xy_m=at_one, home_s=np.zeros(len(at_one))))
    ends = set(zip(hops.from_node.tolist(), hops.to_node.tolist(), strict=True))
    last = len(at_one) - 1
    assert {(0, last), (last, 0)} <= ends
    monkeypatch.syspath_prepend(TOOLS)
    checker = import_module("verify_bound")
    roads = [(a, b, at_one[[a, b]]) for a, b in ends if last not in (a, b)]
    uav = checker.Uav(0.0, (-1e4, 1e4), 100.0, None)
    with np.errstate(all="ignore"):
        found = checker.Hops(checker.Net(at_one, roads), uav, 1.0)
    assert {(0, last), (last, 0)} <= set(zip(found.start.tolist(), found.end.tolist(), strict=True))
    assert found.lasts_s.min() == 0.0


def test_the_checker_stands_alone() -> None:
    for name in CHECKER:
        text = (TOOLS / name).read_text(encoding="utf-8")
        for schema in ("planner.plan/1", "planner.plan/2", "planner.run/1"):
            text = text.replace(schema, "")
        assert "planner." not in text
        words = [
            line.split()[1].split(".")[0]
            for line in text.splitlines()
            if line.startswith(("import ", "from "))
        ]
        ours = {"numpy", "pyarrow", *(Path(one).stem for one in CHECKER)}
        assert set(words) <= ours | set(sys.stdlib_module_names)


def test_what_a_file_says_is_shown_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(TOOLS)
    shown = import_module("verify_files").shown
    assert shown("\x1b[2J" + "a\nb" + 300 * "c") == (" [2Ja b" + 300 * "c")[:200]
    assert shown(None) == "None"
