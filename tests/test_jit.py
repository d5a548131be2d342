"""Compiled code is kept where it can be written, and the first run says what it waits for."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import planner

# A caller may have imported numba first.
COMPILE = """import numba
from planner.search.kernels.bearings import bearing
print(bearing(1.0, -2.0))"""


def run(cache: Path, temporary: Path) -> subprocess.CompletedProcess[str]:
    temporary.mkdir(exist_ok=True)
    settings = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    settings |= {"PLANNER_CACHE": str(cache), "TMPDIR": str(temporary)}
    command = [sys.executable, "-c", COMPILE]
    done = subprocess.run(command, env=settings, capture_output=True, text=True, check=True)
    assert done.stdout.split() == [str(-2.0 / 3.0)]
    return done


def test_only_the_first_run_compiles_and_says_so(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    first, second = run(cache, tmp_path / "t"), run(cache, tmp_path / "t")
    assert first.stderr.count("compiling") == 1
    assert str(cache) in first.stderr
    assert second.stderr == ""
    assert list((tmp_path / "t").iterdir()) == []


def test_a_cache_that_cannot_be_written_is_replaced_by_a_folder_of_the_users_own(
    tmp_path: Path,
) -> None:
    (tmp_path / "file").touch()
    cache, temporary = tmp_path / "file" / "cache", tmp_path / "t"
    assert str(temporary) in run(cache, temporary).stderr
    assert run(cache, temporary).stderr == ""
    (folder,) = temporary.iterdir()
    folder.chmod(0o777)  # others could have put code there
    assert str(folder) + ")" not in run(cache, temporary).stderr
    assert len(list(temporary.iterdir())) == 2


def test_a_change_of_any_compiled_source_takes_another_folder(tmp_path: Path) -> None:
    package = Path(planner.__file__).parent
    copy = tmp_path / "planner"
    shutil.copytree(package, copy, ignore=shutil.ignore_patterns("__pycache__", "sumo_nets"))
    kept_in = {compiled_folder(tmp_path)}
    rooms = sorted(copy.rglob("kernels"))
    stages = ["belief", "bounds", "detection", "futures", "search"]
    assert [room.parent.name for room in rooms] == stages
    for number, room in enumerate(rooms, start=2):
        source = max(room.glob("*.py"))
        with source.open("a", encoding="utf-8") as file:
            file.write("# changed\n")
        kept_in.add(compiled_folder(tmp_path))
        assert len(kept_in) == number


def compiled_folder(above: Path) -> str:
    """Where the package below a folder would keep its compiled code."""
    settings = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    asked = "import os, planner.jit as jit; print(os.path.basename(jit._kept_in()), jit.__file__)"
    command = [sys.executable, "-c", asked]
    settings |= {"PLANNER_CACHE": str(above / "cache")}
    done = subprocess.run(
        command, cwd=above, env=settings, capture_output=True, text=True, check=True
    )
    folder, file = done.stdout.split()
    assert Path(file).is_relative_to(above)
    return folder
