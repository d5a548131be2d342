"""A figure that is written whole, whatever the user's own style, and the same bytes each time."""

import logging
import re
import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.files import written_whole
from planner.messages import plain
from planner.report.fonts import font_families

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

STYLE = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.labelcolor": "#444444",
    "axes.spines.top": True,
    "svg.hashsalt": "planner",
    "text.parse_math": False,  # a dollar sign in a name is one
}
# Undated, or the same picture would differ from day to day; quickly compressed.
AS_FILE: dict[str, dict[str, Any]] = {
    ".png": {"metadata": {"Software": None}, "pil_kwargs": {"compress_level": 4}},
    ".svg": {"metadata": {"Date": None}},
    ".pdf": {"metadata": {"CreationDate": None}},
}
TITLE: dict[str, Any] = {"size": 12.5, "weight": "bold"}
TITLE_LEFT_INCH, TITLE_LINE_INCH = 0.25, 0.23

log = logging.getLogger(__name__)


@contextmanager
def new_figure(
    path: Path, size_inch: tuple[float, float], title: str, attribution: str = ""
) -> Iterator["Figure"]:
    """Give a figure that is written whole at the end, whatever the user's own style.

    It is empty but for its title, and in small print at its foot whose data it shows.
    """
    from matplotlib import style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    title, attribution = plain(title), plain(attribution)
    families, missing = font_families(title + attribution)
    if missing:
        log.warning(
            "%s: no font here has %s; the text shows boxes for them, until one is installed "
            "(such as Noto Sans)",
            path.name,
            " ".join(missing[:10]),
        )
    with style.context(["default", {**STYLE, "font.family": families}]), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from")
        figure = Figure(figsize=size_inch)
        FigureCanvasAgg(figure)
        lines = _title_lines(figure, title)
        figure.set_figheight(size_inch[1] + TITLE_LINE_INCH * (len(lines) - 1))
        for number, line in enumerate(lines):
            top_inch = 0.33 + TITLE_LINE_INCH * number
            y = 1 - top_inch / figure.get_figheight()
            figure.text(TITLE_LEFT_INCH / size_inch[0], y, line, **TITLE)
        if attribution:
            small: dict[str, Any] = {"size": 6.0, "color": "#666666", "ha": "right"}
            across = 1 - 0.1 / figure.get_figwidth()
            filled = textwrap.fill(attribution, int(figure.get_figwidth() * 20))
            figure.text(across, 0.06 / figure.get_figheight(), filled, **small)
        yield figure
        kind = path.suffix.lower()
        with written_whole(path) as new:
            figure.savefig(new, format=kind[1:] or "png", dpi=120, **AS_FILE.get(kind, {}))


def _title_lines(figure: "Figure", title: str) -> list[str]:
    """Return a title in lines that fit into the picture; parted within words where it has to be."""
    from matplotlib.text import Text

    canvas: Any = figure.canvas
    renderer = canvas.get_renderer()
    wide = (figure.get_figwidth() - 2 * TITLE_LEFT_INCH) * figure.dpi

    def fits(line: str) -> bool:
        text = Text(text=line, figure=figure, **TITLE)
        return bool(text.get_window_extent(renderer).width <= wide)

    lines = [""]
    for word in re.findall(r"\s*\S+", title):
        if fits(lines[-1] + word):
            lines[-1] += word
            continue
        if lines[-1]:
            lines.append("")
        for character in word.strip():
            if lines[-1] and not fits(lines[-1] + character):
                lines.append("")
            lines[-1] += character
    return lines


def axes_at(figure: "Figure", left: float, bottom: float, width: float, height: float) -> "Axes":
    """Return axes placed in inches: quicker to draw, and steadier, than a layout that is sought."""
    across, up = figure.get_size_inches().tolist()
    return figure.add_axes((left / across, bottom / up, width / across, height / up))


def in_percent(axis: "Axis") -> None:
    """Write the shares along an axis as `percent` does, with as many decimals as they need."""
    from matplotlib.ticker import PercentFormatter

    axis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
