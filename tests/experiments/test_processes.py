"""Processes that run conditions end with the program, even if that is killed."""

import subprocess
import sys
import time
from pathlib import Path

AT_WORK = """
import os, time
from planner.experiments.processes import in_processes

def run_one(folder):
    open(f"{folder}/{os.getpid()}", "w").close()
    time.sleep(600)

if __name__ == "__main__":
    list(in_processes(run_one, [FOLDER] * 3, 2))
"""


def test_a_killed_parent_takes_its_processes_with_it(tmp_path: Path) -> None:
    notes, script = tmp_path / "notes", tmp_path / "script.py"
    notes.mkdir()
    script.write_text(AT_WORK.replace("FOLDER", repr(str(notes))))
    process = subprocess.Popen(
        [sys.executable, str(script)], stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        until_s = time.monotonic() + 300
        while len(list(notes.iterdir())) < 2 and time.monotonic() < until_s:
            time.sleep(0.01)
        assert len(list(notes.iterdir())) == 2
    finally:
        process.kill()
    # It is read to its end, which comes when the last process that could write to it is gone.
    _, said = process.communicate(timeout=30)
    assert said == ""
