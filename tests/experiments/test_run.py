"""Experiments run: the same table whatever the workers and the interruptions."""

import csv
import functools
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from command_line import Commands, rows
from planner.belief.opening import open_scenario
from planner.errors import InputError, OutputError, SumoError
from planner.experiments.condition import Condition
from planner.experiments.conduct import Outcome, conduct
from planner.experiments.experiment_file import Experiment, read_experiment
from planner.experiments.run import run
from planner.mission.preparation import Recorder
from planner.mission.trial import try_method
from planner.search.methods import method_named

TEXT = """
scenario = "figure3"
replicates = 2
targets = 100
[factors]
"sensor.radius_m" = [200, -1, 500]
method = ["greedy", "wait", "best"]
"""
TABLES = ("results.csv", "results.parquet")


@pytest.fixture(scope="module")
def experiment(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    path = tmp_path_factory.mktemp("experiment") / "small.toml"
    path.write_text(TEXT)
    return read_experiment(path)


@pytest.fixture(scope="module")
def conditions(experiment: Experiment) -> list[Condition]:
    return experiment.conditions()


@pytest.fixture(scope="module")
def whole(conditions: list[Condition], tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("whole")
    assert run(conditions, out, workers=1).run == len(conditions)
    return out


def same(out: Path, whole: Path) -> bool:
    kept = [path.relative_to(whole) for path in sorted((whole / "conditions").iterdir())]
    files = [*map(Path, TABLES), *kept]
    return all((out / file).read_bytes() == (whole / file).read_bytes() for file in files)


def cells(out: Path) -> list[dict[str, str]]:
    with (out / "results.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def calling(condition: Condition, *, folder: Path, act: Callable[[Condition], None]) -> Outcome:
    """Run a condition as it is run elsewhere, but leave a note of it and do something before."""
    act(condition)
    with (folder / "called").open("a") as file:
        file.write(f"{condition.id}\n")
    return conduct(condition)


def nothing(condition: Condition) -> None:
    pass


def die(condition: Condition, *, folder: Path, times: int) -> None:
    """End the process of a condition, a number of times."""
    died = folder / "died"
    before = len(died.read_text()) if died.exists() else 0
    if (condition.method, condition.seed) == ("wait", 2) and before < times:
        died.write_text("x" * (before + 1))
        os.kill(os.getpid(), signal.SIGKILL)


def fail(condition: Condition, *, error: Exception) -> None:
    if (condition.method, condition.seed) == ("wait", 2):
        raise error


def fails(condition: Condition, *, error: Exception) -> Outcome:
    fail(condition, error=error)
    return conduct(condition)


def test_rows_are_what_each_method_gives_alone(whole: Path, conditions: list[Condition]) -> None:
    told = cells(whole)
    assert [row["id"] for row in told] == [condition.id for condition in conditions]
    for row in (told[0], told[5], told[-2]):
        radius, method = row["sensor.radius_m"], method_named(row["method"])
        settings = [f"sensor.radius_m={radius}", f"search.seed={row['seed']}"]
        opened = open_scenario("figure3", overrides=settings)
        recorder = Recorder(opened, 1)
        planning, fresh = recorder.planning().futures, recorder.evaluation(100).futures
        trial = try_method(method, opened, planning, fresh)
        seen = trial.evaluated
        assert float(row["expected_detection_time_s"]) == seen.expected_detection_time_s
        assert (float(row["ci95_low_s"]), float(row["ci95_high_s"])) == seen.ci95_s
        assert float(row["detection_probability"]) == seen.detection_probability
        assert float(row["found_before_goal_probability"]) == seen.found_before_goal_probability
        assert float(row["planned_s"]) == trial.planned.expected_detection_time_s
        assert int(row["roads"]) == trial.roads
        assert row["work"] == ("" if trial.work is None else str(trial.work))


def test_both_tables_say_the_same(whole: Path) -> None:
    columns = rows(whole / "results.parquet")
    for name, column in columns.items():
        text = ["" if value is None else value for value in column]
        told = [row[name] for row in cells(whole)]
        if all(isinstance(value, str) for value in text):
            assert text == told
        else:
            assert text == [float(value) if value else "" for value in told]


def test_all_methods_meet_the_same_targets(whole: Path) -> None:
    found = {(r["seed"], r["planned_s"]) for r in cells(whole) if r["method"] == "greedy"}
    assert len({r["expected_detection_time_s"] for r in cells(whole)}) == 13  # 12 and none
    assert len(found) == 6
