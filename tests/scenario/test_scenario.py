"""Scenario files: what they say, and every way in which they can be wrong."""

import json
import logging
from datetime import UTC, datetime
from pathlib import Path

import pytest

from planner.clock import seconds
from planner.errors import InputError, ScenarioError
from planner.scenario.draft import read_draft, read_scenario
from planner.scenario.toml_text import scenario_text
from planner.scenario.uav_values import NodeStart, PointStart

SMALL = """
[network]
net = "town.net.xml"
[target]
start = { a = 0.25, b = 0.75 }
[uav]
start = { x_m = 1, y_m = -2.5 }
"""
SHIPPED = ("grid5x5", "figure1", "figure3", "figure3-gone", "berlin")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "town.net.xml").write_text("<net/>")
    (tmp_path / "scenario.toml").write_text(SMALL)
    return tmp_path


def faults(
    folder: Path, *overrides: str, text: str = SMALL, preset: str | None = None
) -> list[str]:
    (folder / "scenario.toml").write_text(text)
    return [str(one) for one in read_draft(folder, overrides=overrides, preset=preset).faults]


def test_defaults_are_the_papers(folder: Path) -> None:
    scenario = read_scenario(folder, overrides=["uav.aircraft=ideal"])
    assert scenario.target.speed_mps.uniform == (15, 25)
    assert scenario.target.distance_m == "anywhere"
    assert scenario.target.turning == "equal"
    assert scenario.target.probability_present == 1
    assert (scenario.uav.speed_mps, scenario.sensor.radius_m) == (100, 500)
    search = scenario.search
    assert (search.horizon_s, search.particles, search.depth) == (10000, 1000, 16)
    assert scenario.greedy.direction == "own"
    assert scenario.truth == scenario.target
    assert scenario.uav.start == PointStart(x_m=1, y_m=-2.5)
    assert scenario.name == folder.name


def test_a_deadline_lies_between_take_off_and_horizon(folder: Path) -> None:
    given = ["search.objective=probability", "search.by_s=0:10:00", "uav.take_off_s=300"]
    search = read_scenario(folder, overrides=given).search
    assert (search.objective, search.by_s) == ("probability", 600)
    assert faults(folder, *given, "search.planning_time_s=299") == []
    (fault,) = faults(folder, *given, "search.planning_time_s=300")
    assert fault.startswith("search.by_s: 600 is not between take-off at 600 s and the horizon")


def test_a_list_of_edges_is_equal(folder: Path) -> None:
    scenario = read_scenario(folder, overrides=['target.start=["a", "b", "c", "d"]'])
    assert scenario.target.start == dict.fromkeys("abcd", 0.25)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1:30:00", 5400),
        ("0:00:01.5", 1.5),
        ("5400", 5400),
        ("26:00:00", 93600),
        (7, 7),
        ("1:02:00:00", 93600),
        ("0:0:0:1.5", 1.5),
    ],
)
def test_seconds(text: object, expected: float) -> None:
    assert seconds(text) == expected


@pytest.mark.parametrize(
    "text", ["1:30", "1:60:00", "1:1:60:00", "1:1:1:1:1", "soon", "-1:00:00", True, None, "nan"]
)
def test_no_seconds(text: object) -> None:
    with pytest.raises(InputError, match="seconds or"):
        seconds(text)


@pytest.mark.parametrize("value", ["01:30:00", "1:30:00", '"1:30:00"', "5400"])
def test_times_are_seconds_or_clock(folder: Path, value: str) -> None:
    scenario = read_scenario(folder, overrides=[f"search.horizon_s={value}"])
    assert scenario.search.horizon_s == 5400


def test_time_of_day_in_the_file(folder: Path) -> None:
    (folder / "scenario.toml").write_text(SMALL + "take_off_s = 00:10:00")
    assert read_scenario(folder).uav.take_off_s == 600


@pytest.mark.parametrize("value", ["2026-05-01T14:05:00+02:00", '"2026-05-01 12:05:00Z"'])
def test_the_sighting_is_a_moment(folder: Path, value: str) -> None:
    path = folder / "scenario.toml"
    path.write_text(SMALL.replace("[target]", f"[target]\nsighted_at = {value}"))
    scenario = read_scenario(folder)
    assert scenario.target.sighted_at == datetime(2026, 5, 1, 12, 5, tzinfo=UTC)
    path.write_text(scenario_text(scenario), encoding="utf-8")
    assert read_scenario(folder).target == scenario.target


def test_take_off_is_on_the_targets_clock(folder: Path) -> None:
    given = ["target.last_seen_ago_s=0:20:00", "uav.take_off_s=30"]
    assert read_scenario(folder, overrides=given).take_off_s == 1230


def test_an_override_may_set_a_part_that_the_file_leaves_out(folder: Path) -> None:
    scenario = read_scenario(folder, overrides=["target.speed_mps.constant=3"])
    assert scenario.target.speed_mps.constant == 3


def test_places(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    by_folder, by_file = read_scenario(folder), read_scenario(folder / "scenario.toml")
    assert by_folder == by_file
    other = (folder / "scenario.toml").rename(folder / "other.toml")
    assert read_scenario(other).name == "other"
    monkeypatch.chdir(folder)
    assert read_scenario("grid5x5").name == "grid5x5"


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ("gird5x5", "did you mean grid5x5"),
        ("zzzz", "known: .*grid5x5"),
        ("none.toml", "no such file"),
        (".", "holds no scenario.toml"),
    ],
)
def test_no_scenario(
    place: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=message):
        read_draft(place)


def test_the_folder_of_a_run_names_the_scenario_in_it(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text("{}")
    with pytest.raises(InputError, match=f"holds no scenario.toml; .*{tmp_path}/run.json$"):
        read_draft(tmp_path)


@pytest.mark.parametrize(
    ("more", "line", "name"),
    [
        ("[search]\ndepth = 3\nseed = 1\ndepth = 4\n", 4, "depth"),
        ("[search]\nseed = 1\n\"se ed\" = 2\n'se ed' = 3", 4, "'se ed'"),
        ("[search]\ndepth = 3\n[futures]\n[search]\n", 4, "[search]"),
        ("[target]\nstart = { a = 0.5, b = 0.5, a = 1 }\n", 2, '"a"'),
        ('[target]\nstart = ["a"]\nstart = [\n "b",\n]\nx = 1\n', 5, "start"),
        ("[uav]\nstart.x_m = 1\n  start . x_m = 2", 3, "start . x_m"),
    ],
)
def test_what_stands_twice_is_named(tmp_path: Path, more: str, line: int, name: str) -> None:
    path = tmp_path / "scenario.toml"
    path.write_text(more)
    (fault,) = read_draft(path).faults
    assert fault.key.startswith(f"line {line}, ") or fault.key == "end of document"
    assert fault.text.startswith(f"{name} stands there a second time; ")


def test_a_folder_without_a_scenario_hides_no_shipped_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "grid5x5").mkdir()  # such as the run of an earlier plan
    assert read_scenario("grid5x5").name == "grid5x5"
    (tmp_path / "grid5x5" / "scenario.toml").write_text("title = 'mine'")
    with pytest.raises(InputError, match="network"):
        read_scenario("grid5x5")


def test_overrides_follow_the_preset(folder: Path) -> None:
    text = SMALL + '[presets.x]\n"search.depth" = 3\n"search.seed" = 4\n"truth.start" = ["b"]\n'
    (folder / "scenario.toml").write_text(text)
    scenario = read_scenario(folder, preset="x", overrides=["search.seed=5"])
    assert (scenario.search.depth, scenario.search.seed) == (3, 5)
    assert scenario.truth.start == {"b": 1.0}
    assert read_scenario(folder).search.depth == 16


@pytest.mark.parametrize(
    "override", ["target.driving=free", 'target.driving="free"', "target.driving = 'free'"]
)
def test_override_quotes_are_free(folder: Path, override: str) -> None:
    assert read_scenario(folder, overrides=[override]).target.driving == "free"


@pytest.mark.parametrize(("said", "value"), [(".7", 0.7), ("+.25", 0.25), ("1", 1.0)])
def test_an_override_may_leave_out_the_nought(folder: Path, said: str, value: float) -> None:
    assert read_scenario(folder, overrides=[f"sensor.detects={said}"]).sensor.detects == value


def test_override_of_words_with_a_space_and_quoted_names(folder: Path) -> None:
    given = [
        "greedy.direction=nearest end",
        'target.start."a"=0.5',
        "target.start.b=0.5",
        'target.turning={"a" = {"b=c" = 1}}',
    ]
    scenario = read_scenario(folder, overrides=given)
    assert scenario.greedy.direction == "nearest end"
    assert scenario.target.start == {"a": 0.5, "b": 0.5}
    assert scenario.target.turning == {"a": {"b=c": 1.0}}


def test_truth_replaces_whole_keys_and_keeps_the_rest(folder: Path) -> None:
    text = SMALL.replace("[uav]", "driving = 'free'\n[truth]\nspeed_mps = {constant = 20}\n[uav]")
    (folder / "scenario.toml").write_text(text)
    scenario = read_scenario(folder)
    assert scenario.truth.speed_mps.form == "constant"
    assert scenario.truth.driving == "free"
    assert scenario.target.speed_mps.form == "uniform"


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_ones_are_sound(name: str) -> None:
    read_scenario(name)


def test_the_papers_preset() -> None:
    scenario = read_scenario("grid5x5", preset="paper")
    assert scenario.search.planning_time_s == 300
    assert scenario.truth.distance_m == read_scenario("figure3").target.distance_m
    assert scenario.target.distance_m != scenario.truth.distance_m
    assert scenario.uav.start == NodeStart(node="r0c0", bearing_deg=315, distance_m=60000)


@pytest.mark.parametrize("name", SHIPPED)
def test_a_run_keeps_its_scenario(name: str, tmp_path: Path) -> None:
    scenario = read_scenario(
        name, preset="paper" if name == "grid5x5" else None, overrides=["search.depth=5"]
    )
    run = tmp_path / "run.json"
    record = {"scenario": scenario.as_dict(), "scenario_path": str(scenario.path)}
    run.write_text(json.dumps(record))
    assert read_scenario(run) == scenario
    assert read_scenario(run, overrides=["search.depth=6"]).search.depth == 6


def test_a_run_of_a_net_keeps_its_scenario(folder: Path) -> None:
    scenario = read_scenario(folder)
    record = {"scenario": scenario.as_dict(), "scenario_path": str(scenario.path)}
    (folder / "run.json").write_text(json.dumps(record))
    assert read_scenario(folder / "run.json") == scenario


@pytest.mark.parametrize("text", ["{", "[]", "{}", '{"scenario": 3, "scenario_path": "a"}'])
def test_no_run(tmp_path: Path, text: str) -> None:
    (tmp_path / "run.json").write_text(text)
    with pytest.raises(InputError, match="does not hold a run's scenario"):
        read_draft(tmp_path / "run.json")


def test_the_dump_is_what_a_file_may_hold(folder: Path) -> None:
    given = ["target.speed_mps={normal={mean=20, sd=2, low=15, high=25}}", "truth.start=['b']"]
    plain = read_scenario(folder, overrides=given).as_dict()
    assert plain["target"]["speed_mps"] == {"normal": {"mean": 20, "sd": 2, "low": 15, "high": 25}}
    assert plain["truth"] == plain["target"] | {"start": {"b": 1.0}}
    assert plain["uav"]["start"] == {"x_m": 1, "y_m": -2.5}
    assert plain["network"] == {"net": "town.net.xml", "abstract": False}


ONE_FAULT = [
    ("sensor.radios_m=3", "sensor.radios_m: is not a known key; did you mean radius_m?"),
    ("futures.tolerance_m=0", "futures.tolerance_m: should be greater than 0, not 0; give"),
    ('futures.tolerance_m="exact"', 'futures.tolerance_m: should be a number, not "exact"; give'),
    ("futures=5", "futures: should be a table, not 5; give"),
    ("sensors.radius_m=3", "sensors: is not a known section; did you mean sensor?"),
    ("sensor.radius_m=0", "sensor.radius_m: should be greater than 0, not 0; give"),
    ("sensor.radius_m=-5.5", "sensor.radius_m: should be greater than 0, not -5.5; give"),
    ("sensor.radius_m=nan", "sensor.radius_m: should be a finite number, not nan; give"),
    ("sensor.radius_m=inf", "sensor.radius_m: should be a finite number, not inf; give"),
    ('sensor.radius_m="5"', 'sensor.radius_m: should be a number, not "5"; give'),
    ("sensor.radius_m=true", "sensor.radius_m: should be a number, not true; give"),
    ("sensor.detects_in_transit=1", "sensor.detects_in_transit: should be true or false, not 1;"),
    ("sensor=3", "sensor: should be a table, not 3; give"),
    ("uav.speed_mps=0", "uav.speed_mps: should be greater than 0, not 0; give"),
    ("uav.altitude_m=-1", "uav.altitude_m: should be at least 0, not -1; give"),
    ("uav.take_off_s=-1", "uav.take_off_s: should be at least 0, not -1; give"),
    ("uav.take_off_s=1:99:00", 'uav.take_off_s: should be seconds or "H:M:S", not "1:99:00"; wri'),
    ("uav.max_flight_time_s=0", "uav.max_flight_time_s: should be greater than 0, not 0; give"),
    ("uav.max_flight_time_s=inf", "uav.max_flight_time_s: should be a finite number, not inf;"),
    ("uav.start={x_m=1}", "uav.start.y_m: is missing; give metres to the north"),
    ("uav.start={node='n', bearing=3}", "uav.start.bearing: is not a known key; did you mean bea"),
    ("uav.start={node='n', bearing_deg=nan}", "uav.start.bearing_deg: should be a finite number,"),
    (
        "target.sighted_at=2026-05-01T14:05:00",
        "target.sighted_at: 2026-05-01T14:05:00 does not say",
    ),
    ("target.sighted_at=14:05:00", 'target.sighted_at: should be a date and a time, not "14:05'),
    ("target.sighted_at=5", 'target.sighted_at: should be a date and a time, not "5"; write 2026'),
    ("target.sighted_at=0026-05-01T14:05:00Z", "target.sighted_at: the year 26 is out of reach"),
    ("truth.sighted_at=2026-05-01T14:05:00Z", "truth.sighted_at: is the moment of time 0 for all"),
    ("search.depth=0", "search.depth: should be at least 1, not 0; give"),
    ("search.depth=1.5", "search.depth: should be a whole number, not 1.5; give"),
    ("search.particles=0", "search.particles: should be at least 1, not 0; give"),
    ("search.particles=many", 'search.particles: should be a whole number, not "many"; give'),
    ("search.seed=-1", "search.seed: should be at least 0, not -1; give"),
    ("search.horizon_s=0", "search.horizon_s: should be greater than 0, not 0; give"),
    ("search.sampling=sobel", "search.sampling: should be 'iid', 'sobol' or 'all', not \"sobel\";"),
    ("greedy.miss=never", "greedy.miss: should be 'horizon', 'infinity' or 'rate', not \"never\";"),
    ("greedy.tick_s=-1", "greedy.tick_s: should be at least 0, not -1; give"),
    (
        "target.driving=fast",
        "target.driving: should be 'constant', 'free' or 'traffic', not \"fast\";",
    ),
    ("target.start={}", "target.start: is empty; give"),
    ("target.start=[]", "target.start: is empty; give"),
    ("target.start=[3.5]", "target.start: should name edges;"),
    ('target.start=["a","a"]', "target.start: names a more than once; name"),
    ("target.start=main", 'target.start: should be "anywhere" or a list, not "main"; for the edge'),
    ("target.start=7", "target.start: should be a table, not 7; give"),
    ("target.start={a=0.5, b=0.4}", "target.start: the probabilities sum to 0.9, not to one; ch"),
    ("target.start={a=-0.5, b=1.5}", "target.start: the probability -0.5 is negative; give"),
    ("target.start={a=nan}", "target.start.a: should be a finite number, not nan; give"),
    ('target.start={a="x"}', 'target.start.a: should be a number, not "x"; give'),
    ("target.distance_m=5", "target.distance_m: should be a table, not 5; give"),
    ("target.distance_m={constant=-1}", "target.distance_m: reaches down to -1 m; give distances"),
    ("target.distance_m=nowhere", "target.distance_m: should be 'anywhere', not \"nowhere\"; give"),
    ("target.speed_mps=anywhere", 'target.speed_mps: should be a table, not "anywhere"; give'),
    ("target.speed_mps={uniform=[0, 5]}", "target.speed_mps: reaches down to 0 m/s; give speeds"),
    ("target.speed_mps={uniform=[25, 15]}", "target.speed_mps: low 25 is not below high 15; wri"),
    ("target.speed_mps={uniform=[15, 15]}", "target.speed_mps: holds the one value 15; write { c"),
    ("target.speed_mps={uniform=[15]}", "target.speed_mps.uniform[1]: is missing; give the lowest"),
    ("target.speed_mps={uniform=[1,2,3]}", "target.speed_mps.uniform: has too many values, not"),
    ('target.speed_mps={uniform=[1,"2"]}', "target.speed_mps.uniform[1]: should be a number, not"),
    ("target.speed_mps={list=[]}", "target.speed_mps.list: is empty; give the values"),
    ("target.speed_mps={list=[1, nan]}", "target.speed_mps.list[1]: should be a finite number, n"),
    ("target.speed_mps={list=[1, -2]}", "target.speed_mps: reaches down to -2 m/s; give speeds"),
    ("target.speed_mps={constant=0}", "target.speed_mps: reaches down to 0 m/s; give speeds"),
    ("target.speed_mps={}", "target.speed_mps: gives nothing; write exactly one of"),
    ("target.speed_mps={constant=3, list=[4]}", "target.speed_mps: gives list and constant; wri"),
    (
        "target.speed_mps={list=[1,2], probabilities=[1]}",
        "target.speed_mps: has 2 values but 1 probabilities; give one",
    ),
    (
        "target.speed_mps={list=[1,2], probabilities=[0.5,0.6]}",
        "target.speed_mps: the probabilities sum to 1.1, not to one; change",
    ),
    (
        "target.speed_mps={uniform=[1,2], probabilities=[1]}",
        "target.speed_mps: gives probabilities without a list; add",
    ),
    (
        "target.speed_mps={normal={mean=20, sd=0, low=1, high=2}}",
        "target.speed_mps.normal.sd: should be greater than 0, not 0; give",
    ),
    (
        "target.speed_mps={normal={mean=20, sd=1, low=1}}",
        "target.speed_mps.normal.high: is missing; give",
    ),
    (
        "target.speed_mps={normal={mean=20, sd=1, low=1, high=2}}",
        "target.speed_mps: lies 18 sd from its mean; choose",
    ),
    ("target.turning=left", "target.turning: should be 'equal', not \"left\"; give"),
    ("target.turning={a={b=0.5}}", "target.turning.a: the probabilities sum to 0.5, not to one;"),
    ("target.turning={a={}}", "target.turning.a: is empty; give"),
    ("target.turning={a={b='x'}}", 'target.turning.a.b: should be a number, not "x"; give'),
    ("target.turning={file='none.xml'}", "target.turning.file: there is no file "),
    (
        "target.probability_present=0",
        "target.probability_present: should be at least 1e-06, not 0;",
    ),
    ("target.probability_present=1.1", "target.probability_present: should be at most 1, not 1.1;"),
    ("target.last_seen_ago_s=-1", "target.last_seen_ago_s: should be at least 0, not -1; give"),
    ("truth.speed_mps={constant=-1}", "truth.speed_mps: reaches down to -1 m/s; give"),
    ("truth.sped_mps=1", "truth.sped_mps: is not a known key; did you mean speed_mps?"),
    ("truth=3", "truth: should be a table, not 3; give"),
    ("network.net=none.net.xml", "network.net: there is no file "),
    ("network.net=sumo:../a.net.xml", 'network.net: "sumo:../a.net.xml" does not stay within'),
    ("network.net='sumo:/a.net.xml'", 'network.net: "sumo:/a.net.xml" does not stay within'),
    ("network.net='sumo:a/../../b.net.xml'", "network.net: "),
    ("network.net='sumo:'", 'network.net: "sumo:" does not stay within'),
    ("network.net='sumo:C:/a.net.xml'", "network.net: "),
    ("network.net='sumo:a\\..\\..\\b.net.xml'", "network.net: "),
    ("network.attribution=3", "network.attribution: should be text in quotes, not 3; give whose"),
    ("network.attribution=' '", "network.attribution: should be one line of text, not "),
    ('network.attribution="a\\nb"', "network.attribution: should be one line of text, not "),
    (f"network.attribution='{'a' * 301}'", "network.attribution: has 301 characters; give at"),
    ("network.osm=town.net.xml", "network: gives net and osm; write either"),
    ("network.net=3", "network.net: should be text in quotes, not 3; give the path"),
    ("network={}", "network: gives no source; write either nodes and edges, or net, or osm"),
    ("network={nodes='town.net.xml'}", "network.edges: is missing; give the path"),
    ("network.connections=town.net.xml", "network.connections: goes with nodes and edges only;"),
    ("network.abstract=true", "network.abstract: goes with nodes and edges only;"),
    ("network.road_tolerance_m=-1", "network.road_tolerance_m: should be at least 0, not -1; give"),
    ("network.road_tolerance_m=1e-9", "network.road_tolerance_m: should not be 1e-09; give 0,"),
    ("uav.take_off_s=10000", "search.horizon_s: 10000 is not after take-off at 10000 s ("),
    ("search.planning_time_s=3:00:00", "search.horizon_s: 10000 is not after take-off at 10800"),
    ("target.last_seen_ago_s=3:00:00", "search.horizon_s: 10000 is not after take-off at 10800"),
    ("search.objective=probability", "search.by_s: is missing; objective = "),
    ("search.objective=speed", "search.objective: should be 'time' or 'probability', not"),
    ("search.by_s=0:99:00", 'search.by_s: should be seconds or "H:M:S", not "0:99:00"; write'),
    ("search.by_s=10001", "search.by_s: 10001 is not between take-off at 0 s and the horizon, 100"),
    ("uav.return_to=home", "uav.return_to: should be 'start', not \"home\"; give where it has"),
    ("uav.return_to={x_m=1}", "uav.return_to.y_m: is missing; give metres to the north"),
    ("uav.return_to={node='n', x_m=1}", "uav.return_to.x_m: is not a known key; "),
    ("title=3", "title: should be text in quotes, not 3; give one line"),
    ("title.x=3", "title: should be text in quotes, not {"),
    ("uav.speed_mps.x=3", "uav.speed_mps"),
    ("nonsense", "nonsense: is not an override; write dotted.key=value"),
    ("uav.0=3", "uav.0: is a table of a list; set its keys, as in uav.0.KEY"),
    ("search.depth=", "search.depth=: is not an override; write"),
    ("search.depth={1", 'search.depth: "{1" is not a TOML value ('),
    ("search..depth=1", "search..depth: is not a dotted key; write"),
]


@pytest.mark.parametrize(("override", "expected"), ONE_FAULT, ids=[o for o, _ in ONE_FAULT])
def test_one_fault_one_line(folder: Path, override: str, expected: str) -> None:
    text = SMALL + "speed_mps = 100\n"
    found = faults(folder, override, text=text)
    assert len(found) == 1
    assert found[0].startswith(expected)
    assert found[0].count("\n") == 0


def test_all_takes_lists_and_constants_only(folder: Path) -> None:
    found = faults(folder, "search.sampling=all", "target.speed_drawn=per road")
    assert [fault.partition(":")[0] for fault in found] == [
        "target.distance_m",
        "target.speed_mps",
        "target.speed_drawn",
    ]
    listed = ["target.distance_m={constant=0}", "target.speed_mps={list=[1,2]}"]
    assert faults(folder, "search.sampling=all", *listed) == []


def test_faults_are_told_together(folder: Path) -> None:
    given = [
        "sensor.radios_m=3",
        "target.start={a=0.5, b=0.4}",
        "target.colour=red",
        "search.depth=0",
        "network.net=none.xml",
        "uav.speed_mps=fast",
        "uav.take_off_s=4:00:00",
        "greedy.ends=never",
        "truth.speed_mps={constant=-3}",
    ]
    found = faults(folder, *given, preset="x")
    assert sorted(fault.partition(":")[0] for fault in found) == sorted(
        [
            "presets.x",
            "sensor.radios_m",
            "target.start",
            "target.colour",
            "search.depth",
            "search.horizon_s",
            "network.net",
            "uav.speed_mps",
            "greedy.ends",
            "truth.speed_mps",
        ]
    )
    with pytest.raises(ScenarioError) as raised:
        read_scenario(folder, overrides=given, preset="x")
    assert str(raised.value).count("\n") == len(found) - 1
    assert all(str(folder) in line for line in str(raised.value).splitlines())
    assert "type=" not in str(raised.value)
    assert "http" not in str(raised.value)


def test_faults_of_the_target_are_not_repeated_for_the_truth(folder: Path) -> None:
    found = faults(folder, "target.start={a=0.5}", "truth.speed_mps={constant=20}")
    assert len(found) == 1


def test_nothing_given(folder: Path) -> None:
    found = faults(folder, text="")
    assert [fault.partition(":")[0] for fault in found] == ["network", "target.start", "uav.start"]


def test_faulty_sections_are_there_without_their_faulty_keys(folder: Path) -> None:
    (folder / "scenario.toml").write_text(SMALL)
    given = ["target.colour=1", "target.speed_mps=3", "uav.start={node='n', bearng_deg=3}"]
    draft = read_draft(folder, overrides=given)
    assert len(draft.faults) == 3
    assert draft.target is not None
    assert draft.target.start == {"a": 0.25, "b": 0.75}
    assert draft.uav is not None
    assert draft.uav.start == NodeStart(node="n")


def test_syntax_errors_name_the_line(folder: Path) -> None:
    found = faults(folder, text="[network]\nnet = 'a'\nnodes == 3\n")
    assert len(found) == 1
    assert found[0].startswith("line 3, column")


def test_no_utf8(folder: Path) -> None:
    (folder / "scenario.toml").write_bytes(b"title = '\xff'")
    assert "not UTF-8" in read_draft(folder).faults[0].text


@pytest.mark.parametrize(
    ("presets", "preset", "expected"),
    [
        ("[presets.paper]", "papr", "presets.papr: is not in this scenario; did you mean paper?"),
        ("", "paper", "presets.paper: is not in this scenario; leave it out"),
        ("[presets]\npaper = 3", "paper", 'presets.paper: should be a table of "dotted.key"'),
        (
            "[presets.paper]\nsearch.depth = 3",
            "paper",
            'presets.paper.search: should be a dotted key; write the whole key in quotes, as "sear',
        ),
        ("[presets.paper]\n'search.depth' = 0", "paper", "search.depth: should be at least 1, not"),
        ("[presets.paper]\n'search.dept' = 1", "paper", "search.dept: is not a known key; did"),
        ("[presets.paper]\n'network.net.x' = 1", "paper", "network.net.x: network.net is "),
    ],
)
def test_preset_faults(folder: Path, presets: str, preset: str, expected: str) -> None:
    found = faults(folder, text=SMALL + presets, preset=preset)
    assert len(found) == 1
    assert found[0].startswith(expected)


def test_thirds_sum_to_one(folder: Path) -> None:
    third = "0.3333333"
    assert faults(folder, f"target.start={{a={third}, b={third}, c={third}}}") == []
    assert len(faults(folder, "target.start={a=0.33333, b=0.33333, c=0.33333}")) == 1


@pytest.mark.parametrize(("speed", "warned"), [(74.9, True), (75, False)])
def test_a_slow_uav_is_warned_of(
    folder: Path, caplog: pytest.LogCaptureFixture, speed: float, warned: bool
) -> None:
    with caplog.at_level(logging.WARNING):
        read_scenario(folder, overrides=[f"uav.speed_mps={speed}"])
    assert bool(caplog.records) == warned


def test_a_truth_faster_than_the_belief_is_warned_of(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        read_scenario(folder, overrides=["truth.speed_mps={constant=50}"])
    assert "50 m/s" in caplog.text


def test_names_may_look_like_numbers(folder: Path) -> None:
    text = (folder / "scenario.toml").read_text(encoding="utf-8")
    (folder / "scenario.toml").write_bytes(b"\xef\xbb\xbf" + text.encode())
    for override, name in (
        ("uav.start={node=12345}", "12345"),
        ("uav.start={node='0077'}", "0077"),
    ):
        start = read_scenario(folder, overrides=[override]).uav.start
        assert getattr(start, "node", None) == name
    for word in ("12345", "0x1F", "1_000", "1e5", "007", "true", '"7"'):
        start = read_scenario(
            folder, overrides=["uav.start={node='x'}", f"uav.start.node={word}"]
        ).uav.start
        assert getattr(start, "node", None) == word.strip('"')
    target = read_scenario(folder, overrides=["target.start=[77, 78]"]).target
    assert target.start == {"77": 0.5, "78": 0.5}


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("town.net.xml", "<net version='1'/>", "is a SUMO net, not a scenario"),
        ("town.osm", "<?xml version='1.0'?><osm/>", "is an OpenStreetMap extract"),
        ("town.sumocfg", "\ufeff<sumoConfiguration/>", "is a file of SUMO's, not a scenario"),
    ],
)
def test_another_file_is_no_scenario(tmp_path: Path, name: str, text: str, told: str) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=told):
        read_scenario(tmp_path / name)


@pytest.mark.parametrize(
    "override",
    [
        "uav.start={x_m=1e100, y_m=0}",
        "uav.speed_mps=1e-320",
        "uav.speed_mps=1e200",
        "greedy.tick_s=5e-324",
        "sensor.radius_m=1e300",
        "target.speed_mps={constant=1e-320}",
        "search.horizon_s=1e-300",
    ],
)
def test_numbers_beyond_what_is_physical(folder: Path, override: str) -> None:
    assert len(read_draft(folder, overrides=[override]).faults) == 1


def test_data_of_openstreetmap_are_credited_unasked(folder: Path) -> None:
    (folder / "scenario.toml").write_text(SMALL)
    assert read_scenario(folder).network.credit == ""
    of_osm = ["network={osm='town.net.xml'}"]
    assert read_scenario(folder, overrides=of_osm).network.credit == "© OpenStreetMap contributors"
    other = [*of_osm, "network.attribution='Town of A, 2026'"]
    assert read_scenario(folder, overrides=other).network.credit == "Town of A, 2026"


def test_the_town_is_credited() -> None:
    assert read_scenario("berlin").network.credit == "© OpenStreetMap contributors"
