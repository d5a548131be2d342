"""The town that comes with SUMO: found where SUMO is, and whose data it is stands on all of it."""

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from lxml import etree

from planner.cli import main
from planner.detection.evaluate import evaluate
from planner.errors import InputError, ScenarioError
from planner.experiments.condition import Condition, credit_of
from planner.experiments.run import run as run_conditions
from planner.files import shipped
from planner.futures.state_at import State
from planner.mission.certificate_file import net_content, sha256_of_net
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.planning import problem_of
from planner.network import sumo
from planner.network.sumo import sumo_file, sumo_home
from planner.report.picture import plan_picture, where_picture
from planner.search.plan import plan_of_wait
from report.test_picture import texts
from support.command_line import Commands
from support.grid_instance import grid_futures

CREDIT = "© OpenStreetMap contributors"
TINY = ("--set", "search.particles=3", "--set", "search.horizon_s=300")


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


def metadata(path: Path) -> str | None:
    found = pyarrow.parquet.read_schema(path).metadata.get(b"attribution")
    return None if found is None else str(found, "utf-8")


def test_the_net_is_read_where_sumo_is(berlin: OpenScenario) -> None:
    assert berlin.network.path == sumo_home() / "tools" / "game" / "DRT" / "osm.net.xml"
    assert len(berlin.network.edge_ids) == 740
    assert berlin.network.attribution == CREDIT
    assert berlin.network.projection is not None


def test_a_large_town_is_credited_unasked(luxembourg: OpenScenario) -> None:
    assert len(luxembourg.network.edge_ids) == pytest.approx(5700, abs=200)
    assert luxembourg.network.attribution == CREDIT


def test_a_net_that_does_not_come_with_sumo_is_one_fault() -> None:
    with pytest.raises(ScenarioError) as caught:
        open_scenario("berlin", overrides=["network.net='sumo:tools/none.net.xml'"])
    (fault,) = caught.value.faults
    assert str(fault).startswith("network.net: SUMO 1.")
    assert "holds no file tools/none.net.xml" in str(fault)
    assert "correct the path" in str(fault)


def test_links_do_not_lead_out_of_sumo_s_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "sumo").mkdir()
    (tmp_path / "secret.xml").write_text("<net/>")
    (tmp_path / "sumo" / "a.net.xml").symlink_to(tmp_path / "secret.xml")
    monkeypatch.setattr(sumo, "sumo_home", lambda: tmp_path / "sumo")
    for name in ("a.net.xml", "../secret.xml", str(tmp_path / "secret.xml")):
        with pytest.raises(InputError, match="is not below SUMO's folder"):
            sumo_file(name)


def test_all_files_of_a_run_say_whose_data_it_is(run: Commands, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    anywhere = ("--set", "uav.return_to={x_m=600,y_m=700}")
    options = (*TINY, *anywhere, "--method", "wait", "--targets", "3", "-o", folder)
    assert run("plan", "berlin", *options).code == 0
    for name in ("plan.json", "run.json"):
        content = json.loads((folder / name).read_text(encoding="utf-8"))
        assert content["attribution"] == CREDIT
    assert content["scenario"]["network"]["net"] == "sumo:tools/game/DRT/osm.net.xml"
    assert metadata(folder / "evaluation.parquet") == CREDIT
    (comment,) = etree.parse(str(folder / "plan.add.xml")).xpath("//comment()")
    assert comment.text.strip() == CREDIT
    again = tmp_path / "again"
    same = ("--method", "wait", "--targets", "3", "-o", again)
    assert run("plan", folder / "run.json", *same).code == 0
    assert (again / "plan.json").read_bytes() == (folder / "plan.json").read_bytes()
    assert (again / "plan.png").read_bytes() == (folder / "plan.png").read_bytes()
    assert run("futures", "berlin", *TINY, "-o", tmp_path / "futures").code == 0
    for name in ("futures.parquet", "particles.parquet"):
        assert metadata(tmp_path / "futures" / name) == CREDIT
    assert run("fly", folder, "--targets", "3").code == 0
    built = run("build", "berlin", "-o", tmp_path / "net.xml", "--json")
    assert json.loads(built.out)["attribution"] == CREDIT
    assert (tmp_path / "net.xml").read_bytes() == open_scenario("berlin").network.path.read_bytes()


def test_a_certificate_says_whose_data_it_is(berlin: OpenScenario) -> None:
    content = net_content(berlin.network)
    assert content["attribution"] == CREDIT
    grid = open_scenario("figure3").network
    assert [*net_content(grid)] == ["node_xy_m", "roads"]
    assert sha256_of_net(grid) != sha256_of_net(berlin.network)


def test_certified_tables_say_whose_data_it_is(run: Commands, tmp_path: Path) -> None:
    own = ("--set", "network.attribution='Town of A -- 2026'")
    options = (*own, "--set", "search.particles=20", "--targets", "5", "--method", "rate")
    assert run("plan", "figure3", *options, "-o", tmp_path).code == 0
    assert run("certify", tmp_path, "--work", "2").code == 0
    for name in ("prices", "weights", "motion", "evaluation"):
        assert metadata(tmp_path / f"{name}.parquet") == "Town of A -- 2026"
    for name in ("net.json", "plan.json"):
        assert json.loads((tmp_path / name).read_text())["attribution"] == "Town of A -- 2026"
    (comment,) = etree.parse(str(tmp_path / "plan.add.xml")).xpath("//comment()")
    assert comment.text.strip() == "Town of A - - 2026"  # two hyphens would end it


def test_pictures_say_it_in_small_print(berlin: OpenScenario, tmp_path: Path) -> None:
    network = berlin.network
    place = network.node_xy_m[:1]
    state = State(
        time_s=60.0,
        particle=np.zeros(1, np.int32),
        edge=np.zeros(1, np.int32),
        xy_m=place,
        weight=np.ones(1),
        distance_m=np.zeros(1),
        speed_mps=np.zeros(1),
    )
    where_picture(tmp_path / "w.svg", network, state, title="where")
    assert CREDIT in texts(tmp_path / "w.svg")
    problem = problem_of(berlin, grid_futures(3, np.random.default_rng(1)))
    plan = plan_of_wait(problem, "wait", 1000.0, 700.0)
    curve = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective)
    plan_picture(tmp_path / "p.svg", problem, plan, evaluations={"planned": curve}, title="plan")
    assert CREDIT in texts(tmp_path / "p.svg")


def test_results_say_whose_data_they_are(tmp_path: Path) -> None:
    folders = {name: shipped(name) for name in ("figure3", "berlin")}
    conditions = [
        Condition(
            scenario=name,
            preset=None,
            overrides=("search.particles=2", "search.horizon_s=200"),
            method="wait",
            seed=1,
            targets=2,
            place=folder / "scenario.toml",
        )
        for name, folder in folders.items()
        if folder is not None
    ]
    assert credit_of(conditions[:1]) == {}
    assert credit_of(conditions) == {"attribution": CREDIT}
    run_conditions({tmp_path: conditions[1:]}, workers=1)
    assert metadata(tmp_path / "results.parquet") == CREDIT


def test_the_clock_decides_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """What is planned and told is the same where the kinematic clock guesses nonsense."""
    told = []
    for name in ("as it is", "nonsense"):
        out = tmp_path / name
        words = ["plan", "berlin", "--method", "rate", "--targets", "4", "--set"]
        words += ["search.particles=4", "--set", "search.horizon_s=300", "-o", str(out)]
        assert main(words) == 0
        told.append((out / "plan.json").read_bytes())
        monkeypatch.setattr("planner.futures.kinematic.drive_cars", None)
    assert told[0] == told[1]
