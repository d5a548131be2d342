"""Compiled code reads and writes within its arrays: its tests once more, with indices checked."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# Thinning, detection, what-if flights, and all planners on small problems.
OF_COMPILED_CODE = (
    "tests/detection",
    "tests/futures/test_thinning.py",
    "tests/search/test_what_if.py",
    "tests/search/test_contract.py",
)
# What only compares methods with each other takes long and reaches nothing more.
OPTIONS = ("-q", "-x", "-p", "no:cacheprovider", "-k", "not never_worse")


@pytest.mark.slow
def test_compiled_code_stays_within_its_arrays(tmp_path: Path) -> None:
    checked = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    # What the test run itself is made of, such as its number of processes, is not for this one.
    ours = {name: said for name, said in os.environ.items() if not name.startswith("PYTEST")}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *OPTIONS, *OF_COMPILED_CODE],
        cwd=ROOT,
        env={**ours, **checked},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]
    assert list(tmp_path.rglob("*.nbi"))  # compiled anew, not taken from another cache
