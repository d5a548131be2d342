"""Particles driven on a Dask cluster."""

import hashlib
import math
import operator
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.errors import InputError, LostError, SumoError
from planner.futures import on_cluster
from planner.futures.cluster import Cluster
from planner.futures.on_cluster import OnCluster
from planner.mission.opening import open_scenario
from planner.mission.recorder import Recorder

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A running scheduler on this machine with one worker of two threads."""
    given = {"threads_per_worker": 2, "processes": True, "dashboard_address": "127.0.0.1:0"}
    with distributed.LocalCluster(n_workers=1, **given) as cluster:
        yield cluster.scheduler_address


@pytest.fixture
def there(address: str) -> Iterator[OnCluster]:
    backend = OnCluster(Cluster(address))
    yield backend
    backend.close()


def answers(backend: OnCluster, function: Any, tasks: Any, files: Any = None) -> list[Any]:
    given = backend.answers(function, tasks, workers=2, files=files or {})
    return [answer for _, answer in given]


def test_the_same_particles_give_the_same_files(
    there: OnCluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = open_scenario("grid5x5", overrides=["search.particles=250"])
    files = []
    for name, recorder in (
        ("here", Recorder(opened, 1)),
        ("there", Recorder(opened, backend=there)),
    ):
        monkeypatch.setenv("PLANNER_CACHE", str(tmp_path / name))
        folder = recorder.planning().path.parent
        files.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert files[0] == files[1]
    assert len(files[0]) == 3


def test_a_town_gives_the_same_motion(
    there: OnCluster, berlin: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = []
    for name, recorder in (
        ("here", Recorder(berlin, 1)),
        ("there", Recorder(berlin, backend=there)),
    ):
        monkeypatch.setenv("PLANNER_CACHE", str(tmp_path / name))
        found.append(recorder.evaluation(25).futures)
    for column in ("time_s", "x_m", "y_m", "first_knot"):
        np.testing.assert_array_equal(getattr(found[0], column), getattr(found[1], column))


def test_answers_come_in_the_order_of_the_tasks(there: OnCluster) -> None:
    numbers = [float(n) for n in range(20)]
    assert answers(there, math.sqrt, numbers) == [math.sqrt(n) for n in numbers]


def counted(upto: int) -> Iterator[int]:
    yield from range(upto)


def test_answers_may_have_parts(there: OnCluster) -> None:
    parts = list(there.answers(counted, [2, 0, 1], workers=2, files={}))
    assert parts == [(0, 0), (0, 1), (2, 0)]


def test_tasks_are_done_by_processes_below_dasks_own(there: OnCluster) -> None:
    call = operator.methodcaller("__call__")
    pids, parents = (set(answers(there, call, [one] * 6)) for one in (os.getpid, os.getppid))
    (worker,) = there._connected(1).run(os.getpid).values()
    assert parents == {worker}
    assert len(pids) <= 2
    assert not pids & {worker, os.getpid()}


def test_there_are_as_many_processes_as_the_cluster_takes(there: OnCluster) -> None:
    assert there.size(None) == 2
    assert there.size(7) == 7


def test_nothing_to_do_needs_no_cluster() -> None:
    nowhere = OnCluster(Cluster("tcp://127.0.0.1:1"))
    assert answers(nowhere, abs, []) == []


def test_an_error_is_raised_here(there: OnCluster) -> None:
    with pytest.raises(ValueError, match="math domain"):
        answers(there, math.sqrt, [4.0, -1.0, 9.0])
    assert answers(there, abs, [-2]) == [2]


def test_a_process_that_dies_is_told_of(there: OnCluster) -> None:
    with pytest.raises(SumoError, match="ended with code 3"):
        answers(there, os._exit, [3])


def kill_parent(_: int) -> None:
    os.kill(os.getppid(), signal.SIGKILL)
    time.sleep(60)


def kill_parent_once(mark: Path) -> str:
    if mark.exists():
        return "done"
    mark.write_text("x", encoding="utf-8")
    return str(kill_parent(0))


@pytest.fixture
def started() -> Iterator[OnCluster]:
    """A cluster of the test's own, whose workers may be killed."""
    backend = OnCluster(Cluster())
    yield backend
    backend.close()


def test_a_killed_worker_is_replaced(started: OnCluster, tmp_path: Path) -> None:
    assert answers(started, kill_parent_once, [tmp_path / "mark"]) == ["done"]


def test_a_task_that_kills_every_worker_is_given_up(started: OnCluster) -> None:
    with pytest.raises(LostError, match=r"--backend dask: .* killed, one after another.*kept"):
        answers(started, kill_parent, [0])


def test_stopping_early_ends_what_is_under_way(there: OnCluster) -> None:
    begun = there.answers(noted_sleep, [0.0, 300.0, 300.0, 300.0], workers=2, files={})
    assert next(begun) == (0, 0.0)
    client = there._connected(1)
    assert client.run_on_scheduler(tasks_known) >= 3
    begun.close()  # type: ignore[attr-defined]
    until(lambda: not client.run_on_scheduler(tasks_known))
    until(lambda: not any(client.run(tasks_held).values()))


def noted_sleep(seconds: float) -> float:
    time.sleep(seconds)
    return seconds


def tasks_known(dask_scheduler: Any) -> int:
    return len(dask_scheduler.tasks)


def tasks_held(dask_worker: Any) -> int:
    return len(dask_worker.state.tasks)


@pytest.mark.parametrize(
    ("content", "told"), [(b"another", "is another file there"), (None, "No such file")]
)
def test_other_files_are_refused(
    there: OnCluster, tmp_path: Path, content: bytes | None, told: str
) -> None:
    net = tmp_path / "some.net.xml"
    if content is not None:
        net.write_bytes(content)
    files = {net: hashlib.sha256(b"mine").hexdigest()}
    with pytest.raises(InputError, match=rf"Dask worker tcp.*{told}.*the same file") as raised:
        answers(there, abs, [-1], files)
    assert str(net) in str(raised.value)
    net.write_bytes(b"mine")
    assert answers(there, abs, [-1], files) == [1]


def test_another_program_is_refused(there: OnCluster, monkeypatch: pytest.MonkeyPatch) -> None:
    mine = on_cluster._identity()
    for changed, told in (
        (("eclipse-sumo 0.1", *mine[1:]), "has eclipse-sumo 1.* install eclipse-sumo 0.1 there"),
        ((mine[0], "digest", *mine[2:]), "has another version of planner; install the same there"),
    ):
        monkeypatch.setattr(on_cluster, "_identity", lambda changed=changed: changed)
        with pytest.raises(InputError, match=told):
            answers(there, abs, [-1])


def test_processes_end_some_time_after_the_last_task(there: OnCluster) -> None:
    there._connected(1).run(rest_shortly)
    (pid,) = answers(there, operator.methodcaller("__call__"), [os.getpid])
    until(lambda: not Path(f"/proc/{pid}").exists())
    assert answers(there, abs, [-3]) == [3]


def rest_shortly() -> None:
    on_cluster.REST_S = 0.2


def test_the_command_writes_the_same_files(address: str, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "planner", "futures", "figure1", "-s", "3"]
    there = ("--backend", "dask", "--address", address)
    files = []
    for name, more in (("here", ()), ("there", there)):
        environment = {**os.environ, "PLANNER_CACHE": str(tmp_path / f"cache of {name}")}
        words = [*command, *more, "-o", str(tmp_path / name)]
        done = subprocess.run(words, capture_output=True, text=True, env=environment)
        assert (done.returncode, done.stderr) == (0, "")
        files.append({path.name: path.read_bytes() for path in (tmp_path / name).iterdir()})
    assert files[0] == files[1]
    assert len(files[0]) == 3


def test_ctrl_c_ends_the_command_and_its_tasks(address: str, tmp_path: Path) -> None:
    sizes = ("--set", "search.particles=4000", "--set", 'target.driving="free"')
    words = ["futures", "berlin", "-v", *sizes, "--backend", "dask", "--address", address]
    environment = {**os.environ, "PLANNER_CACHE": str(tmp_path)}
    with subprocess.Popen(
        [sys.executable, "-m", "planner", *words],
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if "particles are driven" in line:
                break
        with distributed.Client(address, set_as_default=False) as client:
            until(lambda: client.run_on_scheduler(tasks_known) > 0)
            process.send_signal(signal.SIGINT)
            _, told = process.communicate(timeout=60)
            until(lambda: not client.run_on_scheduler(tasks_known))
            until(lambda: not any(client.run(tasks_held).values()))
    assert process.returncode == 130
    assert told.splitlines()[-1] == "planner: stopped; nothing is half-written"
    assert "Traceback" not in told


def until(true: Callable[[], bool]) -> None:
    patient_until = time.monotonic() + 30
    while not true():
        assert time.monotonic() < patient_until
        time.sleep(0.05)
