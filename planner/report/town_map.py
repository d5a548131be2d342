"""The map of a plan in a town: faint streets, the flight coloured by time, the first finds."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.arrays import Floats
from planner.clock import clock
from planner.flight.pieces import Piece, along, segments
from planner.flight.plan import Plan
from planner.futures.state_at import State
from planner.messages import percent
from planner.network.road_network import RoadNetwork
from planner.report.maps import View, draw_net, time_colours
from planner.search.problem import Problem

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STREETS = 0.6  # width of streets, points
FINDS = 6  # so many are numbered
A_FIND = 0.01  # of the probability; what finds less is not numbered
WITHIN = 0.98  # of the probability lies on the map, at each of some times
TIMES = 24
LEAST_SHOWN = 0.2  # of a net's width, so that one knows where in it that is
NUMBER: dict[str, Any] = {"size": 8.5, "weight": "bold", "ha": "center", "va": "center"}
BOX: dict[str, Any] = {"boxstyle": "circle,pad=0.22", "fc": "white", "ec": "black", "lw": 1.1}


@dataclass(frozen=True, eq=False)
class Find:
    """A stretch of a flight on which targets are likely to be found."""

    xy_m: Floats  # (2,) where the UAV is half-way through
    from_s: float  # when the first of them is found, seconds
    probability: float  # that the target is found on it


def view_of_search(problem: Problem, plan: Plan, until_s: float) -> View:
    """Return the part of a town that matters: where the flight goes, and where targets are."""
    uav, futures = problem.flying[0], problem.futures
    places = [np.array([[uav.x_m, uav.y_m]])]
    for track in plan.tracks:
        early = track.time_s <= until_s
        places.append(np.stack([track.x_m, track.y_m], axis=1)[early])
    edge = (1 - WITHIN) / 2
    for time_s in np.linspace(uav.take_off_s, until_s, TIMES).tolist():
        xy_m = futures.positions(time_s)
        there = xy_m[np.isfinite(xy_m).all(axis=1)]
        if len(there):
            places.append(np.quantile(there, [edge, 1 - edge], axis=0))
    return View.around(np.concatenate(places))


def view_of_state(network: RoadNetwork, state: State) -> View:
    """Return the part of a net where targets are at a time, in a town; else all of it."""
    whole = View.of(network)
    if network.is_abstract or len(state.xy_m) == 0:
        return whole
    edge = (1 - WITHIN) / 2
    view = View.around(np.quantile(state.xy_m, [edge, 1 - edge], axis=0), margin=0.2)
    if view.size_m >= whole.size_m:
        return whole
    return view.of_size(max(view.size_m, LEAST_SHOWN * whole.size_m))


def finds_of(
    flight: Sequence[Piece], seen_at: Floats, weight: Floats, *, apart_m: float
) -> list[Find]:
    """Return the first stretches of a flight on which targets are likely to be found, in order.

    Parameters
    ----------
    flight
        From waypoint to waypoint.
    apart_m
        What is found nearer than this to an earlier find counts as found there.
    """
    found: list[Find] = []
    for piece in flight:
        here = (seen_at >= piece.start_s) & (seen_at < piece.end_s)
        probability = float(weight[here].sum())
        if probability < A_FIND:
            continue
        middle, _ = along(piece.xy_m, 0.5)
        away_m = [float(np.hypot(*(middle - one.xy_m))) for one in found]
        if away_m and min(away_m) < apart_m:
            near = int(np.argmin(away_m))
            found[near] = replace(found[near], probability=found[near].probability + probability)
        elif len(found) < FINDS:
            found.append(Find(middle, float(seen_at[here].min()), probability))
        else:
            break
    return found


def draw_search(
    axes: "Axes", problem: Problem, plan: Plan, until_s: float, view: View
) -> Sequence[Piece]:
    """Draw the streets and the flight; return what is drawn of it, from waypoint to waypoint."""
    from matplotlib.collections import LineCollection

    flight = [piece for piece in segments(plan) if piece.start_s < until_s]
    middle_s = np.array([piece.start_s + piece.end_s for piece in flight]) / 2
    colours = time_colours(middle_s, problem, plan, until_s)
    draw_net(axes, problem.network, view, width=STREETS)
    # The last one first, as what is flown soonest has to be seen best.
    shapes = [view.place(piece.xy_m) for piece in flight][::-1]
    for width, colour, order in ((4.2, "white", 3), (2.4, colours[::-1], 4)):
        lines = LineCollection(shapes, colors=colour, linewidths=width, zorder=order)
        lines.set_capstyle("round")
        axes.add_collection(lines, autolim=False)
    return flight


def draw_finds(axes: "Axes", view: View, finds: Sequence[Find]) -> None:
    """Write the number of each find where it is made."""
    for number, find in enumerate(finds, 1):
        x, y = view.place(find.xy_m).tolist()
        axes.text(x, y, str(number), zorder=6, bbox=BOX, clip_on=True, **NUMBER)


def list_finds(axes: "Axes", view: View, finds: Sequence[Find], flight: Sequence[Piece]) -> None:
    """List when each numbered find is made, and how likely, in the emptiest corner of the map."""
    if not finds:
        return
    told = [
        f"{number} at {clock(find.from_s)}: {percent(find.probability, 0)}"
        for number, find in enumerate(finds, 1)
    ]
    across, up = _emptiest_corner(view, [find.xy_m for find in finds], flight)
    axes.text(
        0.985 if across else 0.015,
        0.985 if up else 0.015,
        "\n".join(told),
        transform=axes.transAxes,
        ha="right" if across else "left",
        va="top" if up else "bottom",
        zorder=7,
        bbox={"boxstyle": "round,pad=0.35", "fc": "white", "ec": "#c8c8c8", "alpha": 0.9},
    )


def _emptiest_corner(
    view: View, places: Sequence[Floats], flight: Sequence[Piece]
) -> tuple[bool, bool]:
    """Return the corner farthest from all that is drawn: whether in the east, in the north."""
    xy_m = np.concatenate([np.array(places), *[piece.xy_m for piece in flight]])
    at = (xy_m - (view.west_m, view.south_m)) / view.size_m
    corners = [(True, True), (False, True), (True, False), (False, False)]
    return max(corners, key=lambda corner: float(np.hypot(*(at - corner).T).min()))
