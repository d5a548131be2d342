"""The report on the paper's experiments: whole, and the same bytes for the same results."""

from pathlib import Path

from experiment_results import exhaustive_until, figure8, figure9
from planner.report.paper_report import CAPTIONS, PAGE, drawn, write_report


def found() -> dict[str, object]:
    return {"figure8": figure8(exhaustive_until(120)), "figure9": figure9(10.0)}


def test_page_and_figures(tmp_path: Path) -> None:
    page = write_report(tmp_path, found(), quick=True)  # type: ignore[arg-type]
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
        write_report(tmp_path / name, found(), quick=False)  # type: ignore[arg-type]
    files = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert len(files) == 9
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()


def test_only_what_is_there_is_drawn(tmp_path: Path) -> None:
    assert drawn(tmp_path, {}) == []
