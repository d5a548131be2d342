"""The example scripts and the README's Python run as they stand."""

import csv
import re
import runpy
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def run(monkeypatch: pytest.MonkeyPatch, script: str, *arguments: str) -> None:
    monkeypatch.setattr(sys, "argv", [script, *arguments])
    runpy.run_path(str(ROOT / "tools" / script), run_name="__main__")


def test_plan(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "waypoints.csv"
    run(monkeypatch, "example_plan.py", "figure3", str(output))
    said = capsys.readouterr().out
    assert "found 100%" in said
    with output.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert f"{len(rows)} waypoints" in said
    assert (rows[0]["time_s"], rows[0]["x_m"], rows[0]["y_m"]) == ("0.00", "-30000.00", "0.00")
    times_s = [float(row["time_s"]) for row in rows]
    assert times_s == sorted(times_s)


def test_compare_starts(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run(monkeypatch, "example_compare_starts.py", "figure3", "0", "200")
    near, far = (float(line.split()[1].replace(",", "")) for line in lines_of(capsys))
    assert near < 1000 < far


def lines_of(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return capsys.readouterr().out.splitlines()[1:]


def test_the_readme_s_python(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    lighter = code.replace('"grid5x5"', '"figure3"').replace("1000", "100")
    assert lighter != code
    lighter = re.sub(r", overrides=\[.*?\]", "", lighter)
    exec(compile(lighter, "README.md", "exec"), {})
    assert re.fullmatch(r"\d+ s, \d+\.\d% found\n", capsys.readouterr().out)
