"""The map of a page as a still picture, for where no script runs."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.flight.track import Track
from planner.page.earth import Box
from planner.page.legend import CORNERS

WIDE = 1000  # of the picture, in its own units
DOT, UAV = 4, 14  # sizes in it
NUMBER_WIDE, NUMBER_HIGH = 36, 24  # room for the number of a leg


class Flown(NamedTuple):
    """A flight, and what is told of it."""

    track: Track
    legs_m: Floats  # (L, 2) metres, where its legs begin: they are numbered where there is room


def still(
    view: Box,
    *,
    roads: Iterable[Floats],
    targets_m: Floats,
    target: Ints | None = None,
    flights: Iterable[Flown],
    label: str,
) -> str:
    """Return a picture as SVG: roads, where targets are at take-off, the flights.

    Parameters
    ----------
    view
        What it shows.
    roads
        Polylines, (k, 2) metres.
    targets_m
        (n, 2) metres.
    target
        Which of several targets each of these may be, (n,); None: there is one.
    label
        What it is called, as markup.
    """
    scale = WIDE / (view.east_m - view.west_m)
    high = round((view.north_m - view.south_m) * scale)

    def placed(xy_m: Floats) -> Ints:
        steps = np.stack([xy_m[:, 0] - view.west_m, view.north_m - xy_m[:, 1]], axis=1)
        return np.asarray(np.round(steps * scale).astype(np.int64))

    lines = [placed(line_m) for line_m in roads]
    lines = [line for line in lines if _crosses(line, high)]
    flights = [one for one in flights if len(one.track.time_s)]
    flown = [placed(np.stack([one.track.x_m, one.track.y_m], axis=1)) for one in flights]
    numbers = _numbers([placed(one.legs_m) for one in flights], WIDE, high)
    starts = "".join(_triangle(*line[0].tolist()) for line in flown)
    kinds = np.zeros(len(targets_m), np.int64) if target is None else target
    dots = "".join(_dots(placed(targets_m[kinds == n]), n) for n in range(kinds.max(initial=0) + 1))
    return (
        f'<svg id="still" viewBox="0 0 {WIDE} {high}" role="img" aria-label="{label}">'
        f'<path class="roads" d="{"".join(map(_path, lines))}"/>'
        f"{dots}"
        f'<path class="flight" d="{"".join(map(_path, flown))}"/>'
        f'<path class="uav" d="{starts}"/>{numbers}</svg>'
    )


def _numbers(legs: Iterable[Ints], wide: int, high: int) -> str:
    """Return the numbers of legs where these begin; one that would cover another is left out."""
    said: list[tuple[int, int]] = []
    texts = []
    for places in legs:
        for number, (x, y) in enumerate(places.tolist(), 1):
            apart = all(abs(x - u) >= NUMBER_WIDE or abs(y - v) >= NUMBER_HIGH for u, v in said)
            if apart and 0 <= x <= wide and 0 <= y <= high:
                said.append((x, y))
                texts.append(f'<text x="{x}" y="{y}">{number}</text>')
    return "".join(texts)


def _dots(places: Ints, kind: int) -> str:
    """Return the dots of one target, the first one's like those of a single target."""
    d = "".join(f"M{x} {y}h0" for x, y in np.unique(places, axis=0).tolist())
    look = kind % len(CORNERS)
    return f'<path class="targets{f" t{look}" * (look > 0)}" d="{d}"/>'


def _crosses(line: Ints, high: int) -> bool:
    low, most = line.min(axis=0), line.max(axis=0)
    return bool(np.all(low <= (WIDE, high)) and np.all(most >= 0) and np.any(most > low))


def _path(line: Ints) -> str:
    """Return a polyline as SVG has it: the first place, then steps; those of no length left out."""
    steps = np.diff(line, axis=0)
    moved = steps[np.any(steps != 0, axis=1)].tolist()
    return f"M{line[0, 0]} {line[0, 1]}" + "".join(f"l{x} {y}" for x, y in moved)


def _triangle(x: int, y: int) -> str:
    return f"M{x} {y - UAV}l{UAV} {2 * UAV}h{-2 * UAV}z"
