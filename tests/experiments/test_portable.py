"""The instances as plain files: complete, the same bytes again, and scored by NumPy alone."""

import ast
import hashlib
import json
import math
import runpy
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from planner.detection.evaluate import evaluate_all
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor, rate_of
from planner.detection.survival import Searched
from planner.errors import InputError
from planner.experiments import submissions
from planner.experiments.instances import instances_path, read_instances
from planner.experiments.portable import JUDGED, folder_of, rounded
from planner.flight.track import Track
from planner.futures.futures import Futures
from support.command_line import Commands

ROOT = Path(__file__).parents[2]
TEST = ROOT / "docs" / "instances" / "test"
SCORER = runpy.run_path(str(ROOT / "tools" / "score.py"))
NAME = "figure3-gone-30-km"
FLIGHTS = json.loads((TEST / "flights.json").read_text())


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One small instance, exported."""
    folder = tmp_path_factory.mktemp("exported") / "instances"
    run = [sys.executable, "-m", "planner", "instances", "export", str(folder), "-j", "1"]
    done = subprocess.run(
        [*run, "--only", NAME, "--targets", "400"],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
    )
    assert done.returncode == 0, done.stderr
    assert "1 instance, " in done.stdout
    return folder


def schema() -> Any:
    form = json.loads((ROOT / "docs" / "instance.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(form)
    return jsonschema.Draft202012Validator(form)


def test_the_folder_is_complete(exported: Path) -> None:
    here = exported / NAME
    assert {path.name for path in here.iterdir()} == {
        "instance.json",
        "planning.npz",
        "judging.npz",
        "best.json",
        "LICENCE.md",
    }
    about = json.loads((here / "instance.json").read_text())
    schema().validate(about)
    assert about["name"] == "figure3-gone, 30 km"
    with np.load(here / "judging.npz") as file:
        judging = dict(file)
    assert {name: column.dtype for name, column in judging.items()} == {
        "time_s": np.float32,
        "x_m": np.float32,
        "y_m": np.float32,
        "first_knot": np.int64,
        "weight": np.float64,
        "gone": bool,
    }
    assert len(judging["weight"]) == 400
    assert judging["gone"].all()
    lines = (exported / "SHA256SUMS").read_text().splitlines()
    summed = dict(reversed(line.split("  ")) for line in lines)
    files = {p.relative_to(exported).as_posix(): p for p in exported.rglob("*") if p.is_file()}
    assert summed.keys() == files.keys() - {"SHA256SUMS"}
    for name, digest in summed.items():
        assert hashlib.sha256(files[name].read_bytes()).hexdigest() == digest
    page = (exported / "README.md").read_text()
    assert submissions.SEED_SHA256 in page
    assert f"({NAME}/instance.json)" in page
    assert "@" not in page


def test_it_is_the_same_again_and_not_written_over(
    exported: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = Commands(capsys)
    again = ("instances", "export", "--only", "figure3-gone, 30 km", "--targets", 400, "-j", 1)
    told = run(*again, tmp_path / "again", "--json").json
    assert told["instances"][0]["folder"] == NAME
    sums = (exported / "SHA256SUMS").read_bytes()
    assert (tmp_path / "again" / "SHA256SUMS").read_bytes() == sums
    said = run(*again, tmp_path / "again")
    assert (said.code, said.err.count("\n")) == (2, 1)
    assert "--force" in said.err
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine")
    said = run(*again, tmp_path / "mine")
    assert (said.code, said.err.count("\n")) == (2, 1)
    assert "mine: is not empty; " in said.err
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["notes.txt"]


def test_the_scorer_shares_no_code() -> None:
    tree = ast.parse((ROOT / "tools" / "score.py").read_text())
    names = {
        name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names
    } | {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert names == {"argparse", "json", "math", "pathlib", "typing", "numpy"}


def test_a_plan_is_scored_from_the_folder_alone(exported: Path, tmp_path: Path) -> None:
    shutil.copytree(exported, tmp_path / "elsewhere")

    def scored(plan: Path, *more: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-I", "score.py", NAME, str(plan), *more]
        return subprocess.run(
            command, cwd=tmp_path / "elsewhere", capture_output=True, text=True, check=False
        )

    best = tmp_path / "elsewhere" / NAME / "best.json"
    known = json.loads((best.parent / "instance.json").read_text())["best_known"]
    for futures in ("judging.npz", "planning.npz"):
        found = json.loads(scored(best, "--futures", futures).stdout)
        assert found["expected_detection_time_s"] == pytest.approx(
            known[futures]["expected_detection_time_s"], abs=0.06
        )
        assert found["ci95_s"] == pytest.approx(known[futures]["ci95_s"], abs=0.06)
        for name in ("detection_probability", "detection_ci95"):
            assert found[name] == pytest.approx(known[futures][name], abs=1e-4)
    plan = json.loads(best.read_text())
    plan["uavs"][0]["waypoints"][1][0] -= 30.0
    best.write_text(json.dumps(plan))
    said = scored(best)
    assert said.returncode == 2
    assert "uavs[0]: is faster than 100.0 m/s" in said.stderr


# The scorer against the program, and against a slow twin


def read_test() -> tuple[dict[str, Any], dict[str, Any]]:
    about, columns = SCORER["read"](TEST)
    return about, columns


def test_the_test_flights_have_their_scores(capsys: pytest.CaptureFixture[str]) -> None:
    assert len(FLIGHTS) == 20
    assert {(len(one["uavs"]), one["detects"]) for one in FLIGHTS} >= {
        (uavs, detects) for uavs in (1, 2, 3) for detects in (1.0, 0.9, 0.5, 0.1)
    }
    schema().validate(json.loads((TEST / "instance.json").read_text()))
    assert sum(file.stat().st_size for file in TEST.iterdir()) < 1e6
    assert SCORER["test"](TEST) < 1e-5
    assert "at most " in capsys.readouterr().out


def futures_of(columns: dict[str, Any]) -> Futures:
    wide = {k: v.astype(float) for k, v in columns.items() if v.dtype == np.float32}
    return Futures(**{**columns, **wide})


@pytest.mark.parametrize("flight", FLIGHTS, ids=lambda f: f["name"])
def test_the_program_agrees(flight: dict[str, Any]) -> None:
    about, columns = read_test()
    radius_m, searched = about["sensor"]["radius_m"], []
    for one, uav in zip(flight["uavs"], about["uavs"], strict=False):
        time_s, x_m, y_m = np.array(one["waypoints"]).T
        track = Track(time_s, x_m, y_m, np.array([[time_s[0], time_s[-1]]]))
        rate_per_s = rate_of(flight["detects"], radius_m, uav["speed_mps"])
        searched.append(Searched(track, Sensor(radius_m, rate_per_s=rate_per_s)))
    found = evaluate_all(searched, futures_of(columns), Objective(about["horizon_s"]))
    figures = {
        "expected_detection_time_s": found.expected_detection_time_s,
        "ci95_s": found.ci95_s,
        "detection_probability": found.detection_probability,
        "detection_ci95": found.found_interval,
    }
    for name, figure in figures.items():
        assert figure == pytest.approx(flight["score"][name], abs=1e-6)


@pytest.mark.parametrize("flight", FLIGHTS[::3], ids=lambda f: f["name"])
def test_a_slow_twin_agrees(flight: dict[str, Any]) -> None:
    """Steps of a twentieth of a second: who is within the radius, and still undetected."""
    about, columns = read_test()
    first = columns["first_knot"][:26]
    few = {
        "first_knot": first,
        "weight": columns["weight"][:25],
        "gone": columns["gone"][:25],
        **{name: columns[name][: first[-1]] for name in ("time_s", "x_m", "y_m")},
    }
    found = SCORER["score"](about, flight, few, flight["detects"])
    step_s, horizon_s, radius_m = 0.05, about["horizon_s"], about["sensor"]["radius_m"]
    times = np.arange(0.0, horizon_s, step_s) + step_s / 2
    expected_s, probability = horizon_s * (1 - few["weight"].sum()), 0.0
    for k in range(25):
        mine = slice(first[k], first[k + 1])
        t, x, y = (few[name][mine].astype(float) for name in ("time_s", "x_m", "y_m"))
        there = (times >= t[0]) & ~(few["gone"][k] & (times > t[-1]))
        rate = np.zeros(len(times))
        for one, uav in zip(flight["uavs"], about["uavs"], strict=False):
            way = np.array(one["waypoints"])
            off = [
                np.interp(times, way[:, 0], way[:, axis]) - np.interp(times, t, place)
                for axis, place in ((1, x), (2, y))
            ]
            flies = (times >= way[0, 0]) & (times <= way[-1, 0])
            sees = there & flies & (np.hypot(*off) <= radius_m)
            p = min(flight["detects"], 1.0 - 1e-12)  # 1: as good as at once
            fast = -math.log1p(-p) * uav["speed_mps"] * (1.0 if p < 0.99 else 1000.0)
            rate += sees * fast / (2 * radius_m)
        unseen = np.exp(-np.cumsum(rate * step_s))
        expected_s += few["weight"][k] * (step_s * unseen.sum())
        probability += few["weight"][k] * (1 - unseen[-1])
    assert found["expected_detection_time_s"] == pytest.approx(expected_s, abs=0.3)
    assert found["detection_probability"] == pytest.approx(probability, abs=0.01)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda ways: ways[0].insert(0, [0.0, 0.0, 0.0]), "should begin with"),
        (lambda ways: ways[0].append([1e4, 0.0, 0.0]) or ways.extend(ways * 3), "flies 4 UAVs"),
        (lambda ways: ways[0].append([0.0, 0.0, 0.0]), "should never fall"),
        (lambda ways: ways[0].append([ways[0][-1][0] + 0.1, 9e3, 0.0]), "is faster than 25.0 m/s"),
    ],
)
def test_what_no_uav_can_fly_is_refused(change: Any, told: str) -> None:
    about, columns = read_test()
    ways = [[list(point) for point in FLIGHTS[0]["uavs"][0]["waypoints"]]]
    change(ways)
    plan = {"uavs": [{"waypoints": way} for way in ways]}
    with pytest.raises(ValueError, match=told):
        SCORER["score"](about, plan, columns)


@pytest.mark.parametrize(
    "text",
    [
        "{}",
        "[]",
        "3",
        '{"uavs": 3}',
        '{"uavs": []}',
        '{"uavs": [{}]}',
        '{"uavs": [{"waypoints": []}]}',
        '{"uavs": [{"waypoints": [1, 2, 3]}]}',
        '{"uavs": [{"waypoints": [[1, 2]]}]}',
        '{"uavs": [{"waypoints": [["a", 2, 3]]}]}',
    ],
)
def test_a_plan_that_is_none_is_told_in_words(text: str) -> None:
    about, columns = read_test()
    with pytest.raises(ValueError, match="should hold"):
        SCORER["score"](about, json.loads(text), columns)


@pytest.mark.parametrize("text", [None, "{", "{}"])
def test_the_scorer_ends_with_one_line(
    tmp_path: Path,
    text: str | None,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    plan = tmp_path / "mine.json"
    if text is not None:
        plan.write_text(text)
    for folder, named in ((TEST, str(plan)), (tmp_path, f"{tmp_path}: is no folder")):
        monkeypatch.setattr(sys, "argv", ["score.py", str(folder), str(plan)])
        with pytest.raises(SystemExit) as ended:
            SCORER["main"]()
        assert ended.value.code == 2
        assert named in capsys.readouterr().err.splitlines()[-1]


def test_one_future_tells_little() -> None:
    about, columns = read_test()
    end = columns["first_knot"][1]
    one = {name: columns[name][:end] for name in ("time_s", "x_m", "y_m")}
    one |= {
        "first_knot": columns["first_knot"][:2],
        "weight": np.ones(1),
        "gone": np.zeros(1, bool),
    }
    found = SCORER["score"](about, FLIGHTS[0], one)
    assert found["ci95_s"] == [-math.inf, math.inf]


def test_rounding_keeps_times_rising() -> None:
    time_s = np.array([0.0, 5000.0, 5000.00001, 6000.0, 1.0, 2.0])
    futures = Futures(
        time_s=time_s,
        x_m=np.arange(6.0),
        y_m=np.zeros(6),
        first_knot=np.array([0, 4, 4, 6]),
        weight=np.full(3, 1 / 3),
        gone=np.zeros(3, dtype=bool),
    )
    small = rounded(futures)
    assert small.first_knot.tolist() == [0, 3, 3, 5]
    assert small.x_m.tolist() == [0.0, 2.0, 3.0, 4.0, 5.0]


# Submitted plans


def test_results_are_of_the_futures_that_are_opened(
    exported: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    run = Commands(capsys)
    plans, seed, page = tmp_path / "plans", tmp_path / "seed.txt", tmp_path / "page.md"
    (plans / "stays").mkdir(parents=True)
    (plans / "copies").mkdir()
    shutil.copyfile(exported / NAME / "best.json", plans / "copies" / "a.json")
    about = json.loads((exported / NAME / "instance.json").read_text())
    uav = about["uavs"][0]
    stays = [[uav["take_off_s"] + s, uav["x_m"], uav["y_m"]] for s in (0.0, 900.0)]
    stays_plan = {"instance": about["name"], "uavs": [{"waypoints": stays}]}
    (plans / "stays" / "b.json").write_text(json.dumps(stays_plan))
    asked = ("instances", "results", plans, "--only", NAME, "--targets", 300, "-j", 1)
    said = run(*asked)
    assert said.code == 0, said.err
    assert "| instance | best known | copies | stays |" in said.out
    assert "third set is still" in said.out
    secret = run(*asked, "--seed-file", tmp_path / "none.txt")
    assert (secret.code, secret.err.count("\n")) == (2, 1)
    seed.write_text("another one\n")
    said = run(*asked, "--seed-file", seed)
    assert said.code == 2
    assert "is not the seed that was promised" in said.err
    digest = hashlib.sha256(b"another one").hexdigest()
    monkeypatch.setattr(submissions.read_seed, "__defaults__", (digest,))
    told = run(*asked, "--seed-file", seed, "-o", page, "--json").json
    values = {one["whose"]: one["expected_detection_time_s"] for one in told["scores"]}
    assert values["copies"] == pytest.approx(values["best known"])
    assert values["stays"] == pytest.approx(about["horizon_s"])
    assert "seed `another one`" in page.read_text()
    open_values = {row["whose"]: row for row in run(*asked, "--json").json["scores"]}
    assert open_values["copies"]["expected_detection_time_s"] != values["copies"]
    stays_plan["uavs"][0]["waypoints"][1][1] = 1e6
    (plans / "stays" / "b.json").write_text(json.dumps(stays_plan))
    said = run(*asked)
    assert said.code == 2
    assert "b.json: flies " in said.err


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("{}", 'should hold "instance" and "uavs"'),
        ('{"instance": "x", "uavs": []}', "instance: x is none; there are grid4x4-0-km"),
        ("[]", 'should hold "instance" and "uavs"'),
        (None, "holds no plans"),
    ],
)
def test_a_broken_submission_is_told(tmp_path: Path, text: str | None, told: str) -> None:
    if text is not None:
        (tmp_path / "me").mkdir()
        (tmp_path / "me" / "a.json").write_text(text)
    with pytest.raises(InputError, match=told):
        submissions.read_submissions(tmp_path, read_instances(instances_path()))


def test_names_of_folders_differ() -> None:
    instances = read_instances(instances_path())
    assert len({folder_of(one.name) for one in instances}) == len(instances)
    assert folder_of("grid4x4, 60 km") == "grid4x4-60-km"
    assert JUDGED == 8000
    assert len(submissions.SEED_SHA256) == 64
