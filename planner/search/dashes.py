"""A portfolio of free flights that first dash somewhere: in a big town the basin decides.

A beam sweeps what is near first, as that earns at once. Where targets leave, a flight that first
overtakes them may earn more in the end. So a narrow beam is grown behind each of many first
dashes, on some of the particles; behind the best of them a wider one, on all.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from planner.search.cell_flights import CellBeam, Cells, FreeFlight, fly_beam
from planner.search.problem import Problem
from planner.search.stop import never

# A unit of work is a leg: some microseconds on a net of few roads, a hundred in a town. A ray takes
# ten to seventy.
RAYS_PER_UNIT, IN_TOWNS = 0.25, 2.0
HEADINGS, STRIDE = 16, 5  # headings of dashes; which follows which, so that the first ones differ
LENGTHS = (1 / 8, 1 / 4, 3 / 8)  # of dashes, in sides of the square that holds all particles
LATTICE = 5  # places either way in that square, which are flown to from outside
SCOUTS, SCOUT_TICKS = 2500, 60  # particles that narrow beams are grown on; ticks, at least
SCOUTING = 0.5  # share of the work that goes into narrow beams
FINALISTS = 3
FEW, LEAST_RAYS = 6, 20_000  # dashes, and rays in all: with fewer it is not worth to scout

Place = tuple[float, float]  # metres east and north


def portfolio(
    problem: Problem,
    work: int,
    *,
    stop: Callable[[], bool] = never,
    reached: Callable[[float, int], None] = lambda _reward, _work: None,
) -> tuple[list[FreeFlight], int]:
    """Return the best flights behind a few first dashes, chosen from many, and the work it took.

    Parameters
    ----------
    work
        Units that it may take, about.
    stop
        Asked often; once it says so, the best flights so far are returned.
    reached
        Given the greatest reward so far and the work done, whenever a wide beam ends.
    """
    per_unit = RAYS_PER_UNIT if problem.network.is_abstract else IN_TOWNS
    rays = max(1, int(per_unit * work))
    scouting = int(SCOUTING * rays) if rays >= LEAST_RAYS else 0
    cells = Cells.of(problem, (rays - scouting) / FINALISTS if scouting else rays)
    found, spent = _scouted(cells, scouting, stop)
    flights: list[FreeFlight] = []
    for number, (goal, like) in enumerate(found):
        mine = (rays - spent) // (len(found) - number)
        beam = CellBeam(max(1, mine // cells.rays_of(CellBeam(1))))
        flights.append(fly_beam(cells, beam, goal, like=like, stop=stop, most=mine))
        spent += flights[-1].rays
        reached(max(flight.reward for flight in flights), int(spent / per_unit))
    return flights, int(spent / per_unit)


class Scouted(NamedTuple):
    """A first dash, and a flight that begins with it."""

    goal: Place | None
    flight: FreeFlight | None


def _scouted(cells: Cells, rays: int, stop: Callable[[], bool]) -> tuple[list[Scouted], int]:
    """Return the most promising dashes, and the rays flown to find out."""
    goals, beam = dashes(cells), CellBeam(1)
    per_tick = cells.rays_of(beam) / cells.ticks.many
    ticks = int(max(SCOUT_TICKS, min(cells.ticks.many, rays / (len(goals) * per_tick))))
    goals = goals[: int(rays / (ticks * per_tick))]
    if len(goals) < FEW:
        return [Scouted(dashes(cells)[0], None)], 0
    few = cells.some(SCOUTS, ticks)
    flights = [fly_beam(few, beam, goal, stop=stop) for goal in goals]
    rank = np.argsort([-flight.reward for flight in flights], kind="stable").tolist()
    # To go nowhere first is always among them: most often it is best, and scouts are short-sighted.
    best = sorted(rank, key=lambda dash: goals[dash] is not None)[:FINALISTS]
    spent = sum(flight.rays for flight in flights)
    return [Scouted(goals[dash], flights[dash]) for dash in best], spent


def dashes(cells: Cells) -> Sequence[Place | None]:
    """Return where flights may go first, in metres; None: anywhere.

    Around a start among the particles, in evenly spread headings and several lengths, such that
    the first few differ. From outside it is places all over where particles are, the nearest first.
    """
    field, uav = cells.field, cells.problem.uav_at_start
    side_m, start = cells.side_m, np.array([uav.x_m, uav.y_m])
    away_m = np.abs(start - cells.middle_m).max() - 0.5 * side_m
    if away_m > LENGTHS[0] * side_m:
        share = (np.arange(LATTICE) + 0.5) / LATTICE - 0.5
        places = np.stack(np.meshgrid(share, share), axis=-1).reshape(-1, 2) * side_m
        goals = cells.middle_m + places
        nearest = np.argsort(np.hypot(*(goals - start).T), kind="stable")
        return [(float(x_m), float(y_m)) for x_m, y_m in goals[nearest]]
    angle = 2.0 * np.pi * (np.arange(HEADINGS) * STRIDE % HEADINGS) / HEADINGS
    ways = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    goals = np.concatenate([start + np.outer(np.array(LENGTHS) * side_m, way) for way in ways])
    inside = [
        (float(x_m), float(y_m))
        for x_m, y_m in goals
        if field.low_x_m <= x_m <= field.high_x_m and field.low_y_m <= y_m <= field.high_y_m
    ]
    return [None, *inside]
