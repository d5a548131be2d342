"""The report on the paper's experiments: whole, and the same bytes for the same results."""

import csv
from pathlib import Path

import pytest

from planner.paper.figures import U0
from planner.paper.report import CAPTIONS, PAGE, claims_of, drawn, write_curves, write_report
from planner.report.estimates import EXPECTED
from support.experiment_results import exhaustive_until, figure8, figure9


def found() -> dict[str, object]:
    return {"figure8": figure8(exhaustive_until(120)), "figure9": figure9(10.0)}


def test_page_and_figures(tmp_path: Path) -> None:
    page = write_report(tmp_path, found(), claims_of(found()), quick=True)  # type: ignore[arg-type]
    text = page.read_text()
    assert page.name == PAGE
    assert "This is a quick run" in text
    for stem in ("figure8", "figure8-20mps", "figure8-all", "figure9"):
        assert f"({stem}.png)" in text
        assert CAPTIONS[stem] in text
        assert (tmp_path / f"{stem}.png").read_bytes().startswith(b"\x89PNG")
        assert "</svg>" in (tmp_path / f"{stem}.svg").read_text()


def test_the_same_results_give_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        write_report(tmp_path / name, found(), claims_of(found()), quick=False)  # type: ignore[arg-type]
    files = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert len(files) == 10
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()


def test_the_curves_numbers_are_those_of_the_rows(tmp_path: Path) -> None:
    results = figure8(exhaustive_until(120))
    write_curves(tmp_path / "curves.csv", {"figure8": results})
    with (tmp_path / "curves.csv").open() as file:
        lines = list(csv.DictReader(file))
    keys = {(line["targets"], line["block"], line["method"], float(line[U0])) for line in lines}
    assert len(keys) == len(lines)
    assert keys == {(r["targets"], r["block"], r["method"], r[U0]) for r in results.rows}
    for line in lines[:: max(1, len(lines) // 20)]:
        drawn_from = [
            row[EXPECTED]
            for row in results.rows
            if (row["targets"], row["block"], row["method"])
            == tuple(line[key] for key in ("targets", "block", "method"))
            and row[U0] == float(line[U0])
        ]
        assert float(line["mean_s"]) == pytest.approx(sum(drawn_from) / len(drawn_from), abs=0.051)
        assert float(line["low_s"]) <= float(line["mean_s"]) <= float(line["high_s"])


def test_only_what_is_there_is_drawn(tmp_path: Path) -> None:
    assert drawn(tmp_path, {}) == []
