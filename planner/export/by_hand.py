"""A flight in a few legs along named streets, without timed holds, for a pilot with a stick.

Of the streets near a plan's line those stretches are flown, one after the other and straight from
one to the next, that are worth most on the plan's own particles.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf
from typing import NamedTuple, TypeAlias

import numpy as np

from planner.arrays import Floats
from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.errors import InputError
from planner.export.line import Line
from planner.export.stretches import Stretch, stretches
from planner.export.way import Way
from planner.flight.as_flown import Battery, line_flown
from planner.flight.law import FlightLaw
from planner.flight.simplified import Clear, kept_knots
from planner.futures.futures import Futures
from planner.network.lines import Lines
from planner.network.road_network import RoadNetwork
from planner.progress import Progress, silent

TURN_S = 2.0  # at rest between two straights, to turn to the next one
OFF_M = 5.0  # by which a street may be off the line that stands for it
NEAR_M = 150.0  # of a plan's line are the crossings that streets are followed between
PART_M = 25.0  # of that line, to whose ends distances are measured
SWEEPS = 3  # in which each leg may give way to a better one
MOST_STRETCHES = 100  # that are put in at each place: those that are worth most alone

Worth: TypeAlias = Callable[[Sequence[int]], float]  # of flying some legs, by their numbers


class Judge(NamedTuple):
    """What flights by hand are chosen by."""

    futures: Futures  # the particles that the plan was made on
    sensor: Sensor
    objective: Objective


@dataclass(frozen=True)
class Pilot:
    """How an aircraft is flown by hand."""

    law: FlightLaw
    battery: Battery
    up_s: float  # when it is at its height
    clear: Clear | None = None  # whether one may fly straight between places; None: anywhere

    def way(self, begin: Floats, legs: Sequence[Stretch]) -> Way:
        """Return what is flown of legs from a place, and the way home; it rests where it turns."""
        xy_m, rests, streets = [begin], {0}, list[str]()
        for leg in legs:
            if np.any(leg.xy_m[0] != xy_m[-1]):
                xy_m.append(leg.xy_m[0])
                streets.append("")
            rests.add(len(xy_m) - 1)
            xy_m += [*leg.xy_m[1:]]
            streets += [leg.street] * (len(leg.xy_m) - 1)
            rests.add(len(xy_m) - 1)
        hold_s = np.zeros(len(xy_m))
        hold_s[sorted(rests)] = TURN_S
        return Way(np.array(xy_m), hold_s, tuple(streets)).in_time(self.law, self.battery)

    def worth(self, way: Way, most_legs: int, judge: Judge) -> float:
        """Return what a way is worth, the more the better; -inf: it may not be flown."""
        if len(way.xy_m) < 2 or len(way.legs) > most_legs:
            return -inf
        if self.clear and not all(self.clear(a, b) for a, b in pairwise(way.xy_m)):
            return -inf
        lands = self.battery.home_m is not None
        track, _ = line_flown(way.xy_m, way.hold_s, self.law, up_s=self.up_s, lands=lands)
        figure = evaluate((track,), judge.futures, judge.sensor, judge.objective).figure
        return -figure if judge.objective.by_s is None else figure


def by_hand(
    line: Line,
    legs: int,
    pilot: Pilot,
    judge: Judge,
    network: RoadNetwork,
    progress: Progress = silent,
) -> Way:
    """Return a plan flown by hand in so many legs at most, straight ones and the way home too.

    Raises
    ------
    InputError
        If no street near the plan has a name, or none can be flown.
    """
    along = [one._replace(xy_m=_drawn(one.xy_m)) for one in _near(line, network)]

    def worth(chosen: Sequence[int]) -> float:
        way = pilot.way(line.xy_m[0], [along[k] for k in chosen])
        return pilot.worth(way, legs, judge)

    alone = np.array([worth([k]) for k in range(len(along))])
    chosen = chosen_legs(np.argsort(-alone, kind="stable").tolist(), legs, worth, progress)
    if not chosen:
        raise InputError(
            f"--by-hand {legs}: no street with a name near the plan can be flown along and home; "
            "give more legs, or a net with names"
        )
    return pilot.way(line.xy_m[0], [along[k] for k in chosen])


def chosen_legs(
    numbers: Sequence[int], many: int, worth: Worth, progress: Progress = silent
) -> list[int]:
    """Return some of the numbers in some order, so many at most, that are worth much together.

    One after the other is put in that adds most, before, between or after those that are there;
    until none adds anything. Then each in turn gives way to the best in its place, and one more is
    put in, until that is no better either.

    Parameters
    ----------
    numbers
        Those first that are worth most alone: of the others none is put in but in the place of one.
    """
    chosen, best, first = list[int](), -inf, numbers[:MOST_STRETCHES]
    for legs in range(min(many, len(numbers))):
        progress(legs, many + SWEEPS)
        value, with_one = _best(_with_one_more(chosen, first), worth)
        if value <= best:
            break
        best, chosen = value, with_one
    for sweep in range(SWEEPS):
        progress(many + sweep, many + SWEEPS)
        before = best
        for at in range(len(chosen)):
            others = [[*chosen[:at], number, *chosen[at + 1 :]] for number in numbers]
            value, changed = _best(others, worth)
            if value > best:
                best, chosen = value, changed
        if 0 < len(chosen) < many:
            value, with_one = _best(_with_one_more(chosen, first), worth)
            if value > best:
                best, chosen = value, with_one
        if best == before:
            break
    return chosen


def _with_one_more(chosen: list[int], numbers: Sequence[int]) -> list[list[int]]:
    places = range(len(chosen) + 1)
    return [[*chosen[:at], number, *chosen[at:]] for number in numbers for at in places]


def _best(tried: list[list[int]], worth: Worth) -> tuple[float, list[int]]:
    """Return the best value, and the first that has it."""
    values = [worth(one) for one in tried]
    first = int(np.argmax(values))
    return values[first], tried[first]


def _near(line: Line, network: RoadNetwork) -> list[Stretch]:
    """Return the stretches of streets between crossings near a line."""
    from scipy.spatial import KDTree

    parts = Lines(np.array([0, len(line.xy_m)]), line.xy_m).parts(PART_M)
    away_m, _ = KDTree(np.vstack([parts.start_m, parts.end_m[-1:]])).query(network.node_xy_m)
    return stretches(network, away_m <= NEAR_M)


def _drawn(xy_m: Floats) -> Floats:
    """Return a street with few corners."""
    along_m = np.append(0.0, np.cumsum(np.hypot(*np.diff(xy_m, axis=0).T)))
    return xy_m[kept_knots(along_m, xy_m, OFF_M)]
