"""Ctrl-C while a search is under way."""

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LONG = ("plan", "grid5x5", "--set", "search.work=2000000000", "--set", "search.particles=64")
QUICK = ("--set", "search.sampling=iid", "--targets", "50", "-v")


def heard() -> None:
    """Hear Ctrl-C, also where the tests themselves run in the background and do not."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextmanager
def searching(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """A search that would take hours, once it has found its first plan."""
    command = [sys.executable, "-m", "planner", *LONG, *QUICK, "-o", str(folder)]
    running = subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heard,
    )
    assert running.stderr is not None
    try:
        for line in running.stderr:
            if "best so far" in line:
                break
        yield running
    finally:
        running.kill()


def test_the_first_ctrl_c_takes_the_best_plan_so_far(tmp_path: Path) -> None:
    with searching(tmp_path / "run") as running:
        running.send_signal(signal.SIGINT)
        _, told = running.communicate(timeout=120)
        assert running.returncode == 0, told
    assert "best plan so far" in told
    record = json.loads((tmp_path / "run" / "run.json").read_text())["planning"]
    assert record["stopped_early"] is True
    assert 0 <= record["work_done"] < record["work"]
    plan = json.loads((tmp_path / "run" / "plan.json").read_text())
    assert plan["uavs"][0]["legs"]


def test_the_second_ctrl_c_ends_at_once(tmp_path: Path) -> None:
    with searching(tmp_path / "run") as running:
        running.send_signal(signal.SIGINT)
        assert running.stderr is not None
        for line in running.stderr:
            if "Ctrl-C again" in line:
                break
        running.send_signal(signal.SIGINT)
        _, told = running.communicate(timeout=120)
        assert running.returncode == 128 + signal.SIGINT, told
    assert "nothing is half-written" in told
    assert not (tmp_path / "run").exists()
