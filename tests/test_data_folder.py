"""Where larger test data is looked for."""

from pathlib import Path

import pytest

from support.data import BESIDE, data_file, data_folder


def test_the_variable_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.net.xml").touch()
    monkeypatch.setenv("PLANNER_DATA", str(tmp_path))
    assert data_folder() == tmp_path
    assert data_file("a.net.xml") == tmp_path / "a.net.xml"
    with pytest.raises(pytest.skip.Exception, match="set PLANNER_DATA"):
        data_file("b.net.xml")
    monkeypatch.setenv("PLANNER_DATA", str(tmp_path / "none"))
    assert data_folder() is None


def test_without_it_the_data_lies_beside_the_checkout(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PLANNER_DATA", raising=False)
    assert data_folder() == (BESIDE if BESIDE.is_dir() else None)
