"""A scenario that is shown is the same scenario when it is read again."""

import shutil
from pathlib import Path

import pytest

from planner.files import shipped
from planner.scenario.draft import read_draft
from planner.scenario.toml_text import scenario_text


@pytest.mark.parametrize(
    "overrides", [(), ("futures.tolerance_m=2.5",), ("traffic.vehicles_per_hour=30.0",)]
)
@pytest.mark.parametrize("name", ["figure3", "grid5x5"])
def test_a_shown_scenario_reads_back(name: str, overrides: tuple[str, ...], tmp_path: Path) -> None:
    folder = shipped(name)
    assert folder is not None
    source = folder if folder.is_dir() else folder.parent
    shutil.copytree(source, tmp_path / name)
    (path,) = (tmp_path / name).glob("scenario.toml")
    scenario = read_draft(path, overrides=overrides).scenario()
    text = scenario_text(scenario)
    assert all(one.partition("=")[2] in text for one in overrides)
    assert "horizon_s = " in text
    assert "#" in text
    path.write_text(text, encoding="utf-8")
    assert read_draft(path).scenario().as_dict() == scenario.as_dict()


def test_words_that_a_key_may_hold_stand_beside_it() -> None:
    lines = scenario_text(read_draft("figure3").scenario()).split("\n")
    assert 'driving = "constant"  # "constant", "free" or "traffic"' in lines
    (greedy,) = (line for line in lines if line.startswith("miss = "))
    assert greedy.endswith('# "horizon", "infinity" or "rate"')
    keys = [line for line in lines if " = " in line and not line.startswith("title")]
    assert all("  # " in line for line in keys)
