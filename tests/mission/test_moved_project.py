"""A run finds its scenario where it lay, seen from the run, and says so if it is gone."""

import json
import shutil
from pathlib import Path

import pytest

from planner.cli import main
from planner.files import shipped
from planner.mission.run_folder import open_run


def test_a_moved_project_works(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = shipped("figure3")
    assert source is not None
    old, new = tmp_path / "old", tmp_path / "new"
    shutil.copytree(source, old)
    run = old / "runs" / "1"
    assert main(["plan", str(old), "--method", "wait", "--targets", "20", "-o", str(run)]) == 0
    record = json.loads((run / "run.json").read_text(encoding="utf-8"))
    assert record["scenario_path"] == str(old / "scenario.toml")
    assert record["scenario_path_from_run"] == "../../scenario.toml"
    old.rename(new)
    assert open_run(new / "runs" / "1")[0].scenario.path == new / "scenario.toml"
    assert main(["fly", str(new / "runs" / "1"), "--targets", "20"]) == 0
    alone = (new / "runs" / "1").rename(tmp_path / "alone")
    capsys.readouterr()
    assert main(["fly", str(alone), "--targets", "20", "--force"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert f"no file {old / 'scenario.toml'} any more" in said
