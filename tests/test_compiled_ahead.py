"""`planner doctor --compile` leaves nothing to compile to any command."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from planner.search.methods import METHODS
from support.command_line import TOWN, in_a_process

FEW = ("--set", "search.particles=16", "--set", "search.sampling=iid")
LIGHT = ("--set", "search.work=300", "--targets", "20")
RUN = "runs/first"
COMMANDS = (
    *(("plan", "figure3", *FEW, *LIGHT, "--method", method.name) for method in METHODS),
    *(("plan", TOWN, *FEW, *LIGHT, "--method", method.name) for method in METHODS),
    ("plan", TOWN, *FEW, *LIGHT, "--free"),
    ("plan", TOWN, *FEW, *LIGHT, "--method", "greedy", "--tick", "5"),
    ("plan", TOWN, *FEW, *LIGHT, "--objective", "probability", "--by", "300"),
    ("plan", TOWN, *FEW, *LIGHT, "--set", "target.driving=free", "--gap", "0.5", "-o", RUN),
    ("fly", RUN, "--targets", "20"),
    ("certify", RUN, "--work", "3", "--force"),
    ("futures", TOWN, *FEW, "--set", "target.driving=free", "-o", "runs/futures"),
    ("where", TOWN, *FEW, "--set", "target.driving=free", "--at", "60", "-o", "runs/where"),
    ("plan", TOWN, *LIGHT, "--futures", "runs/futures/futures.parquet"),
    ("compare", "figure3", *FEW, *LIGHT, "--bound", "--time-limit", "1"),
)
# One process for all of them: what a command compiles, a later one finds.
ALL = f"""
from planner.cli import main
for words in {COMMANDS!r}:
    code = main([*words, "--json"])
    assert code in (0, 2), words  # 2: a method that does not apply
"""
# What is called is compiled, in this process or in one before; what it calls is compiled with it.
CALLED_AHEAD = f"""
import gc, json, sys
from contextlib import redirect_stdout
from numba.core.registry import CPUDispatcher
from planner.futures import workers
from planner.mission.warm_up import compile_all

def called():
    kernels = [thing for thing in gc.get_objects() if isinstance(thing, CPUDispatcher)]
    return {{f"{{one.__name__}} {{types}}" for one in kernels for types in one.signatures}}

workers.in_processes = lambda function, tasks, **_: map(function, tasks)
compile_all()
ahead = called()
with redirect_stdout(sys.stderr):
    exec({ALL!r})
print(json.dumps([len(ahead), sorted(called() - ahead)]))
"""


def compiled(folder: Path) -> set[str]:
    """What is compiled, by the names of functions and of the types that they are called with."""
    return {str(file.relative_to(folder)) for file in folder.rglob("*.nbc")}


def python(code: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | environment | {"PYTHONPATH": str(Path(__file__).parents[1])},
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done


@pytest.mark.slow
def test_doctor_compile_calls_all_that_commands_call(tmp_path: Path) -> None:
    done = python(CALLED_AHEAD, tmp_path, PLANNER_CACHE=str(tmp_path / "cache"))
    ahead, more = json.loads(done.stdout)
    assert ahead > 20
    assert more == []


@pytest.mark.long
def test_nothing_is_compiled_after_doctor_compile(tmp_path: Path) -> None:
    kept = tmp_path / "compiled"
    environment = {"NUMBA_CACHE_DIR": str(kept)}
    said = in_a_process("doctor", "--compile", timeout_s=900, **environment)
    assert said.code == 0, said.err
    assert "compiling" in said.err
    before = compiled(kept)
    assert len(before) > 20
    done = python(ALL, tmp_path, **environment)
    assert compiled(kept) - before == set()
    assert "compiling" not in done.stderr
