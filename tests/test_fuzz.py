"""The fuzzer: a short run of it, and that it sees what is wrong."""

import random
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

TOOLS = Path(__file__).parents[1] / "tools"


@pytest.mark.parametrize("count", [90, pytest.param(300, marks=pytest.mark.long)])
def test_changed_files_are_read_or_refused(count: int, tmp_path: Path) -> None:
    command = [sys.executable, str(TOOLS / "fuzz.py"), str(count), "--keep", str(tmp_path / "kept")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{count} cases in " in done.stdout
    assert not (tmp_path / "kept").exists()


@pytest.fixture
def children(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(TOOLS)
    return import_module("fuzzing.children")


def test_a_judge_sees_what_is_wrong(children: Any) -> None:
    def faults(
        code: int, out: str = "{}", err: str = "", after: str = "", **more: Any
    ) -> list[str]:
        usual = {"cpu_s": 0.1, "memory_mb": 100.0, "hangs": False}
        ended = children.Ended(code, out, err, **(usual | more))
        files = {after: ""} if after else {}
        return list(children.faults_of(ended, "planner: ", {}, files))

    line = "planner: x.toml: is wrong; correct it\n"
    assert faults(0) == faults(2, err=line) == faults(0, after="new.json") == []
    assert faults(2) == ["silent refusal"]
    assert faults(2, err=line, after="new.json") == ["files changed on refusal"]
    assert faults(0, after="a/.half") == ["half-written file"]
    assert faults(0, out="NaN") == faults(0, out="") == ["no finite JSON"]
    assert faults(0, err="x.py: RuntimeWarning\n") == ["stray line: x.py: RuntimeWarning"]
    assert faults(2, err="planner: \x1b[31m\n") == ["control characters"]
    assert faults(2, err="planner: " + "a" * 2000) == ["line too long"]
    assert faults(-11) == ["crash 11"]
    assert faults(3, err=line) == ["exit code 3"]
    assert faults(-24, hangs=True) == ["hangs"]
    assert faults(0, memory_mb=4000.0) == ["more than 1500 MB"]
    told = (
        'Traceback (most recent call last):\n  File "/a/planner/b.py", line 3, in c\nKeyError: 1\n'
    )
    assert faults(70, err=told) == ["traceback KeyError in planner/b.py:c"]


def test_the_same_seed_gives_the_same_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(TOOLS)
    changed = import_module("fuzzing.mutations").changed
    content = b'[a]\nb = 1.5\nc = "text"\n' * 5
    for name in ("a.toml", "a.xml", "a.json", "a.csv", "a.parquet"):
        one, other = (
            [changed(random.Random(i), name, content) for i in range(200)] for _ in range(2)
        )
        assert one == other
        assert len(set(one)) > 150
