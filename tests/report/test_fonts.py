"""Words in pictures: as they stand, in any script, and whole."""

import logging
import warnings
from pathlib import Path

import pytest

from planner.messages import plain
from planner.report import fonts
from planner.report.figure import _title_lines, new_figure

DRAWN = "fuel at $x^{$ per hour, \\alpha_{10$"


@pytest.mark.parametrize(
    "title", [DRAWN, "a\x1b[31m\nb", "word " * 60, "東京の捜索" * 20], ids=range(4)
)
@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_any_title_can_be_drawn(tmp_path: Path, title: str, suffix: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with new_figure(tmp_path / f"a{suffix}", (7.6, 6.9), title) as figure:
            renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
            for text in figure.texts:
                assert text.get_window_extent(renderer).x1 <= figure.bbox.x1
    shown = "".join(text.get_text() for text in figure.texts)
    assert shown.replace(" ", "") == plain(title).replace(" ", "")


def test_a_short_title_changes_nothing(tmp_path: Path) -> None:
    with new_figure(tmp_path / "a.png", (7.6, 6.9), "a block") as figure:
        assert _title_lines(figure, "a  block ") == ["a  block"]
    assert figure.get_figheight() == 6.9


def test_letters_that_no_font_has_are_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    from matplotlib import font_manager

    monkeypatch.setattr(font_manager, "findSystemFonts", list)
    assert fonts.font_families("Straße") == (["DejaVu Sans"], [])
    assert fonts.font_families("捜東 a") == (["DejaVu Sans"], ["捜", "東"])
    with caplog.at_level(logging.WARNING), new_figure(tmp_path / "a.png", (7.6, 6.9), "東"):
        pass
    assert len(caplog.records) == 1
    assert "no font here has 東" in caplog.text
