"""The areas of an airspace on a map, and what their lines mean."""

from typing import TYPE_CHECKING, Any

from planner.flight.airspace import Airspace
from planner.report.maps import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOUR = "#8e2a8e"  # unlike that of targets, the UAV and any time of a flight
STYLES: dict[str, dict[str, Any]] = {
    "no_fly": {"hatch": "////", "lw": 1.0},
    "fence": {"ls": (0, (6, 2)), "lw": 1.4},
    "within": {"ls": (0, (1, 1.5)), "lw": 1.4},
}
MEANINGS = {"no_fly": "hatched: no-fly", "fence": "dashed: fence", "within": "dotted: searched"}


def draw_airspace(axes: "Axes", view: View, airspace: Airspace | None) -> None:
    """Draw the outlines of areas, and what is closed to the UAV hatched."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    for key, rings in airspace.outlines() if airspace else ():
        path = Path.make_compound_path(*(Path(view.place(ring), closed=True) for ring in rings))
        patch = PathPatch(path, fill=False, ec=COLOUR, alpha=0.8, zorder=2, **STYLES[key])
        axes.add_artist(patch)


def tell_airspace(axes: "Axes", airspace: Airspace | None) -> None:
    """Write below a map what the lines of its areas mean."""
    keys = dict.fromkeys(key for key, _ in airspace.outlines()) if airspace else {}
    said = "; ".join(MEANINGS[key] for key in keys)
    axes.text(0.0, -0.1, said, transform=axes.transAxes, size=8.0, color=COLOUR)
