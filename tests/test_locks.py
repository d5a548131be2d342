"""Temporary files whose owner has ended are removed, and no others; one command has a folder."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from planner.errors import OutputError
from planner.files import alone_at, alone_in, written_whole
from planner.locks import sweep, temporary_file, temporary_folder

DIES = """
import os, sys
from pathlib import Path
from planner.locks import temporary_file, temporary_folder
place = Path(sys.argv[1])
with temporary_folder(place) as folder, temporary_file(place, ".csv") as file:
    (folder / "half.txt").write_text("half")
    os._exit(9)
"""


def test_what_a_dead_process_left_is_swept(tmp_path: Path) -> None:
    assert subprocess.run([sys.executable, "-c", DIES, str(tmp_path)], check=False).returncode == 9
    assert len(list(tmp_path.iterdir())) == 2
    (tmp_path / ".mine").write_text("stays", encoding="utf-8")
    with temporary_folder(tmp_path) as folder, temporary_file(tmp_path, ".csv") as file:
        sweep(tmp_path)
        assert {*tmp_path.iterdir()} == {folder, file, tmp_path / ".mine"}
    assert {*tmp_path.iterdir()} == {tmp_path / ".mine"}


def test_the_next_file_written_there_sweeps(tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-c", DIES, str(tmp_path)], check=False)
    with written_whole(tmp_path / "a.csv") as new:
        new.write_text("whole", encoding="utf-8")
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]


def test_a_folder_that_is_swept_before_it_is_its_owner_s_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make, made = os.mkdir, []

    def swept_at_once(path: Path, mode: int = 0o777) -> None:
        make(path, mode)
        made.append(path)
        if len(made) == 1:
            sweep(tmp_path)

    monkeypatch.setattr(os, "mkdir", swept_at_once)
    with temporary_folder(tmp_path) as folder:
        assert made == [made[0], folder]
        assert [*tmp_path.iterdir()] == [folder]


def test_a_second_command_is_refused_a_folder(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "run"
    with alone_in(folder):
        with pytest.raises(OutputError, match="another command is writing there"), alone_in(folder):
            pass
        assert folder.is_dir()
        (folder / "plan.json").write_text("{}", encoding="utf-8")
    with alone_in(folder):
        assert (folder / "plan.json").exists()


def test_a_folder_goes_again_if_nothing_comes_of_it(tmp_path: Path) -> None:
    def fails() -> None:
        with alone_in(tmp_path / "new" / "run"):
            raise ValueError("no plan")

    with pytest.raises(ValueError, match="no plan"):
        fails()
    assert not list(tmp_path.iterdir())


def test_a_file_that_came_meanwhile_stays(tmp_path: Path) -> None:
    file = tmp_path / ("n" * 240 + ".csv")  # as long as names may be

    def late() -> None:
        with written_whole(file, replace=False) as new:
            new.write_text("late", encoding="utf-8")
            file.write_text("sooner", encoding="utf-8")

    with pytest.raises(OutputError, match="another command has written it"):
        late()
    assert file.read_text(encoding="utf-8") == "sooner"
    assert [*tmp_path.iterdir()] == [file]


def test_a_second_command_is_refused_a_file(tmp_path: Path) -> None:
    """Also where neither would have to replace one."""
    file = tmp_path / "new" / "table.csv"
    with alone_at(file):
        with pytest.raises(OutputError, match="another command is writing it"), alone_at(file):
            pass
        sweep(file.parent)  # which is no end of the lock
        with pytest.raises(OutputError, match="another command is writing it"), alone_at(file):
            pass
        with alone_at(file.with_name("other.csv")), written_whole(file) as new:
            new.write_text("whole", encoding="utf-8")
    with alone_at(file), alone_in(file.parent):
        pass
    assert [*file.parent.iterdir()] == [file]


DIES_ALONE = """
import os, sys
from pathlib import Path
from planner.files import alone_at
with alone_at(Path(sys.argv[1])):
    os._exit(9)
"""


def test_a_lock_that_a_dead_process_left_is_nobody_s(tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    subprocess.run([sys.executable, "-c", DIES_ALONE, str(file)], check=False)
    assert len([*tmp_path.iterdir()]) == 1
    with alone_at(file):
        pass
    assert not [*tmp_path.iterdir()]
