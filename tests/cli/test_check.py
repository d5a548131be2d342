"""`planner check` and `planner build` on whatever stands for a net."""

import gzip
from pathlib import Path

import pytest

from planner.network.read import read_net
from planner.scenario.sections import OF_OSM
from support.command_line import TOWN, Commands
from support.instances import town
from support.user_traffic import write_traffic

ROOT = Path(__file__).parents[2]
OSM = """<osm version="0.6">
<node id="1" lat="49.600" lon="6.100"/><node id="2" lat="49.602" lon="6.100"/>
<node id="3" lat="49.604" lon="6.100"/><node id="4" lat="49.602" lon="6.104"/>
<way id="7"><nd ref="1"/><nd ref="2"/><nd ref="3"/><tag k="highway" v="residential"/>
<tag k="name" v="Rue A"/></way>
<way id="8"><nd ref="2"/><nd ref="4"/><tag k="highway" v="residential"/>
<tag k="name" v="Rue B"/></way>
</osm>
"""


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


@pytest.fixture
def osm(tmp_path: Path) -> Path:
    path = tmp_path / "town.osm.xml"
    path.write_text(OSM, encoding="utf-8")
    return path


def test_a_scenario_is_measured_and_its_remarks_told_here_alone(
    run: Commands, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    said = run("check", "berlin")
    assert said.code == 0
    assert said.err == ""
    assert max(map(len, said.out.splitlines()[2:])) <= 80
    flat = " ".join(said.out.split())
    assert "exits 16" in flat
    assert "740 for cars" in flat
    assert "1,000 particles until 0:30:00: 1,000 SUMO runs" in flat
    assert "uav.speed_mps: 15 m/s is less than 3 times" in flat
    assert "\n  method assumes" in said.out  # below what its line begins with, not its dash
    assert run("build", "berlin").err == ""  # no longer with every command


def test_json_holds_what_the_table_tells(run: Commands) -> None:
    found = run("check", "berlin", "--json").json
    assert (found["edges"], found["exits"], found["signals"]) == (740, 16, 15)
    assert found["cost"]["recording"]["runs"] == 1000
    assert found["cost"]["plan"]["runs"] == 1000 + 1000 + 2100
    assert found["attribution"] == OF_OSM
    assert any("pieces" in line for line in found["remarks"])


def test_a_net_alone(run: Commands, tmp_path: Path, osm: Path) -> None:
    plain = tmp_path / "town.net.xml"
    plain.write_bytes(town().path.read_bytes())
    packed = tmp_path / "town.net.xml.gz"
    packed.write_bytes(gzip.compress(plain.read_bytes()))
    (tmp_path / "town.sumocfg").write_text(
        '<configuration><net-file value="town.net.xml"/></configuration>'
    )
    for place in (plain, packed, tmp_path / "town.sumocfg"):
        found = run("check", place, "--json").json
        assert (found["edges"], found["net"], found["exits"]) == (26, str(place), 1)
        assert "no projection" in " ".join(found["remarks"])
    assert "\n  roads " not in run("check", plain).out  # to which sensor?
    assert "\n  roads " in run("check", TOWN).out
    found = run("check", osm, "--json").json
    assert (found["edges"], found["attribution"], found["named_share"]) == (6, OF_OSM, 1.0)
    assert "no projection" not in " ".join(found["remarks"])


def test_a_net_has_no_options_of_a_scenario(run: Commands, osm: Path) -> None:
    for options in (("--set", "uav.speed_mps=3"), ("--preset", "x"), ("-s", "3")):
        said = run("check", osm, *options)
        assert said.code == 2
        assert "is a net; --set, --preset, --seed and -n go with a scenario" in said.err


@pytest.mark.parametrize(
    ("override", "remark"),
    [
        ("uav.start={ x_m = 40000, y_m = 0 }", "uav.start: lies 39.4 km from the nearest road"),
        ("target.start=['se-quay']", None),
    ],
)
def test_what_is_odd_about_a_scenario(run: Commands, override: str, remark: str | None) -> None:
    found = run("check", TOWN, "--set", override, "--set", "uav.speed_mps=90", "--json").json
    assert [line for line in found["remarks"] if "." in line.partition(":")[0]] == (
        [remark] if remark else []
    )


def test_a_start_in_a_yard_is_told(run: Commands, tmp_path: Path) -> None:
    """From the yard's two edges, each leading back to the other, nobody gets out."""
    places = {"a": (0, 0), "b": (900, 0), "c": (900, 900), "d": (0, 900)}
    places |= {"y": (450, 400), "z": (450, 450)}
    nodes = [f'<node id="{n}" x="{x}" y="{y}"/>' for n, (x, y) in places.items()]
    ways = ("ab", "bc", "cd", "da", "ay", "yz", "zy")
    edges = [f'<edge id="{way}" from="{way[0]}" to="{way[1]}"/>' for way in ways]
    (tmp_path / "n.nod.xml").write_text(f"<nodes>{''.join(nodes)}</nodes>")
    (tmp_path / "n.edg.xml").write_text(f"<edges>{''.join(edges)}</edges>")
    (tmp_path / "scenario.toml").write_text(
        '[network]\nnodes = "n.nod.xml"\nedges = "n.edg.xml"\n[target]\nstart = ["yz"]\n'
        "[uav]\nstart = { x_m = 0, y_m = 0 }\n"
    )
    told = "\n".join(run("check", tmp_path, "--json").json["remarks"])
    assert "target.start.yz: is a yard: no car gets farther from there than" in told
    assert "no car gets away from: ay, yz, zy" in told
    around = "target.start={ x_m = 450, y_m = 430, radius_m = 60 }"
    found = run("check", tmp_path, "--json", "--set", around).json["remarks"]
    (yards,) = [remark for remark in found if "yard" in remark]  # all in one line
    assert yards.startswith("target.start: 2 edges that are part of it are yards: yz, zy; no car")


def test_what_is_made_of_traffic_is_told(run: Commands, tmp_path: Path) -> None:
    folder = write_traffic(tmp_path / "own")
    told = run("check", folder)
    lines = [" ".join(line.split()) for line in told.out.splitlines()]
    assert "traffic run.sumocfg, from 0:01:00 on, in 4 runs" in lines
    assert any(line.startswith("taken of it step-length = 0.2, lateral-") for line in lines)
    assert "left out of it end, tripinfo-output, log, edgeData" in lines
    found = run("check", folder, "--json").json["traffic"]
    assert found["taken"]["time-to-teleport"] == "120"
    assert [Path(file).name for file in found["files"]] == [
        "cars.rou.xml.gz",
        "bus.rou.xml",
        "stops.add.xml",
    ]


def test_files_of_traffic_may_lie_where_a_person_allows_it(run: Commands, tmp_path: Path) -> None:
    own = write_traffic(tmp_path / "own")
    (tmp_path / "scenario").mkdir()
    text = (own / "scenario.toml").read_text().replace('"run.sumocfg"', '"../own/run.sumocfg"')
    (tmp_path / "scenario" / "scenario.toml").write_text(text)
    refused = run("check", tmp_path / "scenario")
    assert refused.code == 2
    assert refused.err.count("\n") == 1
    assert f"--allow {own}" in refused.err
    assert run("check", tmp_path / "scenario", "--allow", own).code == 0
    steered = run("check", own, "--control", "nothing.here:f")
    assert (steered.code, "--control nothing.here:f" in steered.err) == (2, True)


def test_build_takes_an_extract(run: Commands, tmp_path: Path, osm: Path) -> None:
    net = tmp_path / "town.net.xml"
    built = run("build", "--osm", osm, "-o", net, "--json").json
    assert built["attribution"] == OF_OSM
    assert run("build", osm, "-o", net, "--force", "--json").json == built
    told = run("build", osm).out.split()
    assert "edges" in told
    assert "roads" not in told  # what is one road is not known without a sensor
    assert read_net(net).attribution == OF_OSM
    packed = tmp_path / "town.net.xml.gz"
    assert run("build", net, "-o", packed).code == 0
    assert gzip.decompress(packed.read_bytes()) == net.read_bytes()
    assert run("build", packed, "-o", tmp_path / "again.net.xml").code == 0
    assert (tmp_path / "again.net.xml").read_bytes() == net.read_bytes()


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (("build",), "give a SCENARIO, a net, or --osm FILE"),
        (("build", "figure3", "--osm", "x.osm"), "give a SCENARIO, a net, or --osm FILE"),
        (("build", "--osm", "absent.osm"), "cannot be read"),
        (("build", "--osm", str(Path(TOWN) / "scenario.toml")), "is no OpenStreetMap file"),
        (("check", "absent.net.xml"), "is neither a file"),
    ],
)
def test_what_is_no_net_is_refused(run: Commands, words: tuple[str, ...], fault: str) -> None:
    said = run(*words)
    assert said.code == 2
    assert fault in said.err
    assert len(said.err.splitlines()) == 1


def test_show_goes_with_a_scenario(run: Commands, osm: Path) -> None:
    assert "--show goes with a scenario" in run("build", osm, "--show").err
