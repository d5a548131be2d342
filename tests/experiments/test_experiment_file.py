"""Experiment files: which conditions follow, and what is said of a bad one."""

import dataclasses
import hashlib
import json
from pathlib import Path

import pytest

from planner.errors import InputError
from planner.experiments.experiment import Experiment
from planner.experiments.experiment_file import read_experiment
from planner.mission.sample_sizes import FRESH_TARGETS, fresh_targets
from planner.paper.studies import STUDIES
from planner.scenario.source import read_source
from planner.scenario.toml_text import toml_text
from support.command_line import Commands

SOUND = """
scenario = "figure3"
replicates = 3
[factors]
"sensor.radius_m" = [100, 200.5, 300]
method = ["greedy", "wait"]
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "some.toml"
    path.write_text(text)
    return path


@pytest.fixture
def sound(tmp_path: Path) -> Experiment:
    return read_experiment(written(tmp_path, SOUND))


def test_all_combinations_with_all_seeds(sound: Experiment) -> None:
    found = [(c.overrides, c.method, c.seed) for c in sound.conditions()]
    assert found == [
        ((f"sensor.radius_m={radius}",), method, seed)
        for radius in ("100", "200.5", "300")
        for method in ("greedy", "wait")
        for seed in (1, 2, 3)
    ]


def test_id_is_a_digest_of_what_makes_a_condition(sound: Experiment) -> None:
    first = sound.conditions()[0]
    text = (
        '{"method":"greedy","overrides":["sensor.radius_m=100"],"preset":null,'
        '"scenario":"figure3","seed":1,"targets":4000}'
    )
    assert first.id == hashlib.sha256(text.encode()).hexdigest()[:16]
    others = [
        dataclasses.replace(first, **change)
        for change in (
            {"seed": 2},
            {"method": "wait"},
            {"preset": "paper"},
            {"targets": 10},
            {"overrides": ()},
            {"scenario": "figure1"},
        )
    ]
    assert len({c.id for c in [first, *others]}) == 7


def test_id_is_the_same_wherever_the_files_lie(sound: Experiment, tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    moved = read_experiment(written(tmp_path / "other", SOUND))
    assert [c.id for c in moved.conditions()] == [c.id for c in sound.conditions()]
    assert len({c.id for c in sound.conditions()}) == 18


def test_metrics_choose_columns_and_change_no_condition(sound: Experiment, tmp_path: Path) -> None:
    fewer = read_experiment(written(tmp_path, f'metrics = ["work", "planned_s"]{SOUND}'))
    assert [c.id for c in fewer.conditions()] == [c.id for c in sound.conditions()]
    assert {c.metrics for c in fewer.quick().conditions()} == {("work", "planned_s")}


def test_quick_takes_the_ends_and_two_seeds(sound: Experiment) -> None:
    quick = sound.quick().conditions()
    radii = ("sensor.radius_m=100", "sensor.radius_m=300")
    small = ("search.particles=128", "search.work=2000")
    assert {c.overrides for c in quick} == {(*small, r) for r in radii}
    assert {c.seed for c in quick} == {1, 2}
    assert {c.targets for c in quick} == {1000}


@pytest.mark.parametrize(
    ("choices", "count"),
    [
        (["method=wait"], 9),
        (["method=wait", "seed=2"], 3),
        (["sensor.radius_m=100.0"], 6),
        (["sensor.radius_m=100", "sensor.radius_m=300", "seed=1"], 4),
        ([], 18),
    ],
)
def test_only(sound: Experiment, choices: list[str], count: int) -> None:
    kept = sound.only(choices).conditions()
    assert len(kept) == count
    wanted = {choice.partition("=")[2] for choice in choices if choice.startswith("method")}
    assert not wanted or {c.method for c in kept} == wanted


@pytest.mark.parametrize("choice", ["radius=1", "method=foo", "seed=9", "sensor.radius_m=x", "x"])
def test_only_of_what_there_is(sound: Experiment, choice: str) -> None:
    with pytest.raises(InputError, match=f"--only {choice}: .*; "):
        sound.only([choice])


@pytest.mark.parametrize(
    "value",
    [1, -2.5, 15e3, True, "once", 'a "b" \\ ü 🚁', [1, 2], {"constant": 0}, {"a b": {"c": [1.5]}}],
)
def test_levels_reach_the_scenario_as_they_are(value: object) -> None:
    source = read_source("figure3", overrides=[f"target.distance_m={toml_text(value)}"])
    assert source.faults == ()
    assert source.tables["target"]["distance_m"] == value


def test_the_papers_figure() -> None:
    figure8 = read_experiment("grid5x5/figure8")
    conditions = figure8.conditions()
    distances = figure8.factors["uav.start.distance_m"]
    assert len(distances) >= 15
    assert (distances[0], distances[-1]) == (0, 700e3)
    assert {part.block: len(part.seeds) for part in figure8.parts} == {
        "no planning": 1,
        "300 s": 10,
        "1 s": 10,
    }
    assert {c.preset for c in conditions} == {"paper"}
    assert len({c.id for c in conditions}) == len(conditions) == (3 + 4 * 10) * len(distances)


FACTORS = '[factors]\nmethod = ["wait"]\n'


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("scenario = ", "is not TOML"),
        (FACTORS, "scenario: is missing; give"),
        (f"scenario = 3\n{FACTORS}", "scenario: should be text in quotes, not 3"),
        (f'scenario = "figure33"\n{FACTORS}', "scenario: figure33: is neither a file.*figure3"),
        (f'scenario = "figure3"\nreplicate = 2\n{FACTORS}', "replicate: .* mean replicates"),
        (f'scenario = "figure3"\nreplicates = 0\n{FACTORS}', "replicates: should not be 0; give"),
        (f'scenario = "figure3"\ntargets = true\n{FACTORS}', "targets: should not be true; give"),
        (f'scenario = "figure3"\npreset = "papr"\n{FACTORS}', "preset: presets.papr: is not in"),
        ('scenario = "figure3"', r"factors: is missing; write \[factors\]"),
        ('scenario = "figure3"\nfactors = 3', "factors: should be a table, not 3; write"),
        ('scenario = "figure3"\n[factors]\nmethod = "wait"', "factors.method: should be a list"),
        ('scenario = "figure3"\n[factors]\nmethod = []', "factors.method: should be a list"),
        ('scenario = "figure3"\n[factors]\nmethod = ["gready"]', "factors.method: .* choose"),
        ('scenario = "figure3"\n[factors]\nmethod = [3]', "factors.method: 3: .* choose"),
        ('scenario = "figure3"\n[factors]\nuav.speed_mps = [1]', 'factors.uav: .*"uav.speed_mps"'),
        ('scenario = "figure3"\n[factors]\n"uav.sped_mps" = [1]', "factors.uav.sped_mps: .*speed"),
        ('scenario = "figure3"\n[factors]\n"uva.x" = [1]', "factors.uva: .* mean uav"),
        ('scenario = "figure3"\n[factors]\n"uav.speed_mps" = [9, 9.0]', "9 more than once; name"),
        ('scenario = "figure3"\n[factors]\n"search.by_s" = [01:00:00]', "write it in quotes"),
        (
            'scenario = "figure3"\n[factors]\n"uav.speed_mps" = [inf]',
            "inf: is no finite number; give one",
        ),
        (f'metrics = ["plannd_s"]\nscenario = "figure3"\n{FACTORS}', "metrics: .*planned_s"),
        (f'metrics = [[1]]\nscenario = "figure3"\n{FACTORS}', "metrics: .* no figure .*; "),
        (f'metrics = []\nscenario = "figure3"\n{FACTORS}', "metrics: should be a list .*; write"),
        (
            'metrics = ["work"]\nscenario = "figure3"\nstudy = "orders"',
            "metrics: a study .*; leave",
        ),
        ('scenario = "figure3"\n[factors]\n"search.seed" = [1, 2]', "search.seed: .* replicates"),
    ],
)
def test_bad_files_get_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, told: str
) -> None:
    path = written(tmp_path, text)
    with pytest.raises(InputError, match=told):
        read_experiment(path, STUDIES)
    said = Commands(capsys)("experiment", path, "-o", tmp_path / "out")
    assert (said.code, said.out, said.err.count("\n")) == (2, "", 1)
    assert said.err.startswith(f"planner: {path}: ")
    assert not (tmp_path / "out").exists()


def test_no_such_file(tmp_path: Path) -> None:
    for place in (tmp_path / "none.toml", "figure88", "grid5x5/figure88", "figure3/figure8"):
        with pytest.raises(InputError, match="there is no such experiment file; give"):
            read_experiment(place)


def test_dry_run_lists_and_runs_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], sound: Experiment
) -> None:
    out = tmp_path / "out"
    said = Commands(capsys)("experiment", sound.path, "--dry-run", "--json", "-o", out)
    listed = json.loads(said.out)["conditions"]
    assert [c["id"] for c in listed] == [c.id for c in sound.conditions()]
    assert {c["finished"] for c in listed} == {False}
    assert not out.exists()


def test_in_a_town_fewer_targets_are_usual(tmp_path: Path) -> None:
    town = 'scenario = "berlin"\n[factors]\nmethod = ["rate"]\n'
    (condition,) = read_experiment(written(tmp_path, town)).conditions()
    opened = condition.opened()
    assert condition.targets == fresh_targets(opened.scenario, opened.network) < FRESH_TARGETS
    (condition,) = read_experiment(written(tmp_path, f"targets = 70\n{town}")).conditions()
    assert condition.targets == 70
    grid = town.replace("berlin", "grid5x5")
    (condition,) = read_experiment(written(tmp_path, grid)).conditions()
    assert condition.targets == FRESH_TARGETS
