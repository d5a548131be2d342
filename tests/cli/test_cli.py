"""Every command with its flags, on the shipped scenarios and on a small town."""

import csv
import json
import os
import pty
import re
import resource
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
import pytest
from lxml import etree

import planner
from planner.cli import main
from planner.mission.run_folder import open_run
from planner.network.sumo import binary, sumo_home
from planner.report import run_files, where
from support.command_line import TOWN, Commands, Said, expected_s, flown_by_hand, in_a_process, rows

ROOT = Path(__file__).parents[2]
LIGHT = ("--set", "search.particles=50")
SCENARIOS = {
    "grid5x5": LIGHT,
    "figure1": LIGHT,
    "figure3": (),
    "figure3-gone": (),
    TOWN: (),
    "berlin": ("--set", "search.particles=3", "--set", "search.horizon_s=400"),
    f"{TOWN}/scenario.toml": ("--set", "target.driving=free", "--set", "search.particles=10"),
}
SHOWN = {
    "plan.png",
    "page.html",
    "plan.add.xml",
    "plan.sumocfg",
    "plan.view.xml",
    "plan.net.xml.gz",
}
FILES = {"plan.json", "evaluation.parquet", "run.json", *SHOWN}


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


@pytest.fixture(scope="session")
def grid_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A greedy plan on the grid, 50 particles and 50 targets."""
    folder = tmp_path_factory.mktemp("runs") / "grid"
    assert main(["plan", "grid5x5", *LIGHT, "--targets", "50", "-o", str(folder), "--json"]) == 0
    return folder


@pytest.fixture
def grid_copy(grid_run: Path, tmp_path: Path) -> Path:
    return shutil.copytree(grid_run, tmp_path / "moved" / "elsewhere")


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_every_command_on_every_scenario(run: Commands, scenario: str, tmp_path: Path) -> None:
    light = SCENARIOS[scenario]
    built = run("build", scenario, *light, "--json").json
    assert built["roads"] > 0
    assert Path(built["net"]).is_file()
    futures = run("futures", scenario, *light, "--json").json
    where = run("where", scenario, *light, "--at", "0:05:00", "--json").json
    there = sum(road["probability"] for road in where["roads"])
    assert there + where["elsewhere_probability"] == pytest.approx(1)
    options = ("--method", "wait", "--targets", "20", "-o", tmp_path / "run", "--json")
    planned = run("plan", scenario, *light, *options).json
    assert planned["planned"]["particles"] == futures["particles"]
    assert planned["evaluated"]["targets"] == 20
    flown = run("fly", tmp_path / "run", "--targets", "20", "--json").json
    assert flown["targets"] == 20


def test_plan_writes_what_it_says(grid_run: Path) -> None:
    assert {path.name for path in grid_run.iterdir()} == FILES
    plan = json.loads((grid_run / "plan.json").read_text())
    about = {"schema", "sighted_at", "network"}
    assert set(plan) == about | {"method", "uavs", "planned", "evaluated"}
    (uav,) = plan["uavs"]
    aircraft = {"altitude_m", "speed_mps", "max_flight_time_s", "start", "landing"}
    assert set(uav) == aircraft | {"waypoints", "legs", "sensor_on"}
    legs = {"road", "from_node", "to_node", "depart_s", "start_s", "end_s"}
    assert all(set(leg) == legs for leg in uav["legs"])
    assert all(len(waypoint) == 3 for waypoint in uav["waypoints"])
    assert set(plan["planned"]) - {"objective"} == {
        "expected_detection_time_s",
        "detection_probability",
        "particles",
        "horizon_s",
        "radius_m",
    }
    assert set(plan["evaluated"]) - {"objective"} == {
        "expected_detection_time_s",
        "ci95_s",
        "detection_probability",
        "found_before_goal_probability",
        "targets",
        "seed",
    }
    schema = etree.XMLSchema(etree.parse(sumo_home() / "data" / "xsd" / "additional_file.xsd"))
    schema.assertValid(etree.parse(grid_run / "plan.add.xml"))


@pytest.mark.parametrize("transit", ["true", "false"])
@pytest.mark.parametrize("scenario", ["grid5x5", "figure3", "figure3-gone", TOWN])
def test_the_files_alone_reproduce_the_figures(
    run: Commands, scenario: str, transit: str, tmp_path: Path
) -> None:
    options = (*SCENARIOS[scenario], "--set", f"sensor.detects_in_transit={transit}", "--json")
    assert run("futures", scenario, *options, "-o", tmp_path / "futures").code == 0
    method = "wait" if scenario == TOWN else "exhaustive"
    output = ("--method", method, "--targets", "20", "-o", tmp_path / "run")
    assert run("plan", scenario, *options, *output).code == 0
    plan = json.loads((tmp_path / "run" / "plan.json").read_text())
    seen, weight = flown_by_hand(plan, tmp_path / "futures")
    told, horizon_s = plan["planned"], plan["planned"]["horizon_s"]
    assert told["detection_probability"] > 0
    assert expected_s(seen, weight, horizon_s) == pytest.approx(told["expected_detection_time_s"])
    assert weight @ (seen <= horizon_s) == pytest.approx(told["detection_probability"])
    evaluation = rows(tmp_path / "run" / "evaluation.parquet")
    fresh_s = expected_s(
        np.array(evaluation["seen_at_s"]), np.array(evaluation["weight"]), horizon_s
    )
    assert fresh_s == pytest.approx(plan["evaluated"]["expected_detection_time_s"])


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_the_same_command_gives_the_same_bytes(
    grid_run: Path, tmp_path: Path, empty_cache: Path, jobs: str
) -> None:
    output = tmp_path / "again"
    options = ("--targets", "50", "-o", output, "-j", jobs)
    assert in_a_process("plan", "grid5x5", *LIGHT, *options).code == 0
    assert any(empty_cache.rglob("futures.parquet"))
    for name in FILES - {"run.json"}:
        assert (output / name).read_bytes() == (grid_run / name).read_bytes(), name


def test_seeds_and_settings_matter(run: Commands) -> None:
    common = ("plan", "figure3", "--method", "wait", "--targets", "30", "--json")
    first = run(*common).json
    assert run(*common).json == first
    assert run(*common, "-s", "9").json["evaluated"] != first["evaluated"]
    assert run(*common, "-s", "9").json["planned"] == first["planned"]  # it takes all 100 futures
    wide = run(*common, "--set", "sensor.radius_m=2000").json
    assert wide["planned"]["radius_m"] == 2000
    early = wide["planned"]["expected_detection_time_s"]
    assert early < first["planned"]["expected_detection_time_s"]
    late = run(*common, "--set", "uav.take_off_s=0:10:00").json
    assert late == run(*common, "--set", "uav.take_off_s=600").json
    assert late != first


def test_a_run_is_not_overwritten(
    run: Commands, grid_copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = {path.name: path.read_bytes() for path in grid_copy.iterdir()}
    options = ("--method", "wait", "--targets", "20", "-o", grid_copy)
    (grid_copy / "flights.csv").touch()
    (grid_copy / "notes.txt").write_text("mine")
    with monkeypatch.context() as patch:
        patch.setattr("planner.cli.session.open_scenario", None)  # no work comes before the refusal
        refused = run("plan", "figure3", *options)
    assert refused.code == 2
    assert "already" in refused.err
    assert "--force" in refused.err
    assert {name: (grid_copy / name).read_bytes() for name in before} == before
    assert run("plan", "figure3", *options, "--force").code == 0
    assert {path.name for path in grid_copy.iterdir()} == FILES | {"notes.txt"}
    assert json.loads((grid_copy / "plan.json").read_text())["method"] == "wait"


def test_nothing_is_half_written(
    run: Commands, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(run_files, "plan_picture", full)
    output = tmp_path / "new" / "run"
    said = run("plan", "figure3", "--method", "wait", "--targets", "20", "-o", output)
    assert said.code == 2
    assert said.err.startswith(f"planner: {output}: cannot be written (No space left on device)")
    assert not (tmp_path / "new").exists()


FLIGHTS = "target,speed,route,found,before_goal,detection_time_s,x_m,y_m,leg"


def flights(folder: Path) -> list[dict[str, str]]:
    with (folder / "flights.csv").open(newline="", encoding="utf-8") as file:
        assert file.readline().strip() == FLIGHTS
        return list(csv.DictReader(file, FLIGHTS.split(",")))


def test_fly(run: Commands, grid_copy: Path) -> None:
    told = run("fly", grid_copy, "--json").json
    table = flights(grid_copy)
    assert len(table) == told["targets"] == 1000
    found = [row["found"] == "1" for row in table]
    assert np.mean(found) == pytest.approx(told["detection_probability"])
    times_s = [float(row["detection_time_s"]) for row in table]
    assert np.mean(times_s) == pytest.approx(told["expected_detection_time_s"])
    assert told["ci95_s"][0] < np.mean(times_s) < told["ci95_s"][1]
    assert all(row["x_m"] == row["leg"] == "" for row in table if row["found"] == "0")
    before = np.mean([row["before_goal"] == "1" for row in table])
    assert before == pytest.approx(told["found_before_goal_probability"])
    assert {row["detection_time_s"] for row in table if row["found"] == "0"} <= {"10000.0"}


def test_other_seeds_are_other_targets(run: Commands, grid_copy: Path) -> None:
    def speeds(*options: str) -> list[str]:
        assert run("fly", grid_copy, "--targets", "20", "--force", *options).code == 0
        return [row["speed"] for row in flights(grid_copy)]

    first = speeds()
    assert speeds() == first
    assert not set(speeds("-s", "2")) & set(first)


def test_nobody_draws_from_the_stream_of_the_truth() -> None:
    opened = planner.open_scenario("grid5x5", overrides=["search.particles=50"])
    recorder = planner.Recorder(opened)
    seed = opened.scenario.search.seed
    drawn = [recorder.planning(), recorder.evaluation(50), recorder.truths(50, seed=seed)]
    drawn.append(recorder.planning(1))
    speeds = [speed for recording in drawn for speed in recording.speed_mps]
    assert len(set(speeds)) == len(speeds)
    seeds = [rows(one.path.with_name("particles.parquet"))["seed"] for one in drawn]
    assert not set(seeds[0]) & set(seeds[2])


def test_the_scenario_says_how_exactly_motion_is_recorded(run: Commands, tmp_path: Path) -> None:
    said = []
    for name, *options in (("default",), ("given", "--set", "futures.tolerance_m=2.5")):
        folder = tmp_path / name
        assert run("futures", "figure3", *options, "-o", folder).code == 0
        schemas = [pyarrow.parquet.read_schema(path) for path in sorted(folder.iterdir())]
        said.append([schema.metadata[b"tolerance_m"] for schema in schemas])
    assert said == [[b"1.0"] * 3, [b"2.5"] * 3]


@pytest.mark.parametrize(("offset_m", "begin_m"), [(None, 0.0), (5000.0, 5000.0)])
def test_fly_against_a_predefined_target(
    run: Commands, grid_copy: Path, offset_m: float | None, begin_m: float
) -> None:
    offset = () if offset_m is None else ("--target-offset", offset_m)
    route = ("--route", "r0c0-r0c1 r0c1-r1c1 r1c1-r2c1", "--target-speed", "20", *offset)
    told = run("fly", grid_copy, *route, "--json").json
    (row,) = flights(grid_copy)
    assert told["targets"] == 1
    assert (row["speed"], row["route"]) == ("20.0", "r0c0-r0c1 r0c1-r1c1 r1c1-r2c1")
    driven_m = begin_m + 20 * float(row["detection_time_s"])
    goal = driven_m >= 45000
    along = min(driven_m, 45000.0)
    x_m, y_m = min(along, 15000.0), -max(0.0, along - 15000.0)
    if told["found"]:
        assert (float(row["x_m"]), float(row["y_m"])) == pytest.approx((x_m, y_m), abs=0.01)
        assert row["before_goal"] == str(int(not goal))
    said = run("fly", grid_copy, *route, "--force").out
    assert ("found after" in said) == told["found"]


def test_fly_keeps_to_the_run(run: Commands, tmp_path: Path) -> None:
    scenario = shutil.copytree(ROOT / "sumo_nets" / "figure3", tmp_path / "sums")
    options = ("--method", "wait", "--targets", "20")
    assert run("plan", scenario, *options, "-o", tmp_path / "run").code == 0
    first = run("fly", tmp_path / "run", "--targets", "20", "--json").json
    text = (scenario / "scenario.toml").read_text()
    (scenario / "scenario.toml").write_text(text.replace("horizon_s = ", "horizon_s = 1"))
    moved = shutil.move(tmp_path / "run", tmp_path / "deep" / "er")
    (moved / "flights.csv").unlink()
    again = run("fly", moved, "--targets", "20", "--json").json
    assert again == first | {"flights": str(moved / "flights.csv")}
    edges = (scenario / "figure3.edg.xml").read_text()
    (scenario / "figure3.edg.xml").write_text(edges.replace('id="DG"', 'id="DX"'))
    changed = run("fly", moved, "--force")
    assert changed.code == 2
    assert "another network" in changed.err


def test_a_run_is_a_scenario(run: Commands, grid_run: Path) -> None:
    told = run("plan", grid_run / "run.json", "--targets", "50", "--json").json
    plan = json.loads((grid_run / "plan.json").read_text())
    assert told["evaluated"] == plan["evaluated"]


@pytest.mark.parametrize(
    ("scenario", "reasons"),
    [
        ("grid5x5", {"exact": "orders"}),
        ("figure1", {"exact": "orders"}),
        ("figure3", {}),
        (TOWN, dict.fromkeys(("exhaustive", "exhaustive-shortest"), "cycle")),
    ],
)
def test_compare(run: Commands, scenario: str, reasons: dict[str, str], tmp_path: Path) -> None:
    options = ("--targets", "50", "--json", "-o", tmp_path / "table.csv")
    told = run("compare", scenario, *LIGHT, *options).json["methods"]
    assert [row["method"] for row in told] == [method.name for method in planner.METHODS]
    with (tmp_path / "table.csv").open(newline="", encoding="utf-8") as file:
        assert [row["method"] for row in csv.DictReader(file)] == [row["method"] for row in told]
    by_name = {row["method"]: row for row in told}
    for name, word in reasons.items():
        assert word in by_name[name]["why_not"]
    worst = by_name["random"]["expected_detection_time_s"]
    assert by_name["greedy"]["expected_detection_time_s"] < worst
    assert run("compare", scenario, *options[:2], *options[3:]).code == 2  # it is there already


@pytest.mark.parametrize("columns", ["80", "120"])
def test_compare_shows_every_method(
    run: Commands, columns: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    said = run("compare", TOWN, "--targets", "20", "-o", tmp_path / "table.csv").out
    assert "".join(said.split()).endswith(f"writtento{tmp_path / 'table.csv'}")
    for method in planner.METHODS:
        assert re.search(rf"^ +{method.name} ", said, re.MULTILINE)
    ways = re.search(r"^exhaustive\b[^:]*: the network has a cycle: ([^;]*)", said, re.MULTILINE)
    assert ways is not None
    assert len(re.findall(r"[a-z]+-[a-z]+", ways[1])) >= 2  # the roads of the cycle


def test_where(run: Commands, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    options = ("figure3-gone", "--at", "0:16:40")
    said = run("where", *options, "-o", tmp_path / "where")
    assert "".join(said.out.split()).endswith(f"writtento{tmp_path / 'where'}")
    assert "0:16:40" in said.out
    assert {path.name for path in (tmp_path / "where").iterdir()} == {"where.csv", "where.png"}
    with (tmp_path / "where" / "where.csv").open(newline="", encoding="utf-8") as file:
        table = {row["road"]: float(row["probability"]) for row in csv.DictReader(file)}
    # 25 speeds from 6 to 30 m/s: in 1,000 s some are still on the first road of 5 km, if any.
    lengths_m = {"AB": 5000.0, "BC": np.hypot(5000, 4000)}
    second = [v for v in range(6, 31) if lengths_m["AB"] <= 1000 * v < sum(lengths_m.values())]
    assert table["BC"] == pytest.approx(len(second) / 50)
    assert run("where", *options, "-o", tmp_path / "where").code == 2
    assert "--all" not in said.out
    monkeypatch.setattr(where, "MOST_ROWS", 1)
    short, whole = run("where", *options), run("where", *options, "--all")
    assert f"--all lists all {len(table)} roads" in short.out
    assert "other roads" in short.out
    assert not {"other", "--all"} & set(whole.out.split())
    assert set(table) <= set(whole.out.split())


def test_build_writes_the_net(run: Commands, tmp_path: Path) -> None:
    net = tmp_path / "own" / "figure1.net.xml"
    assert run("build", "figure1", "-o", net).code == 0
    before = net.stat().st_mtime_ns
    assert "--force" in run("build", "figure3", "-o", net).err
    assert net.stat().st_mtime_ns == before
    assert run("build", "figure1", "-o", net, "--force").code == 0
    assert len(planner.read_net(net).road_ids) == 10
    told = run("plan", "figure1", "-n", net, *LIGHT, "--method", "wait", "--targets", "5", "--json")
    assert told.code == 0


def test_doctor(run: Commands) -> None:
    told = run("doctor", "--json").json["findings"]
    assert all(finding["fine"] for finding in told)
    assert {"Python", "libsumo", "netconvert runs"} <= {finding["what"] for finding in told}


def test_planning_on_futures_from_a_file(run: Commands, tmp_path: Path) -> None:
    folder = tmp_path / "futures"
    assert run("futures", "figure3-gone", "-o", folder).code == 0
    late = ("--set", "uav.take_off_s=1500")  # when many have reached their goal
    options = ("plan", "figure3-gone", *late, "--method", "wait", "--targets", "20", "--json")
    own = run(*options, "--futures", folder / "futures.parquet").json
    assert own["planned"]["particles"] == 80  # a fifth of the vehicles is kept out
    assert own["evaluated"]["targets"] == 20
    few, iid = tmp_path / "few", ("--set", "search.particles=60", "--set", "search.sampling=iid")
    assert run("futures", "figure3-gone", *iid, "-o", few).code == 0
    same = run(*options, "--futures", few / "futures.parquet").json
    assert same == run(*options, *iid).json
    (folder / "particles.parquet").unlink()
    stays = run(*options, "--futures", folder / "futures.parquet").json
    gain = stays["planned"]["detection_probability"] - own["planned"]["detection_probability"]
    assert gain > 0.1  # those that stay can still be found


@pytest.mark.parametrize("kind", ["xml", "parquet"])
def test_planning_on_what_sumo_wrote(run: Commands, tmp_path: Path, kind: str) -> None:
    net = run("build", "figure3", "--json").json["net"]
    routes = tmp_path / "cars.rou.xml"
    cars = "".join(
        f'<vehicle id="{i}" depart="{60 * i}"><route edges="AB BC {last}"/></vehicle>'
        for i, last in enumerate(["CE", "CF", "CE", "CE"])
    )
    routes.write_text(f"<routes>{cars}</routes>")
    fcd = tmp_path / f"fcd.{kind}"
    arguments = ["-n", net, "-r", routes, "--fcd-output", fcd, "--no-step-log", "-e", "2000"]
    subprocess.run([binary("sumo"), *arguments], check=True, capture_output=True)
    options = ("--method", "wait", "--targets", "20", "--json")
    told = run("plan", "figure3", *options, "--futures", fcd).json
    assert told["planned"]["particles"] == 4
    # Most end at E: there it waits, and finds the three that come.
    assert told["planned"]["detection_probability"] >= 0.75
    assert told["evaluated"]["targets"] == 20


def test_preset_paper(run: Commands, tmp_path: Path) -> None:
    take_off_s = {}
    for method in ("greedy", "exhaustive", "wait"):
        options = (*LIGHT, "--targets", "20", "--method", method, "-o", tmp_path / method)
        assert run("plan", "grid5x5", "--preset", "paper", *options).code == 0
        plan = json.loads((tmp_path / method / "plan.json").read_text())
        take_off_s[method] = plan["uavs"][0]["waypoints"][0][0]
    assert take_off_s == {"greedy": 300, "exhaustive": 0, "wait": 0}
    opened, _ = open_run(tmp_path / "wait")
    truths = planner.Recorder(opened).truths(20, seed=1).futures
    firsts = truths.first_knot[:-1]
    assert np.all(truths.time_s[firsts] == 0)
    assert np.allclose([truths.x_m[firsts], truths.y_m[firsts]], 0)


def test_a_target_that_may_not_exist(run: Commands) -> None:
    options = ("plan", "figure3", "--method", "wait", "--targets", "50", "--json")
    sure = run(*options).json
    maybe = run(*options, "--set", "target.probability_present=0.5").json
    for part in ("planned", "evaluated"):
        for share in ("detection_probability", "found_before_goal_probability"):
            if share in sure[part]:
                assert maybe[part][share] == pytest.approx(sure[part][share] / 2)
        expected = sure[part]["expected_detection_time_s"]
        assert maybe[part]["expected_detection_time_s"] == pytest.approx((expected + 3600) / 2)


def test_a_sighting_some_time_ago(run: Commands, tmp_path: Path) -> None:
    options = ("--method", "wait", "--targets", "20", "--set", "target.last_seen_ago_s=0:02:00")
    output = ("--set", "uav.take_off_s=30", "-o", tmp_path / "run")
    assert run("plan", "figure3", *options, *output).code == 0
    plan = json.loads((tmp_path / "run" / "plan.json").read_text())
    assert plan["uavs"][0]["waypoints"][0][0] == 150


def test_tick_is_an_option(run: Commands) -> None:
    options = ("plan", "figure3", "--method", "greedy", "--targets", "20", "--json")
    coarse = run(*options, "--tick", "0:00:10").json
    assert coarse["method"] == "greedy"
    by_key = run(*options, "--set", "greedy.tick_s=10").json
    assert coarse == by_key


def test_log_lines_go_to_stderr(run: Commands, empty_cache: Path) -> None:
    options = ("futures", "figure1", *LIGHT)
    told = run(*options, "-v", "--json")
    assert told.json["particles"] == 50
    assert told.err.startswith("planner: netconvert builds")
    assert "planner: recording futures: 50 of 50" in told.err
    assert all(line.startswith("planner: ") for line in told.err.splitlines())
    quiet = run(*options)
    assert quiet.err == ""
    assert "particles" in quiet.out


@pytest.mark.parametrize("command", ["", "plan", "fly", "where", "doctor"])
def test_help_is_quick(command: str) -> None:
    code = f"""import sys
from planner.cli import main
try:
    main([*{command.split()!r}, "--help"])
except SystemExit as ended:
    assert ended.code == 0
assert not {{"numpy", "pydantic", "rich"}} & set(sys.modules)"""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert after.ru_utime - before.ru_utime < 0.3
    assert "usage: planner" in done.stdout


def test_versions(run: Commands) -> None:
    said = run("--version")
    assert said.code == 0
    assert said.out.startswith("planner ")
    assert "SUMO 1.28" in said.out


def test_a_plan_that_may_leave_the_roads(run: Commands, tmp_path: Path) -> None:
    given = ("plan", "figure3", "--free", "--set", "search.work=3000", "--targets", 50)
    assert run(*given, "--json").json["method"] == "best"


def test_as_a_module() -> None:
    said = in_a_process("where", "figure3", "--at", "600", "--json", PYTHONPATH=str(ROOT))
    assert said.json["time_s"] == 600
    assert said.err == ""


def on_a_terminal(*arguments: str, **environment: str) -> str:
    """What a person sees, as bytes of a terminal in text."""
    ours, theirs = pty.openpty()
    keep = {key: value for key, value in os.environ.items() if key != "COLUMNS"}
    running = subprocess.Popen(
        [sys.executable, "-m", "planner", *arguments],
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env={**keep, "TERM": "xterm-256color", **environment},
    )
    os.close(theirs)
    seen = b""
    while True:
        try:
            piece = os.read(ours, 65536)
        except OSError:  # how Linux tells that the other side has hung up
            break
        if not piece:
            break
        seen += piece
    os.close(ours)
    assert running.wait(60) == 0
    return seen.decode(errors="replace")


def test_a_terminal_gets_bars_and_colours(empty_cache: Path) -> None:
    seen = on_a_terminal("where", "grid5x5", *LIGHT, "--at", "600")
    assert "recording futures" in seen
    assert "━" in seen
    assert re.search(r"\x1b\[[0-9;]*3[0-9]m|\x1b\[38;", seen)
    assert "r0c0-r0c1" in seen


def test_no_color(empty_cache: Path) -> None:
    seen = on_a_terminal("where", "grid5x5", *LIGHT, "--at", "600", NO_COLOR="1")
    assert "recording futures" in seen
    assert not re.search(r"\x1b\[[0-9;]*3[0-9]m|\x1b\[38;", seen)


def test_said_is_json_alone() -> None:
    with pytest.raises(json.JSONDecodeError):
        _ = Said(0, "hello\n{}", "").json
