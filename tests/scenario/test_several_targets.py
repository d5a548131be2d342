"""Several targets: one table [target], or a list of tables [[target]], addressed by number."""

import tomllib
from pathlib import Path

import pytest

from planner.errors import ScenarioError
from planner.mission.opening import open_scenario
from planner.scenario.draft import read_draft, read_scenario
from planner.scenario.source import read_source
from planner.scenario.toml_text import scenario_text

TWO = """
[network]
nodes = "n.nod.xml"
edges = "n.edg.xml"
abstract = true
[uav]
start = { x_m = 1, y_m = -2.5 }
take_off_s = 90
[[target]]
start = { a = 1 }
[[target]]
start = { b = 1 }
name = "the blue van"
speed_mps = { constant = 20 }
probability_present = 0.8
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("n.nod.xml", "n.edg.xml"):
        (tmp_path / name).write_text("<x/>")
    (tmp_path / "scenario.toml").write_text(TWO)
    return tmp_path


def faults(place: Path | str, *overrides: str) -> list[str]:
    return [str(fault) for fault in read_draft(place, overrides=overrides).faults]


def test_each_table_is_a_target(folder: Path) -> None:
    scenario = read_scenario(folder)
    assert [target.start for target in scenario.targets] == [{"a": 1.0}, {"b": 1.0}]
    assert scenario.target is scenario.targets[0]
    assert scenario.target_names == ("target 1", "the blue van")
    assert scenario.truths == scenario.targets


def test_a_list_of_one_is_the_same_scenario(folder: Path) -> None:
    one = folder / "one.toml"
    one.write_text(TWO[: TWO.rindex("[[target]]")])
    single = read_scenario(one)
    one.write_text(one.read_text().replace("[[target]]", "[target]"))
    assert read_scenario(one).as_dict() == single.as_dict()
    assert isinstance(single.as_dict()["target"], dict)


def test_an_override_is_for_one_target_or_for_all(folder: Path) -> None:
    def fastest(*overrides: str) -> list[float]:
        scenario = read_scenario(folder, overrides=overrides)
        return [target.speed_mps.high for target in scenario.targets]

    assert fastest("target.speed_mps={constant=9}") == [9.0, 9.0]
    assert fastest("target.0.speed_mps={constant=9}") == [9.0, 20.0]
    (one,) = read_scenario("grid5x5", overrides=["target.0.speed_mps={constant=9}"]).targets
    assert one.speed_mps.high == 9.0


def test_truth_is_said_of_all_targets_or_of_each(folder: Path) -> None:
    text = TWO.replace("[uav]", "[truth]\nspeed_mps = { constant = 9 }\n[uav]")
    (folder / "scenario.toml").write_text(text)
    assert [truth.speed_mps.high for truth in read_scenario(folder).truths] == [9.0, 9.0]
    each = "[[truth]]\n[[truth]]\nspeed_mps = { constant = 9 }\n[uav]"
    (folder / "scenario.toml").write_text(TWO.replace("[uav]", each))
    scenario = read_scenario(folder)
    assert [truth.speed_mps.high for truth in scenario.truths] == [25.0, 9.0]
    assert [truth.start for truth in scenario.truths] == [{"a": 1.0}, {"b": 1.0}]


@pytest.mark.parametrize("said", ["", "[truth]\n", "[[truth]]\n", "[[truth]]\n[[truth]]\n"])
def test_an_override_is_for_the_truth_of_one_target_or_of_all(folder: Path, said: str) -> None:
    (folder / "scenario.toml").write_text(TWO.replace("[uav]", f"{said}[uav]"))

    def fastest(place: Path | str, *overrides: str) -> list[float]:
        truths = read_scenario(place, overrides=overrides).truths
        return [truth.speed_mps.high for truth in truths]

    nine, five = "speed_mps={constant=9}", "speed_mps={constant=5}"
    assert fastest(folder, f"truth.{nine}") == [9.0, 9.0]
    assert fastest(folder, f"truth.1.{nine}") == [25.0, 9.0]
    assert fastest(folder, f"truth.{nine}", f"truth.0.{five}") == [5.0, 9.0]
    assert fastest("grid5x5", f"truth.0.{nine}") == [9.0]  # of one target, as uav.0 of one UAV


@pytest.mark.parametrize("number", [0, 1])
def test_the_truth_of_a_target_may_be_said_before_the_target(folder: Path, number: int) -> None:
    text = TWO.partition("[[target]]")[0]
    (folder / "scenario.toml").write_text(text)
    both = "target = [{ start = { a = 1 } }, { start = { b = 1 } }]"
    truth = f"truth.{number}.speed_mps={{constant=9}}"
    said, back = (
        read_source(folder, overrides=overrides) for overrides in ([truth, both], [both, truth])
    )
    assert (said.tables, said.faults) == (back.tables, ())
    assert said.tables["truth"][number] == {"speed_mps": {"constant": 9}}
    assert len(said.tables["truth"]) == 2
    preset = f'[presets.two]\n"truth.{number}.speed_mps" = {{ constant = 9 }}\n{both}\n'
    (folder / "scenario.toml").write_text(text + preset)
    assert read_source(folder, preset="two").tables == said.tables


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("truth.2.start=a", "truth.2.start: truth.2 is not in the list"),
        ("truth.1.sped_mps=9", "truth[1].sped_mps: is not a known key"),
        ("target.2.start=a", "target.2.start: target.2 is not in the list"),
        ("target.1.probability_present=0", "target[1].probability_present: should be at least"),
        ("target.1.sped_mps=9", "target[1].sped_mps: is not a known key"),
        ("target.0.name=the blue van", 'target[1].name: "the blue van" is another target\'s'),
        ("target.1.driving=free", "target[1].driving: is the same for all targets, but target[0]"),
        ("target.1.last_seen_ago_s=9", "target[1].last_seen_ago_s: is the same for all targets"),
        ("target.0.name=The Blue Van", 'target[1].name: "the blue van" is another target\'s'),
        ("target.0.name='2'", 'target[0].name: "2" could be the number of another target'),
        ("target.1.name=target 1", 'target[1].name: "target 1" is another target\'s'),
        ("target.driving=traffic", "target[1].driving: is traffic, in which there is one target"),
        ("truth.driving=traffic", "truth[1].driving: is traffic, in which there is one target"),
        ("truth=[{},{driving='free'}]", "truth[1].driving: is the same for all targets"),
        ("target.1.start={b=0.5}", "target[1].start: the probabilities sum to 0.5"),
        ("target=[]", "target: is an empty list; give a table for each one"),
        ('target=[3, {start="anywhere"}]', "target[0]: should be a table, not 3"),
        ("truth=[{},{},{}]", "truth: has 3 tables for 2 targets; give one for each"),
        ("search.horizon_s=1", "after take-off at 90"),
        ("search.particles=1", "search.particles: 1 is too few for 2 targets"),
    ],
)
def test_a_fault_names_the_target(folder: Path, override: str, said: str) -> None:
    found = [fault for fault in faults(folder, override) if said in fault]
    assert len(found) == 1, faults(folder, override)


def test_what_only_the_net_shows_is_named_by_its_target() -> None:
    two = 'target=[{start="anywhere"},{start={nowhere=1}}]'
    with pytest.raises(ScenarioError) as error:
        open_scenario("grid5x5", overrides=[two])
    assert [fault.key for fault in error.value.faults] == ["target[1].start.nowhere"]


def test_targets_written_out_are_the_same_targets(folder: Path) -> None:
    scenario = read_scenario(folder)
    text = scenario_text(scenario)
    assert text.count("[[target]]") == 2
    assert tomllib.loads(text)["target"] == scenario.as_dict()["target"]
    (folder / "again.toml").write_text(text)
    assert read_scenario(folder / "again.toml").as_dict() == scenario.as_dict()
