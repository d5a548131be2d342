"""Compiled code reads and writes within its arrays: its tests once more, with indices checked."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# Thinning, detection and what-if flights, which all planners stand on; and the planners.
ENGINE = ("tests/detection", "tests/futures/test_thinning.py", "tests/search/test_what_if.py")
PLANNERS = ("tests/search/test_contract.py",)
# What compares methods with each other, or plans the same once more, reaches nothing more.
AGAIN = ("never_worse", "same_stream", "is_unchanged", "starts_at_take_off", "beats_exact")
CHOSEN = " and ".join(f"not {name}" for name in AGAIN)
OPTIONS = ("-q", "-x", "-p", "no:cacheprovider", "-k", CHOSEN)


@pytest.mark.parametrize(
    "tests",
    [
        pytest.param(ENGINE, id="engine", marks=pytest.mark.slow),
        pytest.param(PLANNERS, id="planners", marks=pytest.mark.long),
    ],
)
def test_compiled_code_stays_within_its_arrays(tests: tuple[str, ...], tmp_path: Path) -> None:
    checked = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    # What the test run itself is made of, such as its number of processes, is not for this one.
    ours = {name: said for name, said in os.environ.items() if not name.startswith("PYTEST")}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *OPTIONS, *tests],
        cwd=ROOT,
        env={**ours, **checked},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]
    assert list(tmp_path.rglob("*.nbi"))  # compiled anew, not taken from another cache
