"""Pictures: a plan with what it achieves, and where the target may be at a time."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from planner import compass
from planner.arrays import Floats
from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.detection.prospects import left_unseen
from planner.flight.pieces import pieces, segments
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.futures.edges_driven import NO_EDGE
from planner.futures.state_at import State
from planner.messages import percent
from planner.network.road_network import RoadNetwork
from planner.report.airspace_map import draw_airspace, tell_airspace
from planner.report.curves import draw_curves, shown_until_s
from planner.report.figure import axes_at, in_percent, new_figure
from planner.report.formats import length, time_unit
from planner.report.maps import (
    FOUND_COLOUR,
    TARGET_COLOUR,
    UAV_COLOUR,
    View,
    draw_flight,
    draw_net,
    draw_order,
    draw_targets,
    time_colours,
)
from planner.report.town_map import (
    draw_finds,
    draw_search,
    finds_of,
    list_finds,
    view_of_search,
    view_of_state,
)
from planner.search.problem import Problem

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# How many moments are shown beside a plan, how wide, inches, and the size of the words above them,
# of which there are more where targets go.
USUAL, WHERE_SOME_GO = (4, 1.375, 9.0), (3, 1.86, 8.0)
MOST_PIECES = 300  # of a flight, that a map shows


def plan_picture(
    path: Path,
    problem: Problem,
    plan: Plan,
    *,
    evaluations: Mapping[str, Evaluation],
    title: str = "",
) -> None:
    """Draw a plan: its flight, the targets it looks for at four times, and its detection curves.

    Parameters
    ----------
    path
        ``.png``, ``.svg`` or ``.pdf``. The same plan gives the same bytes.
    evaluations
        Detection curves by their names, at most three. The first belongs to ``problem.futures``.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    evaluated = next(iter(evaluations.values()))
    seen_at = evaluated.seen_at
    attribution = problem.network.attribution
    with new_figure(path, (12.8, 6.9), title, attribution) as figure:
        until_s = shown_until_s(problem, evaluations.values())
        in_town = not problem.network.is_abstract
        draw = _draw_town if in_town else _draw_plan
        some_go = bool(problem.futures.gone.any())
        many, wide, size = WHERE_SOME_GO if in_town or some_go else USUAL
        view = draw(axes_at(figure, 0.65, 0.6, 5.45, 5.45), problem, plan, seen_at, until_s)
        curves = axes_at(figure, 6.9, wide + 1.375, 5.75, 4.675 - wide)
        draw_curves(curves, problem, plan, evaluations, until_s)
        moments = moments_s(problem, seen_at, many)
        unit, unit_s = time_unit(until_s)  # as along the curves, unless moments are too near
        if any(time_s % unit_s for time_s in moments):
            unit, unit_s = "s", 1.0
        for moment, time_s in enumerate(moments):
            axes = axes_at(figure, 6.9 + (wide + 0.083) * moment, 0.25, wide, wide)
            share = _draw_moment(axes, problem, plan, view, seen_at, time_s)
            label = f"{time_s / unit_s:,.0f} {unit}: {percent(share, 0)} found"
            left = left_unseen(problem.futures, evaluated, time_s) / problem.objective.sought
            axes.set_title(
                label + (f", {percent(left, 0)} gone" if left else ""), size=size, pad=3.5
            )
        note = "futures planned with: not found yet (blue), found (grey); UAV: triangle"
        if some_go:
            note += f"\ngone: has {'left the map' if in_town else 'reached its goal'}, not found"
        figure.text(6.9 / 12.8, (wide + 0.595) / figure.get_figheight(), note, size=9.5)


def where_picture(
    path: Path, network: RoadNetwork, state: State, *, title: str = "", flown: Track | None = None
) -> None:
    """Draw where the target may be: roads coloured by probability, discs where particles are.

    Parameters
    ----------
    flown
        A flight that has not seen it; where its sensor was on is a thin line.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    known = state.edge != NO_EDGE
    roads = network.edge_road[state.edge[known]]
    probability = np.zeros(len(network.road_ids))
    np.add.at(probability, roads, state.weight[known])
    with new_figure(path, (7.6, 6.9), title, network.attribution) as figure:
        axes = axes_at(figure, 0.65, 0.6, 5.45, 5.45)
        view = view_of_state(network, state)
        _colour_roads(axes, network, view, probability, axes_at(figure, 6.4, 1.3, 0.16, 4.0))
        draw_targets(axes, view, state.xy_m, state.weight, colour="black", points=200.0)
        if flown is not None:
            _draw_seen(axes, view, flown, state.time_s)
        view.frame(axes, numbered=True)
        axes.set_title(
            f"{clock(state.time_s)}; on the map with probability {percent(state.weight.sum())}\n"
            f"discs: particles, area is probability{'; line: flown' if flown else ''}",
            loc="left",
        )


def _draw_seen(axes: "Axes", view: View, track: Track, until_s: float) -> None:
    """Draw where a flight has been by a time while its sensor was on."""
    from matplotlib.collections import LineCollection

    lines = []
    for from_s, to_s in np.minimum(track.sensor_on, until_s).tolist():
        inner = track.time_s[(track.time_s > from_s) & (track.time_s < to_s)]
        lines.append(view.place(track.xy(np.array([from_s, *inner, to_s]))))
    shown = LineCollection(lines, colors=UAV_COLOUR, linewidths=0.9, alpha=0.8, zorder=2)
    axes.add_collection(shown, autolim=False)


def _colour_roads(
    axes: "Axes", network: RoadNetwork, view: View, probability: Floats, key: "Axes"
) -> None:
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    shades = ListedColormap(colormaps["Blues"](np.linspace(0.25, 0.9, 256)))
    scale = Normalize(0.0, max(float(probability.max(initial=0.0)), 1e-9))
    some = probability > 0
    draw_net(axes, network, view, width=1.0)
    lines = draw_net(axes, network, view, width=1.0)
    lines.set(colors=shades(scale(probability)), linewidths=np.where(some, 6.0, 0.0))
    axes.figure.colorbar(ScalarMappable(scale, shades), cax=key)
    key.set_ylabel("probability that the target is on the road")
    in_percent(key.yaxis)


def _draw_town(axes: "Axes", problem: Problem, plan: Plan, seen_at: Floats, until_s: float) -> View:
    """Draw a flight in a town, and number where it finds first; return the part shown."""
    view = view_of_search(problem, plan, until_s)
    flight = draw_search(axes, problem, plan, until_s, view)
    weight = problem.futures.weight / problem.objective.sought  # of one target, on average
    finds = finds_of(flight, seen_at, weight, apart_m=view.size_m / 9)
    draw_finds(axes, view, finds)
    draw_airspace(axes, view, problem.airspace)
    for track in plan.tracks:
        _mark_uav(axes, view, track, -np.inf, size=9.0)
    view.frame(axes, numbered=True)
    list_finds(axes, view, finds, flight)
    tell_airspace(axes, problem.airspace)
    key = "coloured by time as under the curves; numbers: the first places of likely finds"
    axes.set_title(f"{_flight_note(problem, view)}\n{key}", loc="left")
    return view


def _draw_plan(
    axes: "Axes",
    problem: Problem,
    plan: Plan,
    seen_at: Floats,  # noqa: ARG001
    until_s: float,
) -> View:
    """Draw a plan on an abstract net, roads in order; return the part shown, which is all."""
    view = View.of(problem.network)
    parts = pieces(plan) if plan.follows_roads else segments(plan)
    flight = [piece for piece in parts if piece.start_s < until_s][:MOST_PIECES]
    middle_s = np.array([p.start_s + p.end_s for p in flight]) / 2
    colours = time_colours(middle_s, problem, plan, until_s)
    draw_net(axes, problem.network, view, width=1.4)
    draw_airspace(axes, view, problem.airspace)
    draw_flight(axes, view, flight, colours)
    numbered = draw_order(axes, view, flight, colours)
    for track in plan.tracks:
        _mark_uav(axes, view, track, -np.inf, size=9.0)
    view.frame(axes, numbered=True)
    tell_airspace(axes, problem.airspace)
    note = _flight_note(problem, view) + ("" if numbered else " numbers where there is room;")
    more = any(until_s <= piece.start_s < problem.horizon_s for piece in parts)
    axes.set_title(f"{note}\n{_key(plan, until_s if more else None)}", loc="left")
    return view


def _draw_moment(
    axes: "Axes", problem: Problem, plan: Plan, view: View, seen_at: Floats, time_s: float
) -> float:
    """Draw where targets and UAVs are at a time; return the probability of one's being found."""
    futures = problem.futures
    draw_net(axes, problem.network, view, width=0.7)
    draw_airspace(axes, view, problem.airspace)
    xy_m, found = futures.positions(time_s), seen_at <= time_s
    for which, colour in ((found, FOUND_COLOUR), (~found, TARGET_COLOUR)):
        weight = futures.weight[which] / max(float(futures.weight[which].sum()), 1e-300)
        draw_targets(axes, view, xy_m[which], weight, colour=colour, points=105.0)
    for track in plan.tracks:
        _mark_uav(axes, view, track, time_s, size=7.0)
    view.frame(axes, numbered=False)
    return float(futures.weight[found].sum()) / problem.objective.sought


def _mark_uav(axes: "Axes", view: View, track: Track, time_s: float, *, size: float) -> None:
    """Draw the UAV as a triangle; hollow and where it enters the map while it is beyond."""
    if len(track.time_s) == 0:
        return
    start_s = min(max(time_s, float(track.time_s[0])), track.end_s)
    flight = track.xy(np.linspace(start_s, track.end_s, 2000))
    inside = view.contains(flight)
    first = flight[np.argmax(inside)]  # its own place, if it never enters
    x, y = view.place(view.nearest(first)).tolist()
    face = UAV_COLOUR if inside[0] else "white"
    axes.plot(x, y, "^", ms=size, mfc=face, mec=UAV_COLOUR, mew=1.6, zorder=7, clip_on=False)


def moments_s(problem: Problem, seen_at: Floats, many: int) -> list[float]:
    """Return times from take-off until nine tenths of the sightings are made, evenly apart.

    They are whole minutes where these are as far apart, else whole seconds; none stands there
    twice.
    """
    first_s = problem.flying[0].take_off_s
    seen_s = np.sort(seen_at[seen_at <= problem.horizon_s])
    last_s = float(seen_s[int(0.9 * (len(seen_s) - 1))]) if len(seen_s) else problem.horizon_s
    times_s = np.linspace(first_s, max(first_s, last_s), many)
    unit_s = 60.0 if times_s[1] - times_s[0] >= 60.0 else 1.0
    return list(dict.fromkeys(float(t) for t in np.ceil(times_s / unit_s) * unit_s))


def _flight_note(problem: Problem, view: View) -> str:
    uav, roads = problem.flying[0], problem.network.shape_xy_m
    start = np.array([uav.x_m, uav.y_m])
    where = "from the triangle"
    if not view.contains(start):
        offset = start - roads[np.argmin(np.linalg.norm(roads - start, axis=1))]
        side = compass.words(float(np.degrees(np.arctan2(offset[0], offset[1]))))
        where = f"{length(float(np.hypot(*offset)))} {side} of the net"
    begins = "flies on" if uav.in_air else "takes off"
    return f"UAV {begins} at {clock(uav.take_off_s)}, {where};"


def _key(plan: Plan, until_s: float | None) -> str:
    """Return what the lines of a flight mean, and until when they are drawn if not to the end."""
    until = "" if until_s is None else f" until {clock(until_s)}"
    if any(plan.legs):
        return f"roads in the order flown{until}, coloured by time as under the curves"
    end = "; it waits at its end" if until_s is None else f", drawn{until}"
    return f"the line is coloured by time as under the curves{end}"
