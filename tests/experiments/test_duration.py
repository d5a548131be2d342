"""How long experiments will take, told before they are run."""

import dataclasses
from pathlib import Path

import pytest

from planner.experiments.condition import Condition
from planner.experiments.duration import (
    CONDITION_S,
    LEG_S,
    Duration,
    duration_of,
    known_times,
)
from planner.experiments.experiment_file import read_experiment
from planner.experiments.target_sets import targets_of
from planner.futures.cost import cost_of
from planner.mission.opening import OpenScenario
from planner.mission.recorder import Recorder
from support.command_line import Commands

TEXT = """
scenario = "grid4x4"
targets = 30
replicates = 2
[factors]
"search.particles" = [10]
"uav.start.distance_m" = [0, 60000]
method = ["greedy", "best"]
[sets."all"]
points = 2
"""


@pytest.fixture
def conditions(tmp_path: Path) -> list[Condition]:
    path = tmp_path / "small.toml"
    path.write_text(TEXT)
    return read_experiment(path).conditions()


def test_by_size_it_is_targets_driven_and_legs_flown(conditions: list[Condition]) -> None:
    first = conditions[0]
    recorder = Recorder(first.opened(), 1)
    sets = [len(recorder.planning().futures), len(recorder.holdout().futures), first.targets]
    sets = [*sets, *sets, len(targets_of(first.sets[0], first).futures)]
    network, horizon_s = first.opened().network, first.opened().scenario.search.horizon_s
    costs = [cost_of(network, n, driving="constant", horizon_s=horizon_s) for n in sets]
    legs = 4 * first.opened().scenario.search.work  # best's at two distances, with two seeds
    driven_s = sum(cost.load_s + cost.cpu_s for cost in costs)
    expected_s = driven_s + LEG_S * legs + CONDITION_S * len(conditions)
    found = duration_of(conditions, {})
    assert found.time_s == pytest.approx(expected_s)
    assert (found.timed, found.sized, found.unknown) == (0, 8, ())
    assert found.runs == sum(cost.runs for cost in costs)


def test_what_is_finished_tells_of_what_waits(conditions: list[Condition]) -> None:
    times = [(c, {"whole_s": s}) for c, s in zip(conditions, (1.0, 2.0, 300.0), strict=False)]
    known = known_times([(dataclasses.replace(c, method="wait"), t) for c, t in times])
    assert known == {"wait": 2.0}
    one = dataclasses.replace(conditions[0], sets=(), targets=0, method="wait")
    found = duration_of([one], known)
    assert (found.timed, found.sized) == (1, 0)
    network, horizon_s = one.opened().network, one.opened().scenario.search.horizon_s
    driven = cost_of(network, 10, driving="constant", horizon_s=horizon_s)
    assert found.time_s == pytest.approx(2.0 + driven.cpu_s)


def test_of_studies_nothing_is_known_before_one_is_done(conditions: list[Condition]) -> None:
    study = dataclasses.replace(conditions[0], study="orders")
    assert duration_of([study], {}) == Duration(0.0, 0, 0, ("study orders",))
    assert duration_of([study], known_times([(study, {"whole_s": 7.0})])).time_s == 7.0
    assert known_times([(study, {})]) == {}


def test_what_is_at_fault_takes_no_time_to_draw(conditions: list[Condition]) -> None:
    broken = dataclasses.replace(conditions[0], overrides=("sensor.radius_m=-1",))
    assert duration_of([broken], {}).time_s == CONDITION_S


def test_it_is_told_as_a_sentence() -> None:
    assert Duration(0.0, 0, 0, ()).sentence(2) == "nothing is left to run"
    unknown = Duration(0.0, 0, 0, ("exact",))
    assert unknown.sentence(2) == "how long it takes shows when some of it is done: exact"
    assert Duration(90.0, 3, 0, ()).sentence(1) == (
        "about 90 s with 1 process (3 conditions by the times of finished ones)"
    )
    assert Duration(2400.0, 3, 1200, ("exact",)).sentence(2) == (
        "about 20 min with 2 processes (3 conditions by the times of finished ones; 1,200 by their "
        "size, good to a factor of two; without exact, of which none is done)"
    )
    assert (
        Duration(72_000.0, 0, 1, ()).sentence(2).startswith("about 10.0 h with 2 processes (1 by")
    )


def test_dry_run_of_the_paper_lists_all_experiments(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = Commands(capsys)(
        "experiment", "paper", "--quick", "--dry-run", "--json", "-o", tmp_path / "none"
    )
    assert {c["finished"] for c in said.json["conditions"]} == {False}
    assert {"wait", "best", "orders", "precedence"} <= {
        c["method"] for c in said.json["conditions"]
    }
    assert said.json["duration"]["unknown"] == [
        "study precedence",
        "study orders",
        "study optimum",
        "study online",
    ]
    assert said.err.count("the method assumes") == 1  # not once for each condition
    shown = Commands(capsys)("experiment", "paper", "--quick", "--dry-run")
    assert "conditions, 0 of them finished" in shown.out
    assert "about " in shown.out
    assert not (tmp_path / "none").exists()


def test_a_town_is_charged_by_its_own_net(tmp_path: Path, berlin: OpenScenario) -> None:
    path = tmp_path / "town.toml"
    path.write_text('scenario = "berlin"\ntargets = 100\n[factors]\nmethod = ["rate"]\n')
    (condition,) = read_experiment(path).conditions()
    search = berlin.scenario.search
    driven = [
        cost_of(berlin.network, n, driving="free", horizon_s=search.horizon_s)
        for n in (search.particles, 100)
    ]
    found = duration_of([condition], {})
    assert found.runs == search.particles + 100
    assert found.time_s == pytest.approx(CONDITION_S + sum(cost.wall_s(1) for cost in driven))


def test_what_takes_long_is_announced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "tiny.toml"
    text = 'scenario = "figure3"\ntargets = 10\nreplicates = 2\n[factors]\nmethod = ["wait"]\n'
    path.write_text(text)
    quiet = Commands(capsys)("experiment", path, "-o", tmp_path / "quiet", "-j", "1")
    assert (quiet.code, quiet.err) == (0, "")
    monkeypatch.setattr("planner.cli.batch.LONG_S", 0.0)
    said = Commands(capsys)("experiment", path, "-o", tmp_path / "told", "-j", "1")
    runs = 2  # figure3's particles are all there are; its fresh targets share a run for each seed
    assert said.err == (
        f"planner: tiny: 2 conditions, {runs} SUMO runs: about 1 s with 1 process "
        "(2 by their size, good to a factor of two)\n"
    )
    again = Commands(capsys)("experiment", path, "-o", tmp_path / "told", "-j", "1")
    assert again.err == ""
