"""Ctrl-C while a search is under way."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from planner.cli import main
from planner.mission.certificate_file import PROOF
from planner.mission.run_folder import FLIGHTS, RUN

VERIFY = Path(__file__).parents[1] / "tools" / "verify.py"
FAR = ("--set", "uav.start.distance_m=180000")  # from where no bound is soon as good as it gets
LONG = ("plan", "grid5x5", *FAR, "--set", "search.work=2000000000", "--set", "search.particles=64")
QUICK = ("--set", "search.sampling=iid", "--targets", "50", "-v")
ENDLESS = ("--gap", "0", "--time-limit", "7200")  # no bound comes as near as that


def heard() -> None:
    """Hear Ctrl-C, also where the tests themselves run in the background and do not."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextmanager
def searching(
    folder: Path, *more: str, until: str = "best so far"
) -> Iterator[subprocess.Popen[str]]:
    """A search that would take hours, once it says that it has found something."""
    with running(*LONG, *QUICK, *more, "-o", str(folder), until=until) as search:
        yield search


@contextmanager
def running(*arguments: str, until: str) -> Iterator[subprocess.Popen[str]]:
    """A command that has said a certain thing."""
    command = [sys.executable, "-m", "planner", *arguments]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, preexec_fn=heard)
    assert process.stderr is not None
    try:
        for line in process.stderr:
            if until in line:
                break
        yield process
    finally:
        process.kill()


def interrupt_twice(search: subprocess.Popen[str]) -> None:
    """Press Ctrl-C again when the first one has been heard."""
    search.send_signal(signal.SIGINT)
    assert search.stderr is not None
    for line in search.stderr:
        if "Ctrl-C again" in line:
            break
    search.send_signal(signal.SIGINT)


def test_the_first_ctrl_c_takes_the_best_plan_so_far(tmp_path: Path) -> None:
    with searching(tmp_path / "run") as search:
        search.send_signal(signal.SIGINT)
        _, told = search.communicate(timeout=120)
        assert search.returncode == 0, told
    assert "best plan so far" in told
    record = json.loads((tmp_path / "run" / "run.json").read_text())["planning"]
    assert record["stopped_early"] is True
    assert 0 <= record["work_done"] < record["work"]
    plan = json.loads((tmp_path / "run" / "plan.json").read_text())
    assert plan["uavs"][0]["legs"]


def test_the_second_ctrl_c_ends_at_once(tmp_path: Path) -> None:
    with searching(tmp_path / "run") as search:
        interrupt_twice(search)
        _, told = search.communicate(timeout=120)
        assert search.returncode == 128 + signal.SIGINT, told
    assert "nothing is half-written" in told
    assert not (tmp_path / "run").exists()


def certificate_in(folder: Path) -> dict[str, Any]:
    """The certificate of a run, which another program has found to hold."""
    command = [sys.executable, str(VERIFY), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert {path.name for path in folder.iterdir()} >= {*RUN, *PROOF} - {FLIGHTS}
    certificate: dict[str, Any] = json.loads((folder / "plan.json").read_text())["certificate"]
    return certificate


@pytest.fixture(scope="module")
def grid_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("planned") / "run"
    assert main([*LONG, *QUICK[:-1], "--method", "rate", "-o", str(folder)]) == 0
    return folder


def test_ctrl_c_takes_the_best_bound_so_far(grid_run: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(grid_run, tmp_path / "run"))
    endless = ("--work", "1000000000", "-v")
    with running("certify", str(folder), *endless, until="certifying:") as search:
        time.sleep(3.0)  # for more than the first bound
        search.send_signal(signal.SIGINT)
        _, told = search.communicate(timeout=120)
        assert search.returncode == 0, told
    value = json.loads((folder / "plan.json").read_text())["planned"]["expected_detection_time_s"]
    assert 0.0 < certificate_in(folder)["lower_bound_s"] < value


def test_the_second_ctrl_c_leaves_the_run_as_it_was(grid_run: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(grid_run, tmp_path / "run"))
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with running("certify", str(folder), "--sets", "1000000", "-v", until="certifying:") as search:
        interrupt_twice(search)
        _, told = search.communicate(timeout=120)
        assert search.returncode == 128 + signal.SIGINT, told
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize(("method", "until"), [("rate", "certifying:"), ("best", "best so far")])
def test_ctrl_c_keeps_the_best_of_both(method: str, until: str, tmp_path: Path) -> None:
    """While the bound is sought, and while the plan is, when the first bound has to do."""
    folder = tmp_path / "run"
    with searching(folder, *ENDLESS, "--method", method, until=until) as search:
        search.send_signal(signal.SIGINT)
        _, told = search.communicate(timeout=240)
        assert search.returncode == 0, told
    assert certificate_in(folder)["gap"] > 0.0
    assert json.loads((folder / "run.json").read_text())["planning"]["stopped_early"] is (
        method == "best"
    )


def test_a_second_ctrl_c_writes_neither(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with searching(folder, *ENDLESS, "--method", "rate", until="certifying:") as search:
        interrupt_twice(search)
        _, told = search.communicate(timeout=120)
        assert search.returncode == 128 + signal.SIGINT, told
    assert not folder.exists()


IMPORTING = """
import _imp, sys, time
from planner import locks
from planner.interrupts import stopped_by_signals
with stopped_by_signals(), locks.temporary_folder() as folder:
    _imp.acquire_lock()  # as every import does for a moment
    print(folder, flush=True)
    time.sleep(60)
"""


def test_ctrl_c_in_the_midst_of_an_import() -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", IMPORTING],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heard,
    )
    assert process.stdout is not None
    folder = Path(process.stdout.readline().strip())
    assert folder.is_dir()
    begun = time.monotonic()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert time.monotonic() - begun < 3
    assert (process.returncode, err) == (130, "planner: stopped; nothing is half-written\n")
    assert not folder.exists()


STARTING = """
import sys, time
from planner.__main__ import main
class Slow:
    def find_spec(self, name, *_):
        if name == "planner.cli":
            print(*sorted(sys.modules), flush=True)
            time.sleep(60)
sys.meta_path.insert(0, Slow())
main()
"""


def test_ctrl_c_before_the_command_line_is_loaded() -> None:
    process = subprocess.Popen(
        [sys.executable, "-S", "-c", STARTING],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heard,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])},
    )
    assert process.stdout is not None
    loaded = process.stdout.readline().split()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert (process.returncode, err) == (130, "")
    # What is not part of Python's own start would be loaded while nobody hears Ctrl-C.
    assert not {"logging", "argparse", "re", "pathlib", "lazy_loader"} & set(loaded)
