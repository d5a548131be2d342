"""Figures of the paper's experiments, as PNG and SVG."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.experiments.results import Row
from planner.files import written_whole
from planner.report.estimates import EXPECTED, estimate, levels
from planner.report.figure import AS_FILE, STYLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

U0 = "uav.start.distance_m"  # the paper's name for how far from the origin the UAV begins
HORIZON_S = 10_000.0
ALL, ALL_20 = "all paths", "all paths, 20 m/s"
PATHS = ("east, then south", "south, then east", "staircase", "EESSSEESSE")
SPEEDS = (15, 20, 25)

Line = tuple[str, str, str, dict[str, Any]]  # block, method, label, style

LINES: tuple[Line, ...] = (
    ("no planning", "exhaustive", "exhaustive, first in first out", {"color": "#999999"}),
    ("no planning", "exhaustive-shortest", "exhaustive, shortest", {"color": "#000000"}),
    ("no planning", "wait", "wait at the goal", {"color": "#e69f00", "linestyle": ":"}),
    ("300 s", "greedy", "the paper's greedy", {"color": "#d55e00"}),
    ("300 s", "best", "best, take-off at 300 s", {"color": "#0072b2", "linestyle": "--"}),
    ("1 s", "best", "best, take-off at 1 s", {"color": "#0072b2"}),
)
FIGURE9_LINES: tuple[Line, ...] = (
    ("no planning", "exhaustive-shortest", "exhaustive, shortest", {"linestyle": "--"}),
    ("300 s", "greedy", "the paper's greedy", {"linestyle": "-"}),
)
SPEED_COLOURS = {15: "#009e73", 20: "#0072b2", 25: "#d55e00"}


def figure8(rows: Sequence[Row], folder: Path, *, speed: str = "") -> str:
    """Draw the detection time against u0 on four paths, and return the files' stem.

    Parameters
    ----------
    speed
        What the sets of targets end in: nothing for all speeds, or ", 20 m/s".
    """
    stem = "figure8-20mps" if speed else "figure8"
    with _drawn(folder, stem, (9.2, 7.0)) as figure:
        panels = figure.subplots(2, 2, sharex=True, sharey=True)
        for axes, path in zip(panels.flat, PATHS, strict=True):
            _draw_lines(axes, rows, LINES, path + speed)
            axes.set_title(path, loc="left")
        _finish(figure, list(panels.flat))
    return stem


def figure8_all(rows: Sequence[Row], folder: Path) -> str:
    """Draw the detection time against u0 over all paths, and return the files' stem."""
    with _drawn(folder, "figure8-all", (9.2, 4.4)) as figure:
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        for axes, name in zip(panels, (ALL, ALL_20), strict=True):
            _draw_lines(axes, rows, LINES, name)
            axes.set_title(name if name != ALL else "all paths, 15 to 25 m/s", loc="left")
        _finish(figure, list(panels))
    return "figure8-all"


def figure9(rows: Sequence[Row], folder: Path) -> str:
    """Draw the detection time against u0 for three speeds, and return the files' stem."""
    with _drawn(folder, "figure9", (9.2, 4.4)) as figure:
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        for axes, path in zip(panels, (PATHS[3], ALL), strict=True):
            for speed in SPEEDS:
                lines = [
                    (block, method, f"{label}, {speed} m/s", style | {"color": colour})
                    for block, method, label, style in FIGURE9_LINES
                    for colour in [SPEED_COLOURS[speed]]
                ]
                _draw_lines(axes, rows, lines, f"{path}, {speed} m/s")
            axes.set_title(path, loc="left")
        _finish(figure, list(panels))
    return "figure9"


def section4(found: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]], folder: Path) -> str:
    """Draw the distributions of E over all orders, methods marked; return the files' stem.

    Parameters
    ----------
    found
        For each panel the levels of its condition and what the study found.
    """
    marks = {"exact": "#009e73", "rate": "#0072b2", "greedy": "#d55e00"}
    with _drawn(folder, "section4", (9.2, 3.0 * ((len(found) + 1) // 2) + 0.6)) as figure:
        panels = figure.subplots((len(found) + 1) // 2, 2, squeeze=False)
        for axes, (condition, study) in zip(panels.flat, found, strict=False):
            axes.stairs(study["counts"], study["edges_s"], fill=True, color="#c8c8c8")
            for row in study["rows"]:
                if row["what"] in marks:
                    value_s = row[EXPECTED]
                    label = f"{row['what']}: {value_s:,.0f} s"
                    axes.axvline(value_s, color=marks[row["what"]], label=label)
            away_km = -condition["uav.start.x_m"] / 1000
            title = f"target {condition['target.at_sink']} at its goal, UAV {away_km:.0f} km away"
            axes.set_title(title, loc="left")
            axes.set(xlabel="expected detection time (s)", ylabel="orders")
            axes.legend(frameon=False)
        figure.tight_layout()
    return "section4"


def particles(rows: Sequence[Row], folder: Path) -> str:
    """Draw the value of plans against the particles they were made on; return the stem."""
    with _drawn(folder, "particles", (9.2, 4.0)) as figure:
        panels = figure.subplots(1, 2, sharex=True)
        colours = {"greedy": "#d55e00", "lookahead": "#009e73", "best": "#0072b2"}
        for (method, colour), sampling in (
            (item, sampling) for item in colours.items() for sampling in ("iid", "sobol")
        ):
            where = {"method": method, "search.sampling": sampling}
            style = {"color": colour, "linestyle": "-" if sampling == "sobol" else "--"}
            counts = sorted({row["search.particles"] for row in rows if row["method"] == method})
            for axes, figure_of in zip(panels, (EXPECTED, "bias"), strict=True):
                found = [estimate(rows, where | {"search.particles": n}, figure_of) for n in counts]
                known = [(n, one) for n, one in zip(counts, found, strict=True) if one]
                middle = [one.mean for _, one in known]
                spread = [one.high - one.mean for _, one in known]
                label = f"{method}, {sampling}"
                xs = [n for n, _ in known]
                axes.errorbar(xs, middle, yerr=spread, label=label, capsize=2, **style)
        for axes, title in zip(
            panels, ("value on all targets", "value less own figure"), strict=True
        ):
            axes.set(xscale="log", xlabel="particles", ylabel="s")
            axes.set_title(title, loc="left")
            axes.grid(color="#e8e8e8")
        handles, names = panels[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="lower center", ncols=6, frameon=False)
        figure.tight_layout(rect=(0, 0.08, 1, 1))
    return "particles"


def _draw_lines(axes: "Axes", rows: Sequence[Row], lines: Sequence[Line], targets: str) -> None:
    for block, method, label, style in lines:
        where = {"block": block, "method": method, "targets": targets}
        points = [(u0, estimate(rows, where | {U0: u0})) for u0 in levels(rows, U0)]
        known = [(u0 / 1000, one) for u0, one in points if one]
        if not known:
            continue
        u0_km = [u0 for u0, _ in known]
        axes.plot(u0_km, [one.mean for _, one in known], label=label, linewidth=1.6, **style)
        low, high = ([getattr(one, end) for _, one in known] for end in ("low", "high"))
        axes.fill_between(u0_km, low, high, color=style["color"], alpha=0.2, linewidth=0)
    axes.axhline(HORIZON_S, color="#888888", linewidth=0.8)
    axes.grid(color="#e8e8e8", linewidth=0.8)
    axes.set(xlim=(0, None), ylim=(0, 10_400))


def _finish(figure: "Figure", panels: Sequence["Axes"]) -> None:
    """Name the axes once for all panels, and put one legend below them."""
    height_inch = float(figure.get_size_inches()[1])
    below = 0.75 / height_inch
    across = "distance of the UAV from the origin, u0 (km)"
    figure.text(0.53, below - 0.12 / height_inch, across, ha="center")
    up = "average detection time (s), failures as 10,000"
    figure.text(0.012, 0.5 + below / 2, up, va="center", rotation="vertical")
    handles, names = panels[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="lower center", ncols=3, frameon=False)
    figure.tight_layout(rect=(0.025, below, 1, 1))


@contextmanager
def _drawn(folder: Path, stem: str, size_inch: tuple[float, float]) -> Iterator["Figure"]:
    """Give an empty figure that is written at the end, whatever the user's own style."""
    from matplotlib import style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with style.context(["default", STYLE]):
        figure = Figure(figsize=size_inch)
        FigureCanvasAgg(figure)
        yield figure
        for kind in (".png", ".svg"):
            with written_whole(folder / f"{stem}{kind}") as new:
                figure.savefig(new, format=kind[1:], dpi=90, **AS_FILE[kind])
