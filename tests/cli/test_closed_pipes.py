"""A reader that has gone is no fault; an output that takes nothing is told in one line."""

import subprocess
import sys
from pathlib import Path

import pytest

WAIT = ("plan", "figure3", "--method", "wait", "--targets", "20")
FULL = Path("/dev/full")


@pytest.mark.parametrize(
    "words", [("--help",), ("plan", "--help"), ("--version",), WAIT, (*WAIT, "--json")]
)
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_nothing_is_said_to_a_closed_pipe(words: tuple[str, ...], unbuffered: str) -> None:
    script = f'{{ sleep 0.3; PYTHONUNBUFFERED={unbuffered} "$@"; echo $? >&2; }} | true'
    command = ["sh", "-c", script, "sh"]
    done = subprocess.run(
        [*command, sys.executable, "-m", "planner", *words],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr.splitlines()[-1] == "141"
    assert "Traceback" not in done.stderr
    assert "BrokenPipe" not in done.stderr


@pytest.mark.skipif(not FULL.exists(), reason="the system has no /dev/full")
@pytest.mark.parametrize("words", [("--help",), ("--version",), (*WAIT, "--json")])
def test_a_full_disk_is_told_in_one_line(words: tuple[str, ...]) -> None:
    with FULL.open("w", encoding="utf-8") as full:
        done = subprocess.run(
            [sys.executable, "-m", "planner", *words],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.returncode == 2
    assert done.stderr == "planner: standard output: No space left on device\n"
