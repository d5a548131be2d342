"""What nobody said of a target: questions, and which answer is true of each particle.

One table for all who ask: a call, which tells what its odds hang on, and a flight, which looks for
whoever could be rung up.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from planner import compass
from planner.arrays import Flags, Floats, Ints
from planner.detection.first_detection import first_detection
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork

ROADS = 4  # first roads that are told apart; all others are one answer
CAMERA_M = 50.0  # how far a camera at a node sees
CAMERAS = 8  # nodes that are tried where nobody names any
BEGINS_S = 60.0  # by where it is after so long is told which way it went, and how fast
STANDS_M = 5.0  # or less in that time: it does not drive
KMH = 3.6  # of a metre a second
ROUND_KMH = 5  # to which speeds are told
QUARTERS = tuple(compass.words(90.0 * k, 4) for k in range(4))
OTHER = "another"
ALWAYS = 0.02  # or less: what nearly every target passes, or none, is not asked
NONE = -1  # which answer is true where none is


@dataclass(frozen=True)
class Question:
    """Something that somebody may know of the target."""

    asked: str
    answers: tuple[str, ...]
    of: Callable[[Futures], Ints]  # which answer is true of each particle, (N,); NONE: of none
    option: str = ""  # of a call, that takes the answer


class About(NamedTuple):
    """Which target is asked about, and when."""

    believed: Futures  # particles, by which answers are chosen
    network: RoadNetwork
    at_s: float  # which time is asked about, seconds on the target's clock
    cameras: Sequence[int] = ()  # junctions that have one; empty: some that every other one passes


def of_a_call(about: About) -> list[Question]:
    """Return what somebody who rings can still say, each with the option that takes it."""
    asked = (
        replace(ask(about), option=option)
        for ask, option in (
            (heading, "--heading"),
            (speed, "--target"),
            (start_side, "--last-seen"),
            (stands, "--target"),
        )
    )
    return [one for one in asked if _parts(one, about.believed)]


def of_a_flight(about: About) -> list[Question]:
    """Return what may be asked while a flight goes on."""
    asked = (side(about), first_road(about), speed(about))
    return [*(one for one in asked if _parts(one, about.believed)), *cameras(about)]


def _parts(question: Question, believed: Futures) -> bool:
    """Return whether targets differ in their answer: what all answer alike is not asked."""
    given = question.of(believed)[believed.weight > 0.0]
    return len(np.unique(given[given != NONE])) > 1


# How it began


def heading(_: About) -> Question:
    """Return the question which way a target went at first."""

    def of(futures: Futures) -> Ints:
        began = _Began.of(futures)
        return np.where(began.moves, _quarter(began.step_m), NONE)

    return Question("which way it went", QUARTERS, of)


def speed(about: About) -> Question:
    """Return the question how fast a target drove at first, of those that did."""
    began = _Began.of(about.believed)
    driven = began.speed_kmh[began.moves]
    thirds = np.quantile(driven, [1 / 3, 2 / 3]) if len(driven) else np.zeros(2)
    # Two thirds that are rounded to the same speed part targets once, not twice.
    limits = sorted({ROUND_KMH * max(1, round(third / ROUND_KMH)) for third in thirds.tolist()})

    def of(futures: Futures) -> Ints:
        began = _Began.of(futures)
        part = np.searchsorted(limits, began.speed_kmh, side="right")
        return np.where(began.moves, part, NONE)

    between = (f"{slow} to {fast} km/h" for slow, fast in pairwise(limits))
    names = (f"under {limits[0]} km/h", *between, f"over {limits[-1]} km/h")
    return Question("how fast it drove", names, of)


def start_side(about: About) -> Question:
    """Return the question on which side of the middle of all starts a target was first."""
    middle_m = np.nanmean(_Began.of(about.believed).start_m, axis=0)

    def of(futures: Futures) -> Ints:
        return _quarter(_Began.of(futures).start_m - middle_m)

    return Question("on which side of the place it was", QUARTERS, of)


def first_road(about: About) -> Question:
    """Return the question which road it took after its first one."""
    network, roads = about.network, _second_edge(about.believed)
    known, weight = roads[roads >= 0], about.believed.weight[roads >= 0]
    counts = np.bincount(known, weights=weight, minlength=1)
    most = [int(edge) for edge in np.argsort(-counts, kind="stable")[:ROADS] if counts[edge] > 0.0]
    names = [network.edge_street[edge] or network.edge_ids[edge] for edge in most]

    def of(futures: Futures) -> Ints:
        edges = _second_edge(futures)
        answer = np.full(len(edges), len(most))
        for number, edge in enumerate(most):
            answer[edges == edge] = number
        return answer

    return Question("which road it turned into first", (*names, OTHER), of)


# Where it is


def stands(about: About) -> Question:
    """Return the question whether a target stands at a time."""

    def of(futures: Futures) -> Ints:
        before = futures.positions(max(0.0, about.at_s - BEGINS_S))
        moved_m = np.hypot(*(futures.positions(about.at_s) - before).T)
        return np.where(np.isfinite(moved_m), (moved_m <= STANDS_M).astype(int), NONE)

    return Question("whether it stands by take-off", ("drives", "stands"), of)


def side(about: About) -> Question:
    """Return the question on which side of the middle a target is, across where they spread."""
    xy_m, weight = about.believed.positions(about.at_s), about.believed.weight
    there = np.isfinite(xy_m[:, 0])
    if there.sum() < 2:
        names = ("here", "there")
        return Question("on which side it is", names, lambda some: np.zeros(len(some), int))
    middle_m = np.average(xy_m[there], axis=0, weights=weight[there])
    spread = np.cov((xy_m[there] - middle_m).T, aweights=weight[there])
    along = np.linalg.eigh(spread)[1][:, -1]
    along = along if along[0] + 1e-9 * along[1] >= 0.0 else -along
    names = ("west or south", "east or north")
    if along[1] < 0.0:
        names = ("west or north", "east or south")

    def of(futures: Futures) -> Ints:
        return np.asarray((futures.positions(about.at_s) - middle_m) @ along > 0.0, dtype=np.int64)

    return Question("on which side of the middle it is", names, of)


def cameras(about: About) -> Iterator[Question]:
    """Yield whether each camera has seen it, those named or those that tell most."""
    nodes = [*about.cameras] or _passed_by_half(about)
    return (camera(about.network, node, about.at_s) for node in nodes)


def camera(network: RoadNetwork, node: int, at_s: float) -> Question:
    """Return the question whether a camera at a junction has seen it by a time."""
    x_m, y_m = network.junction_xy_m[node].tolist()

    def of(futures: Futures) -> Ints:
        return _passed(futures, x_m, y_m, at_s)

    return Question(f"whether it passed {network.junction_ids[node]}", ("no", "yes"), of)


# What particles did


class _Began(NamedTuple):
    """How particles began to drive, a row for each; NaN for those that never were there."""

    start_m: Floats  # (N, 2) where they were first
    step_m: Floats  # (N, 2) to where they were `BEGINS_S` later, or at their end
    speed_kmh: Floats  # (N,) of that way, as it is driven

    @property
    def moves(self) -> Flags:
        """Which of them drove, (N,); False for NaN."""
        return np.asarray(np.hypot(*self.step_m.T) > STANDS_M)

    @classmethod
    def of(cls, futures: Futures) -> "_Began":
        some = np.diff(futures.first_knot) > 0
        first = futures.first_knot[:-1][some]
        began_s = np.full(len(futures), np.nan)
        began_s[some] = futures.time_s[first]
        start_m = np.full((len(futures), 2), np.nan)
        start_m[some] = np.stack([futures.x_m[first], futures.y_m[first]], axis=1)
        ends_s = np.fmin(began_s + BEGINS_S, futures.end_s)
        lasts_s = np.where(ends_s > began_s, ends_s - began_s, 1.0)
        speed_kmh = KMH * futures.driven_m(ends_s) / lasts_s
        return cls(start_m, futures.positions(ends_s) - start_m, speed_kmh)


def _quarter(step_m: Floats) -> Ints:
    """Return the quarter of the compass to which steps, (N, 2) metres, lead; NONE: to none."""
    bearing_deg = np.degrees(np.arctan2(step_m[:, 0], step_m[:, 1]))
    quarter = np.round(np.nan_to_num(bearing_deg) / 90.0).astype(int) % len(QUARTERS)
    return np.where(np.hypot(*step_m.T) > 0.0, quarter, NONE)


def _second_edge(futures: Futures) -> Ints:
    """Return the edge that each particle drives after its first one, (N,); -1: there is none."""
    first, count = futures.edges.first_change[:-1], np.diff(futures.edges.first_change)
    found = np.full(len(futures), -1, dtype=np.int64)
    found[count > 1] = futures.edges.edge[first[count > 1] + 1]
    return found


def _passed(futures: Futures, x_m: float, y_m: float, at_s: float) -> Ints:
    spent = np.array([0.0, at_s])
    watch = Track(spent, np.full(2, x_m), np.full(2, y_m), spent[None, :])
    return np.asarray(np.isfinite(first_detection(futures, watch, CAMERA_M)), dtype=np.int64)


def _passed_by_half(about: About) -> list[int]:
    """Return the junctions that nearest to every other target passes."""
    believed, network, at_s, _ = about
    first = believed.take(np.arange(min(len(believed), 500)))
    total = float(first.weight.sum()) or 1.0
    nodes = _near_targets(first, network, at_s)
    share = [float(first.weight @ camera(network, node, at_s).of(first)) / total for node in nodes]
    order = np.argsort(np.abs(np.array(share) - 0.5), kind="stable")
    return [nodes[k] for k in order[:CAMERAS] if ALWAYS < share[k] < 1.0 - ALWAYS]


def _near_targets(some: Futures, network: RoadNetwork, at_s: float) -> list[int]:
    """Return junctions near which many knots of targets lie by a time, no more than a hundred."""
    knots = some.time_s <= at_s
    places_m = np.stack([some.x_m[knots], some.y_m[knots]], axis=1)
    if len(places_m) == 0:
        return []
    node = cKDTree(network.junction_xy_m).query(places_m)[1]
    counts = np.bincount(node, minlength=len(network.junction_ids))
    order = np.argsort(-counts, kind="stable")[:100]
    return sorted(int(one) for one in order if counts[one])
