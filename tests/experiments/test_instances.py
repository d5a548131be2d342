"""The frozen instances: whole, their plans legal, and beaten by nobody without being noticed."""

from pathlib import Path

import pytest

from planner.bounds import particle_prices as bound
from planner.cli import on_instances as commands_instances
from planner.detection.evaluate import evaluate
from planner.errors import InputError
from planner.experiments.instances import (
    Instance,
    bound_on,
    flown_again,
    instances_path,
    read_instances,
)
from planner.flight.legs import leg_names, legs_named
from planner.mission.planning import make_plan, problem_of
from planner.mission.recorder import Recorder
from planner.search.methods import METHODS, method_named
from support.command_line import Commands
from support.instances import figure3


@pytest.fixture(scope="module")
def instances() -> list[Instance]:
    return read_instances(instances_path())


def test_there_are_enough_and_each_is_sound(instances: list[Instance]) -> None:
    assert 20 <= len(instances) <= 30
    assert len({one.name for one in instances}) == len(instances)
    for one in instances:
        network = one.opened().network
        legs = legs_named(network, one.plan)
        assert bool(legs) != bool(one.stops)
        assert leg_names(network, legs) == list(one.plan)
        assert one.low_s < one.value_s < one.high_s
        assert one.bound is not None
        assert 0.0 < one.bound.bound_s <= one.bound.planned_s + 0.1
        is_free = one.bound.plan_class == "free"
        assert is_free == bool(one.bound.note or one.stops)


def test_a_bound_is_for_roads_or_for_any_flight(
    instances: list[Instance], monkeypatch: pytest.MonkeyPatch
) -> None:
    one = next(one for one in instances if one.name == "figure3, 60 km")
    opened = one.opened()
    recorder = Recorder(opened, 1)
    futures = recorder.planning().futures
    roads = bound_on(one, futures, 20)
    problem = problem_of(opened, futures)
    best = make_plan(method_named("exact"), opened, recorder, futures).plan
    seen = evaluate(best.tracks, futures, problem.sensor, problem.objective)
    assert (roads.plan_class, roads.note) == ("roads", "")
    assert roads.bound_s <= seen.expected_detection_time_s
    assert roads.gap == pytest.approx(roads.planned_s / roads.bound_s - 1.0)
    monkeypatch.setattr(bound, "MOST_CELLS", 10)
    free = bound_on(one, futures, 20)
    assert (free.plan_class, free.planned_s) == ("free", pytest.approx(roads.planned_s))
    assert 600.0 - 2.0 <= free.bound_s <= roads.bound_s  # 60 km at 100 m/s, less the radius
    assert "take a smaller net" in free.note


def test_a_plan_known_is_worth_what_was_written_down(instances: list[Instance]) -> None:
    one = next(one for one in instances if one.scenario == "figure3")
    opened = one.opened()
    found = flown_again(one, opened, Recorder(opened, 1).evaluation().futures)
    assert found.expected_detection_time_s == pytest.approx(one.value_s, abs=0.06)
    assert found.ci95_s == pytest.approx((one.low_s, one.high_s), abs=0.06)


def test_compare_on_instances(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = instances_path().read_text()
    head, *blocks = text.split("[[instance]]\n")
    first = next(block for block in blocks if 'scenario = "figure3"' in block)
    path = tmp_path / "instances.toml"
    path.write_text(f"{head}[[instance]]\n{first}")
    monkeypatch.setattr(commands_instances, "instances_path", lambda: path)
    run = Commands(capsys)
    (told,) = run("compare", "--instances", "-o", tmp_path / "out", "-j", 1, "--json").json[
        "instances"
    ]
    assert set(told["methods"]) == {method.name for method in METHODS}
    assert told["methods"]["exact"] >= told["best_known_s"] - 0.05 * told["best_known_s"]
    assert told["methods"]["random"] > told["best_known_s"]
    page = (tmp_path / "out" / "instances.md").read_text()
    header, _, line = page.splitlines()[-3:]
    cells = dict(zip(header.split(" | "), line.split(" | "), strict=True))
    patterns = [told["methods"][method.name] for method in METHODS if method.is_pattern]
    above = 100 * (min(patterns) / told["best_known_s"] - 1)
    assert cells["best pattern"] == f"{above:+.1f} %"
    assert "spiral" not in cells
    assert header.split(" | ")[-1] == f"{METHODS[-1].name} |"
    assert line.startswith(f"| {told['instance']} | ")
    assert f"| {100 * (told['methods']['random'] / told['best_known_s'] - 1):+.1f} % |" in line
    assert told["bound"]["plan_class"] == "roads"
    said = run("compare", "--instances", "-o", tmp_path / "out", "-j", 1)
    assert said.code == 0
    assert "best known" in said.out
    assert "written down" not in said.out
    path.write_text(path.read_text().replace("value_s = ", "value_s = 9"))
    said = run("compare", "--instances", "-o", tmp_path / "out")
    assert "were written down" in " ".join(said.out.split())


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--instances", "grid5x5"), "--instances: brings its own scenarios; leave grid5x5 out"),
        ((), "compare: names no scenario; give one, or --instances"),
    ],
)
def test_a_scenario_or_instances(
    arguments: tuple[str, ...], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    said = Commands(capsys)("compare", *arguments)
    assert (said.code, said.err) == (2, f"planner: {told}\n")


@pytest.mark.parametrize("text", ["[[instance]]\nname = 'x'", "nothing = 1", "[[["])
def test_a_broken_file_is_told_in_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "instances.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=r"holds no instances .*; each needs name"):
        read_instances(path)


def test_a_road_that_is_not_there() -> None:
    network = figure3()
    assert legs_named(network, ["AB", "!BC"]) == [
        2 * network.road_ids.index("AB"),
        2 * network.road_ids.index("BC") + 1,
    ]
    with pytest.raises(InputError, match="XY: is not a road"):
        legs_named(network, ["AB", "XY"])
