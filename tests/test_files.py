"""A run's files arrive together: its record last, and not over what another command wrote."""

from pathlib import Path

import pytest

from planner.errors import OutputError
from planner.files import RECORD, results_written_whole

NAMES = ("a.csv", RECORD, "z.csv")


def write(folder: Path, text: str, *, force: bool = False) -> None:
    with results_written_whole(folder, NAMES, force=force) as new:
        for name in NAMES:
            (new / name).write_text(text, encoding="utf-8")


def texts(folder: Path) -> dict[str, str]:
    return {file.name: file.read_text(encoding="utf-8") for file in folder.iterdir()}


@pytest.mark.parametrize("before", [False, True])
def test_the_record_goes_first_and_comes_last(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, before: bool
) -> None:
    """Whichever move fails, no record stands beside files that it does not tell of."""
    move = Path.replace
    for fails in range(len(NAMES)):
        folder, moved = tmp_path / str(fails), []
        if before:
            write(folder, "old")

        def replace(file: Path, to: Path, fails: int = fails, moved: list[Path] = moved) -> Path:
            if len(moved) == fails:
                raise OSError(5, "Input/output error")
            moved.append(to)
            return move(file, to)

        with monkeypatch.context() as patched:
            patched.setattr(Path, "replace", replace)
            with pytest.raises(OutputError, match="cannot be written"):
                write(folder, "new", force=True)
        assert RECORD not in (texts(folder) if folder.exists() else {})
        write(folder, "new", force=True)
        assert texts(folder) == dict.fromkeys(NAMES, "new")


def test_what_another_command_wrote_meanwhile_is_not_replaced(tmp_path: Path) -> None:
    folder = tmp_path / "run"

    def late() -> None:
        with results_written_whole(folder, NAMES, force=False) as new:
            (new / NAMES[0]).write_text("late", encoding="utf-8")
            write(folder, "sooner")

    with pytest.raises(OutputError, match=f"another command has written {NAMES[0]} there"):
        late()
    assert texts(folder) == dict.fromkeys(NAMES, "sooner")


def test_files_that_are_not_written_again_go_with_the_run(tmp_path: Path) -> None:
    write(tmp_path, "old")
    (tmp_path / "mine.txt").write_text("stays", encoding="utf-8")
    with results_written_whole(tmp_path, NAMES, force=True) as new:
        (new / RECORD).write_text("new", encoding="utf-8")
    assert texts(tmp_path) == {RECORD: "new", "mine.txt": "stays"}
