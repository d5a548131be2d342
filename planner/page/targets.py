"""Where targets may be, as a page shows it: few of them, with few knots each."""

from typing import Any

import numpy as np

from planner.arrays import Floats, Ints
from planner.futures.edges_driven import NO_EDGE
from planner.futures.futures import Futures
from planner.futures.knots import Knots
from planner.page.frame import Frame, packed

MOST_TARGETS = 1_000  # that a page shows
MOST_KNOTS = 250_000  # 2 MB as text
PART_OF_RADIUS = 0.1  # of the sensor's: how far off a target may be shown


def picked(many: int, most: int = MOST_TARGETS) -> Ints:
    """Return which of so many targets are shown: all, or as many as can be, evenly picked."""
    if many <= most:
        return np.arange(many)
    return np.linspace(0, many - 1, most).round().astype(np.int64)


def drawn_knots(futures: Futures, radius_m: float) -> Knots:
    """Return the knots between which targets move as a page shows them.

    Parameters
    ----------
    radius_m
        Of the sensor: targets are shown within a tenth of it of where they are. Where they would
        have too many knots then, they are shown more roughly.
    """
    xy_m = np.stack([futures.x_m, futures.y_m], axis=1)
    no_edge = np.full(len(xy_m), NO_EDGE)
    knots = Knots(np.asarray(futures.particle), futures.time_s, xy_m, no_edge)
    tolerance_m = PART_OF_RADIUS * radius_m
    knots = knots.thinned(tolerance_m)
    while len(knots.time_s) > MOST_KNOTS and len(knots.time_s) > 2 * len(futures):
        tolerance_m *= 2.0
        knots = knots.thinned(tolerance_m)
    return knots


def targets_content(
    futures: Futures, knots: Knots, seen_at: Floats, frame: Frame
) -> dict[str, Any]:
    """Return targets as the page's script takes them.

    Parameters
    ----------
    knots
        Of these targets.
    seen_at
        When each is seen first, (N,) seconds; infinity: never.
    """
    steps = frame.places(knots.xy_m)
    content: dict[str, Any] = {
        "knots": packed(np.bincount(knots.particle, minlength=len(futures))),
        "t": packed(frame.times(knots.time_s)),
        "x": packed(steps[:, 0]),
        "y": packed(steps[:, 1]),
        "seen": packed(frame.times(seen_at)),
        "gone": packed(futures.gone),
    }
    if futures.target.any():  # dots of several are told apart
        content["kind"] = packed(futures.target)
    if np.ptp(futures.weight) > 0.0:  # else all dots are alike
        size = np.sqrt(futures.weight / futures.weight.mean())
        content["size"] = np.round(np.clip(size, 0.4, 3.0), 2).tolist()
    return content
