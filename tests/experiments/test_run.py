"""Experiments run: the same table whatever the workers and the interruptions."""

import csv
import functools
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from planner.errors import InputError, OutputError, SumoError
from planner.experiments import processes as pool
from planner.experiments.condition import Condition
from planner.experiments.dask_backend import by_dask
from planner.experiments.experiment import Experiment
from planner.experiments.experiment_file import read_experiment
from planner.experiments.processes import Done, RunCondition
from planner.experiments.result_store import ResultStore
from planner.experiments.run import run
from planner.experiments.run_condition import Outcome, run_condition
from planner.futures.cluster import Cluster
from planner.mission.opening import open_scenario
from planner.mission.recorder import Recorder
from planner.mission.trial import try_method
from planner.provenance import versions
from planner.scenario.source import read_source
from planner.search.methods import method_named
from support.command_line import Commands, rows
from support.experiment_results import run_alone

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
    assert run_alone(conditions, out, workers=1).run == len(conditions)
    return out


def here(run_one: RunCondition, conditions: Sequence[Condition], _: int) -> Iterator[Done]:
    """Run conditions in this process, where processes are not what is tested."""
    return ((condition, run_one(condition)) for condition in conditions)


def same(out: Path, whole: Path) -> bool:
    kept = [path.relative_to(whole) for path in sorted((whole / "conditions").iterdir())]
    files = [*map(Path, TABLES), *kept]
    return all((out / file).read_bytes() == (whole / file).read_bytes() for file in files)


def cells(out: Path) -> list[dict[str, str]]:
    with (out / "results.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def noted(
    condition: Condition, *, folder: Path, act: Callable[[Condition], object] | None = None
) -> Outcome:
    """Run a condition as it is run elsewhere, but do something before, and leave a note."""
    if act is not None and (condition.method, condition.seed) == ("wait", 2):
        act(condition)
    with (folder / "noted").open("a") as file:
        file.write(f"{condition.id}\n")
    return run_condition(condition)


def die(_: Condition, *, folder: Path, times: int) -> None:
    """End the process that runs a condition, a number of times."""
    died = folder / "died"
    before = len(died.read_text()) if died.exists() else 0
    if before < times:
        died.write_text("x" * (before + 1))
        os.kill(os.getpid(), signal.SIGKILL)


def fail(*_: object, error: Exception, **__: object) -> None:
    raise error


def test_rows_are_what_each_method_gives_alone(whole: Path, conditions: list[Condition]) -> None:
    told = cells(whole)
    assert [row["id"] for row in told] == [condition.id for condition in conditions]
    for row in (told[0], told[5], told[-2]):
        radius, method = row["sensor.radius_m"], method_named(row["method"])
        settings = [f"sensor.radius_m={radius}", f"search.seed={row['seed']}"]
        opened = open_scenario("figure3", overrides=settings)
        recorder = Recorder(opened, 1)
        planning, fresh = recorder.planning().futures, recorder.evaluation(100).futures
        trial = try_method(method, recorder, planning, fresh)
        seen = trial.evaluated
        assert float(row["expected_detection_time_s"]) == seen.expected_detection_time_s
        assert (float(row["ci95_low_s"]), float(row["ci95_high_s"])) == seen.ci95_s
        assert float(row["detection_probability"]) == seen.detection_probability
        assert float(row["found_before_goal_probability"]) == seen.found_before_goal_probability
        assert float(row["planned_s"]) == trial.planned.expected_detection_time_s
        assert int(row["roads"]) == trial.roads
        work = trial.result.work
        assert row["work"] == ("" if work is None else str(work))
        assert row["versions"].startswith("planner 0.1.0, sumo 1.28")


def test_both_tables_say_the_same(whole: Path) -> None:
    columns = rows(whole / "results.parquet")
    for name, column in columns.items():
        text = ["" if value is None else value for value in column]
        told = [row[name] for row in cells(whole)]
        if all(isinstance(value, str) for value in text):
            assert text == told
        else:
            assert text == [float(value) if value else "" for value in told]


def test_workers_change_nothing(conditions: list[Condition], whole: Path, tmp_path: Path) -> None:
    run_alone(conditions, tmp_path, workers=2)
    assert same(tmp_path, whole)
    timings = rows(tmp_path / "timings.parquet")
    assert timings["id"] == [condition.id for condition in conditions]
    failed = [row["reason"] != "" for row in cells(tmp_path)]
    assert [took is None for took in timings["planning_s"]] == failed
    assert min(timings["whole_s"]) > 0
    assert set(timings["retries"]) == {0}


def test_a_failing_condition_is_recorded(whole: Path) -> None:
    for row in cells(whole):
        failed = row["sensor.radius_m"] == "-1"
        assert row["reason"].startswith("sensor.radius_m: should be greater than 0" * failed)
        assert (row["expected_detection_time_s"] == "") == (row["reason"] != "") == failed


def test_resuming_runs_nothing_twice(
    conditions: list[Condition], whole: Path, tmp_path: Path
) -> None:
    out, told = tmp_path / "out", functools.partial(noted, folder=tmp_path)
    alone = functools.partial(run_alone, out=out, run_one=told, backend=here)
    some = conditions[::3]
    alone(some)
    assert len(cells(out)) == len(some)
    (out / "conditions" / f".half{conditions[0].id}.json").write_text("{")
    damaged = out / "conditions" / f"{some[0].id}.json"
    damaged.write_bytes(damaged.read_bytes()[:-9])
    assert alone(conditions).run == len(conditions) - len(some) + 1
    assert same(out, whole)
    assert alone(conditions).run == 0
    assert same(out, whole)
    ran = (tmp_path / "noted").read_text().split()
    assert ran == [c.id for c in some] + [c.id for c in conditions if c not in some[1:]]
    assert not list((out / "conditions").glob(".*"))


def test_another_scenario_is_run_anew(tmp_path: Path) -> None:
    fixed = read_experiment_beside(tmp_path, horizon_s=3600).conditions()[:2]
    assert run_alone(fixed, tmp_path / "out", backend=here).run == 2
    assert run_alone(fixed, tmp_path / "out", backend=here).run == 0
    before = cells(tmp_path / "out")
    other = read_experiment_beside(tmp_path, horizon_s=400).conditions()[:2]
    assert [c.id for c in other] == [c.id for c in fixed]
    assert run_alone(other, tmp_path / "out", backend=here).run == 2
    assert cells(tmp_path / "out") != before


def read_experiment_beside(folder: Path, *, horizon_s: float) -> Experiment:
    """An experiment on a scenario that lies beside it."""
    source = read_source("figure3")
    text = source.path.read_text().replace("horizon_s = 3600", f"horizon_s = {horizon_s:g}")
    (folder / "scenario.toml").write_text(text)
    for file in source.folder.glob("*.xml"):
        shutil.copy(file, folder)
    path = folder / "small.toml"
    path.write_text(TEXT.replace('"figure3"', '"scenario.toml"'))
    return read_experiment(path)


def test_a_killed_worker_changes_nothing(
    conditions: list[Condition], whole: Path, tmp_path: Path
) -> None:
    act = functools.partial(die, folder=tmp_path, times=1)
    out, told = tmp_path / "out", functools.partial(noted, folder=tmp_path, act=act)
    assert run_alone(conditions, out, workers=2, run_one=told).run == len(conditions)
    assert (tmp_path / "died").read_text() == "x"
    assert same(out, whole)
    assert killed_once(out, conditions)


def killed_once(out: Path, conditions: list[Condition]) -> bool:
    """Tell whether the retries are those of the one that died, and of some beside it."""
    retries = rows(out / "timings.parquet")["retries"]
    died = [(condition.method, condition.seed) == ("wait", 2) for condition in conditions]
    return max(retries[at] for at, one in enumerate(died) if one) == 1 and sum(retries) <= 3


def test_a_stopped_run_goes_on_where_it_was(
    experiment: Experiment, whole: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    code, said = stopped(experiment, out, signal.SIGINT)
    assert (code, said) == (
        130,
        "\nplanner: what is finished is kept; the same command goes on from there\n"
        "planner: stopped; nothing is half-written\n",
    )
    before = kept_in(out)
    assert 0 < len(before) < len(experiment.conditions())
    code, said = stopped(experiment, out, signal.SIGKILL)
    assert (code, said) == (-signal.SIGKILL, "")
    after = kept_in(out)
    assert before.items() <= after.items()
    assert len(before) < len(after)
    assert not (out / "results.csv").exists()
    assert run_alone(experiment.conditions(), out, workers=2).run == len(
        experiment.conditions()
    ) - len(after)
    assert same(out, whole)


def kept_in(out: Path) -> dict[str, int]:
    """What is finished, and when it was written."""
    return {path.name: path.stat().st_mtime_ns for path in (out / "conditions").glob("[!.]*")}


def stopped(experiment: Experiment, out: Path, number: signal.Signals) -> tuple[int, str]:
    """Exit code and last words of a run that is stopped when it has kept something more."""
    before = len(kept_in(out))
    arguments = ["experiment", str(experiment.path), "-o", str(out), "--jobs", "1"]
    process = subprocess.Popen(
        [sys.executable, "-m", "planner", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    until_s = time.monotonic() + 300
    while len(kept_in(out)) == before and time.monotonic() < until_s:
        time.sleep(0.002)
    if number == signal.SIGINT:
        os.killpg(process.pid, number)  # a terminal tells all of them
    else:
        process.kill()
    # It is read to its end, which comes when the last process that could write to it is gone.
    _, said = process.communicate(timeout=30)
    return process.returncode, said


def test_what_always_kills_its_worker_is_told_from_the_others(
    conditions: list[Condition], whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pool, "TRIES", 1)
    act = functools.partial(die, folder=tmp_path, times=99)
    few, out = conditions[:4], tmp_path / "out"
    run_alone(few, out, workers=2, run_one=functools.partial(noted, folder=tmp_path, act=act))
    *well, killed = cells(out)
    assert well == cells(whole)[:3]
    assert killed["reason"].startswith("the process that ran it was killed 2 times")
    assert rows(out / "timings.parquet")["retries"][-1] == 1
    assert run_alone(few, out, workers=1).run == 1  # it is tried again the next time
    assert cells(out) == cells(whole)[:4]


@pytest.mark.parametrize(
    ("error", "reason"),
    [(SumoError("no\nmemory"), "no memory"), (RuntimeError("odd"), "RuntimeError: odd")],
)
def test_what_may_be_mended_is_tried_again(
    conditions: list[Condition],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    error: Exception,
    reason: str,
) -> None:
    with monkeypatch.context() as broken:
        broken.setattr(
            "planner.experiments.run_condition.try_method", functools.partial(fail, error=error)
        )
        outcome = run_condition(conditions[2])
    assert (outcome.figures["reason"], outcome.final) == (reason, False)
    kept = ResultStore(tmp_path)
    kept.keep(conditions[2], outcome)
    assert kept.figures(conditions[2]) is None
    kept.keep(conditions[2], run_condition(conditions[2]))
    assert kept.figures(conditions[2]) is not None


def test_the_table_holds_the_metrics_chosen(
    conditions: list[Condition], whole: Path, tmp_path: Path
) -> None:
    out = shutil.copytree(whole, tmp_path / "out")
    fewer = [replace(one, metrics=("work", "planned_s")) for one in conditions]
    results = run_alone(fewer, out, workers=1)
    assert results.run == 0
    assert results.rows[0]["roads"] is not None  # what is told at the end is whole
    names = ["id", "method", "sensor.radius_m", "seed", "planned_s", "work", "reason", "versions"]
    assert sorted(cells(out)[0]) == sorted(names)
    assert sorted(rows(out / "results.parquet")) == sorted(names)
    assert cells(out) == [{name: row[name] for name in cells(out)[0]} for row in cells(whole)]


@pytest.mark.parametrize("package", ["planner", "sumo", "numpy"])
@pytest.mark.parametrize("at", [0, 6], ids=["sound", "failed"])
def test_what_another_version_made_counts_no_more(
    conditions: list[Condition],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    package: str,
    at: int,
) -> None:
    ResultStore(tmp_path).keep(conditions[at], Outcome({"reason": "some"}, {}))
    assert ResultStore(tmp_path).figures(conditions[at]) == {"reason": "some"}
    newer = versions() | {package: "99.0"}
    monkeypatch.setattr("planner.experiments.result_store.versions", lambda: newer)
    assert ResultStore(tmp_path).figures(conditions[at]) is None


def test_the_command_tells_what_came_of_it(
    experiment: Experiment, whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = shutil.copytree(whole, tmp_path / "out")
    command = Commands(capsys)
    said = command("experiment", experiment.path, "-o", out)
    assert (said.code, said.err) == (0, "")
    assert "6 failed: sensor.radius_m: should be greater than 0" in said.out
    assert "0 conditions run, 18 were finished before" in said.out
    told = command("experiment", experiment.path, "-o", out, "--only", "seed=2", "--json").json
    assert told == {"results": str(out), "conditions": 9, "run": 0, "failed": 3}
    other = experiment.path.with_name("other.toml")
    other.write_text(TEXT)
    refused = command("experiment", other, "-o", out)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert "holds another experiment; choose another folder" in refused.err


def test_experiments_take_turns_and_share_what_is_equal(
    conditions: list[Condition], whole: Path, tmp_path: Path
) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    taken: list[str] = []

    def noting(run_one: RunCondition, waiting: Sequence[Condition], workers: int) -> Iterator[Done]:
        taken.extend(condition.id for condition in waiting)
        return here(run_one, waiting, workers)

    shared, others = conditions[:2], [replace(one, seed=7) for one in conditions[:6:2]]
    found = run({first: conditions, second: [*shared, *others]}, backend=noting)
    assert [found[out].run for out in (first, second)] == [len(conditions), 5]
    begin = [conditions[0], conditions[1], conditions[2], others[0], conditions[3], others[1]]
    assert taken[:6] == [condition.id for condition in begin]
    assert len(taken) == len(conditions) + 3
    assert same(first, whole)
    assert [row["id"] for row in cells(second)] == [one.id for one in (*shared, *others)]
    assert run({first: conditions}, backend=noting)[first].rows == found[first].rows


def test_equal_conditions_of_other_files_are_not_shared(tmp_path: Path) -> None:
    long, short = tmp_path / "long", tmp_path / "short"
    experiments = {}
    for folder, horizon_s in ((long, 3600), (short, 400)):
        folder.mkdir()
        one = read_experiment_beside(folder, horizon_s=horizon_s)
        experiments[folder / "out"] = one.conditions()[:1]
    assert len({c.id for (c,) in experiments.values()}) == 1
    run(experiments, backend=here)
    assert cells(long / "out") != cells(short / "out")


def test_nothing_to_run_and_nowhere_to_write(conditions: list[Condition], tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no condition is left"):
        run_alone([], tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="is not a folder; choose another name"):
        run_alone(conditions[:1], tmp_path / "file")


def test_dask_gives_the_same_table_though_a_worker_is_killed(
    conditions: list[Condition], whole: Path, tmp_path: Path
) -> None:
    pytest.importorskip("distributed")
    act = functools.partial(die, folder=tmp_path, times=1)
    out, told = tmp_path / "out", functools.partial(noted, folder=tmp_path, act=act)
    run_alone(
        conditions,
        out,
        workers=2,
        run_one=told,
        backend=functools.partial(by_dask, cluster=Cluster()),
    )
    assert (tmp_path / "died").read_text() == "x"
    assert same(out, whole)
    assert killed_once(out, conditions)


def test_dask_on_a_running_cluster(
    conditions: list[Condition], whole: Path, tmp_path: Path
) -> None:
    distributed = pytest.importorskip("distributed")
    given = {"threads_per_worker": 1, "processes": True, "dashboard_address": "127.0.0.1:0"}
    with distributed.LocalCluster(n_workers=2, **given) as cluster:
        there = functools.partial(by_dask, cluster=Cluster(cluster.scheduler_address))
        run_alone(conditions[:6], tmp_path, workers=1, backend=there)
    assert cells(tmp_path) == cells(whole)[:6]


def test_no_scheduler(
    conditions: list[Condition], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed")
    nowhere = functools.partial(by_dask, cluster=Cluster("tcp://127.0.0.1:1"))
    with pytest.raises(InputError, match=r"--address tcp://127.0.0.1:1: no Dask scheduler answers"):
        run_alone(conditions[:1], tmp_path, workers=1, backend=nowhere)


def test_a_quick_run_is_another_experiment(
    experiment: Experiment, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run_command, out, bad = Commands(capsys), tmp_path / "out", tmp_path / "bad.toml"
    chosen = ("--only", "seed=2", "--only", "method=wait", "--jobs", "1")
    assert run_command("experiment", experiment.path, "-o", out, "--quick", *chosen).code == 0
    refused = run_command("experiment", experiment.path, "-o", out, *chosen)
    assert refused.code == 2
    assert "holds another experiment" in refused.err
    bad.write_text(TEXT.replace("[200, -1, 500]", "[-1]"))
    failed = run_command("experiment", bad, "-o", tmp_path / "bad", *chosen)
    assert (failed.code, "1 failed: sensor.radius_m" in failed.out) == (1, True)


def test_processes_hear_no_ctrl_c_while_they_start(tmp_path: Path) -> None:
    """They would print a traceback each if it came in the midst of their imports."""
    code = (
        "from joblib.externals.loky import ProcessPoolExecutor\n"
        "from planner.experiments.processes import _pool, start_trackers\n"
        "from planner.interrupts import children_deaf\n"
        "from support.dying_rides import blocked\n"
        "if __name__ == '__main__':\n"
        "    start_trackers()\n"
        "    for kind in (ProcessPoolExecutor, _pool):\n"
        "        with kind(1) as pool:\n"
        "            with children_deaf():\n"
        "                first = pool.submit(blocked)\n"
        "            print(first.result())\n"
    )
    script = tmp_path / "pool.py"
    script.write_text(code, encoding="utf-8")
    here = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, str(script)], env=here, capture_output=True, text=True, check=True
    )
    assert done.stdout == "handled, blocked\nignored, heard again\n"
