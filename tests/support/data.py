"""Larger data for tests and benchmarks, such as nets of towns, which do not come with the code."""

import os
from pathlib import Path

import pytest

BESIDE = Path(__file__).resolve().parents[3] / "shared" / "data"


def data_folder() -> Path | None:
    """Return the folder of the data: ``$PLANNER_DATA``, or one beside the checkout, if any."""
    chosen = os.environ.get("PLANNER_DATA")
    folder = Path(chosen).expanduser() if chosen else BESIDE
    return folder if folder.is_dir() else None


def data_file(name: str) -> Path:
    """Return a file of the data, or skip the test that asks for it."""
    folder = data_folder()
    if folder is None or not (folder / name).is_file():
        pytest.skip(f"needs {name}: set PLANNER_DATA to the folder that holds it")
    return folder / name
