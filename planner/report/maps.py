"""Pieces of a map: the net, where targets may be, how the UAV flies."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.arrays import Flags, Floats
from planner.flight.pieces import Piece, along, flight_span
from planner.flight.plan import Plan
from planner.network.road_network import RoadNetwork
from planner.search.problem import Problem

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection

NET_COLOUR = "#c8c8c8"
TARGET_COLOUR = "#0072b2"
FOUND_COLOUR = "#808080"  # darker than roads
UAV_COLOUR = "#d55e00"
WAY_COLOUR = "#555555"
FLIGHT_MAP = "viridis"
CELLS = 64  # across a map, when targets close to each other are drawn as one disc
NUMBER_PLACES = (0.5, 0.32, 0.68, 0.2, 0.8)  # along a road, tried in this order
MAP_POINTS = 392.0  # width of the map with numbers on paper
GLYPH, LINE, PADS = 0.65, 1.25, 0.6  # a label's width per character, height per line, and padding
PER_LINE = 3  # numbers on one line of a label


@dataclass(frozen=True)
class View:
    """What a map shows: a square around the net, and the unit of its axes."""

    west_m: float
    south_m: float
    size_m: float

    @classmethod
    def of(cls, network: RoadNetwork, *, margin: float = 0.07) -> "View":
        """Return the square around a net, with a margin as a share of its size on each side."""
        return cls.around(network.shape_xy_m, margin=margin)

    @classmethod
    def around(cls, xy_m: Floats, *, margin: float = 0.07) -> "View":
        """Return the square around points, (k, 2) metres, with a margin as for a net."""
        low, high = xy_m.min(axis=0), xy_m.max(axis=0)
        size = max(float((high - low).max()), 1.0) * (1 + 2 * margin)
        west, south = ((low + high) / 2 - size / 2).tolist()
        return cls(west, south, size)

    def of_size(self, size_m: float) -> "View":
        """Return a square of another size around the same place."""
        less_m = (self.size_m - size_m) / 2
        return View(self.west_m + less_m, self.south_m + less_m, size_m)

    @property
    def unit(self) -> str:
        """Unit of the axes."""
        return "km" if self.size_m >= 2000 else "m"

    def place(self, xy_m: Floats) -> Floats:
        """Return points in the unit of the axes."""
        return xy_m / (1000.0 if self.unit == "km" else 1.0)

    def contains(self, xy_m: Floats) -> Flags:
        """Tell which points lie inside, (...,)."""
        offset = (xy_m - (self.west_m, self.south_m)) / self.size_m
        return np.asarray(np.all((offset >= 0) & (offset <= 1), axis=-1))

    def nearest(self, xy_m: Floats) -> Floats:
        """Return the points of the square nearest to given ones, a little inside its border."""
        corner = np.array([self.west_m, self.south_m])
        inside = 0.015 * self.size_m
        return np.clip(xy_m, corner + inside, corner + self.size_m - inside)

    def frame(self, axes: "Axes", *, numbered: bool) -> None:
        """Set limits, shape and labels of a map."""
        corner = np.array([self.west_m, self.south_m])
        (west, south), (east, north) = self.place(np.stack([corner, corner + self.size_m]))
        axes.set(xlim=(west, east), ylim=(south, north), aspect="equal")
        for side in axes.spines.values():
            side.set_color(NET_COLOUR)
        if numbered:
            axes.set(xlabel=f"east ({self.unit})", ylabel=f"north ({self.unit})")
            axes.tick_params(colors="#444444", length=3)
            if 0.0 < np.ptp(axes.get_yticks()[:2]) < 0.5:
                _make_room_for_decimals(axes)
        else:
            axes.set(xticks=[], yticks=[])


def _make_room_for_decimals(axes: "Axes") -> None:
    """Have a map numbered in tenths: hundredths push its label out of the picture."""
    from matplotlib.ticker import MaxNLocator

    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(9, steps=[1, 2, 5, 10]))
    axes.yaxis.labelpad = 1.0


def draw_net(axes: "Axes", network: RoadNetwork, view: View, *, width: float) -> "LineCollection":
    """Draw all roads as grey lines; return them, to be coloured otherwise."""
    from matplotlib.collections import LineCollection

    roads = [view.place(network.shape(road)) for road in range(len(network.road_ids))]
    lines = LineCollection(roads, colors=NET_COLOUR, linewidths=width, capstyle="round", zorder=1)
    axes.add_collection(lines, autolim=False)
    return lines


def draw_targets(
    axes: "Axes", view: View, xy_m: Floats, weight: Floats, *, colour: str, points: float
) -> None:
    """Draw discs whose areas are probabilities: a certain target is a quarter of the map wide.

    Parameters
    ----------
    points
        Width of the map on paper, in points.
    """
    here = np.isfinite(xy_m).all(axis=1) & (weight > 0)
    if not here.any():
        return
    xy_m, weight = xy_m[here], weight[here]
    cell = np.floor((xy_m - (view.west_m, view.south_m)) / view.size_m * CELLS).astype(int)
    _, which = np.unique(cell, axis=0, return_inverse=True)
    which = which.ravel()
    mass = np.bincount(which, weights=weight)
    middle = np.stack([np.bincount(which, weights=weight * c) / mass for c in xy_m.T], axis=1)
    area = np.maximum(mass * (points / 4) ** 2, 1.0)
    place = view.place(middle)
    axes.scatter(place[:, 0], place[:, 1], s=area, c=colour, linewidths=0, alpha=0.8, zorder=3)


def draw_flight(axes: "Axes", view: View, flight: Sequence[Piece], colours: Floats) -> None:
    """Draw a flight: roads thick and coloured, ways between them thin and broken, arrows on both.

    A flight that follows no road is coloured all the way.

    Parameters
    ----------
    colours
        One colour per piece, (len(flight), 4) red, green, blue, opacity.
    """
    from matplotlib.collections import LineCollection

    shapes = [view.place(piece.xy_m) for piece in flight]
    off_roads = not any(piece.order for piece in flight)
    roads = [k for k, piece in enumerate(flight) if piece.order or off_roads]
    ways = [k for k, piece in enumerate(flight) if not (piece.order or off_roads)]
    lines = [
        LineCollection(
            [shapes[k] for k in ways], colors=WAY_COLOUR, linewidths=1.1, linestyles="--", zorder=2
        ),
        LineCollection([shapes[k] for k in roads], colors=colours[roads], linewidths=3.2, zorder=4),
    ]
    for line in lines:
        axes.add_collection(line, autolim=False)
    for k, piece in enumerate(flight):
        colour = colours[k] if piece.order or off_roads else WAY_COLOUR
        _arrow(axes, view, piece, colour)


def draw_order(axes: "Axes", view: View, flight: Sequence[Piece], colours: Floats) -> bool:
    """Write on each road flown its place in the order; numbers without room share a label.

    Where even these would cover each other, the later ones are left out; return whether all are
    there.
    """
    flown = [(piece, colour) for piece, colour in zip(flight, colours, strict=True) if piece.order]
    size = 8.5 if len(flown) <= 30 else 6.5
    labels: list[_Label] = []
    for piece, colour in flown:
        _put_number(labels, piece, colour, apart_m=view.size_m * size / 240)
    shown = _apart(labels, size * view.size_m / MAP_POINTS)
    for label in shown:
        x, y = view.place(label.xy_m).tolist()
        shape = "circle,pad=0.22" if len(label.numbers) == 1 else "round,pad=0.25"
        axes.text(
            x,
            y,
            label.text,
            size=size,
            weight="bold",
            ha="center",
            va="center",
            zorder=6,
            bbox={"boxstyle": shape, "fc": "white", "ec": label.colour, "lw": 1.3},
            clip_on=True,
        )
    return len(shown) == len(labels)


@dataclass(frozen=True, eq=False)
class _Label:
    xy_m: Floats  # (2,)
    road_xy_m: Floats  # (2,) the middle of its road
    colour: Floats  # (4,)
    numbers: tuple[int, ...]

    @property
    def text(self) -> str:
        lines = (self.numbers[i : i + PER_LINE] for i in range(0, len(self.numbers), PER_LINE))
        return "\n".join(", ".join(map(str, line)) for line in lines)

    @property
    def half_ems(self) -> Floats:
        """Half of its width and height, (2,), in sizes of its letters."""
        lines = self.text.split("\n")
        wide, high = GLYPH * max(map(len, lines)), LINE * len(lines)
        if len(self.numbers) == 1:  # in a circle
            high = max(wide, high)
        return (np.array([wide, high]) + PADS) / 2


def _apart(labels: Sequence[_Label], em_m: float) -> list[_Label]:
    """Return labels that do not cover each other, those first that bear the first numbers.

    Parameters
    ----------
    em_m
        The size of their letters, in metres of the map.
    """
    kept: list[_Label] = []
    for label in sorted(labels, key=lambda label: label.numbers):
        half = label.half_ems * em_m
        away = (np.abs(label.xy_m - one.xy_m) - half - one.half_ems * em_m for one in kept)
        if all((gap >= 0.0).any() for gap in away):
            kept.append(label)
    return kept


def _put_number(labels: list[_Label], piece: Piece, colour: Floats, *, apart_m: float) -> None:
    """Add a label where there is room, else one for all numbers of the nearest one's road."""
    places = [along(piece.xy_m, share)[0] for share in NUMBER_PLACES]
    shared = any(len(label.numbers) > 1 for label in _on_road(labels, places[0]))
    for place in () if shared else places:
        if all(np.linalg.norm(place - label.xy_m) >= apart_m for label in labels):
            labels.append(_Label(place, places[0], colour, (piece.order,)))
            return
    nearest = min(labels, key=lambda label: float(np.linalg.norm(places[0] - label.xy_m)))
    there = _on_road(labels, nearest.road_xy_m)
    numbers = sorted([piece.order, *(number for label in there for number in label.numbers)])
    labels[:] = [label for label in labels if label not in there]
    labels.append(_Label(nearest.road_xy_m, nearest.road_xy_m, nearest.colour, tuple(numbers)))


def _on_road(labels: Sequence[_Label], road_xy_m: Floats) -> list[_Label]:
    """Return the labels of a road, in whichever direction it was flown."""
    return [one for one in labels if np.linalg.norm(one.road_xy_m - road_xy_m) < 1.0]


def _arrow(axes: "Axes", view: View, piece: Piece, colour: Floats | str) -> None:
    tip, direction = along(piece.xy_m, 0.8 if piece.order else 0.5)
    length = float(np.linalg.norm(np.diff(piece.xy_m, axis=0), axis=1).sum())
    if length < view.size_m / 25 or not view.contains(tip):
        return
    reach = direction * view.size_m / 1000
    axes.annotate(
        "",
        xy=view.place(tip + reach).tolist(),
        xytext=view.place(tip - reach).tolist(),
        arrowprops={
            "arrowstyle": "-|>,head_width=0.38,head_length=0.55",
            "color": colour,
            "lw": 0,
            "shrinkA": 0,
            "shrinkB": 0,
            "mutation_scale": 13 if piece.order else 9,
        },
        zorder=5,
    )


def time_colours(times_s: Floats, problem: Problem, plan: Plan, until_s: float) -> Floats:
    """Return the colour that each time of the flight has, (..., 4) red, green, blue, opacity.

    Parameters
    ----------
    until_s
        From when on all have the last one.
    """
    from matplotlib import colormaps

    first_s, last_s = flight_span(plan, problem.flying[0].take_off_s, until_s)
    share = np.clip((times_s - first_s) / max(last_s - first_s, 1e-9), 0.0, 1.0)
    return np.asarray(colormaps[FLIGHT_MAP](0.88 * share))  # its last yellow is lost on white
