"""A portfolio of free flights that first dash somewhere: in a big town the basin decides.

A beam sweeps what is near first, as that earns at once. Where targets leave, a flight that first
overtakes them may earn more in the end. So a narrow beam is grown behind each of many first
dashes, on some of the particles; behind the best of them a wider one, on all.
"""

from collections.abc import Callable, Sequence

import numpy as np

from planner.search.cell_flights import CellBeam, Cells, FreeFlight, fly_beam
from planner.search.problem import Problem

# A unit of work is a leg: some microseconds on a net of few roads, a hundred in a town. A ray takes
# ten to seventy.
RAYS_PER_UNIT, IN_TOWNS = 0.25, 4.0
HEADINGS, STRIDE = 16, 5  # headings of dashes; which follows which, so that the first ones differ
LENGTHS = (1 / 8, 1 / 4, 3 / 8)  # of dashes, in sides of the square that holds all particles
LATTICE = 6  # places either way in that square, which are flown to from outside
SCOUTS = 2500  # particles that narrow beams are grown on
SCOUTING = 0.5  # share of the work that goes into narrow beams
FINALISTS = 3
FEW = 6  # dashes: for fewer it is not worth to scout

Place = tuple[float, float]  # metres east and north


def portfolio(
    problem: Problem,
    work: int,
    *,
    stop: Callable[[], bool] = bool,
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
    cells = Cells.of(problem, rays)
    goals, spent = _scouted(cells, int(SCOUTING * rays), stop)
    flights: list[FreeFlight] = []
    for number, goal in enumerate(goals):
        mine = (rays - spent) // (len(goals) - number)
        beam = CellBeam(max(1, mine // cells.rays_of(CellBeam(1))))
        flights.append(fly_beam(cells, beam, goal, stop=stop, most=mine))
        spent += flights[-1].rays
        reached(max(flight.reward for flight in flights), int(spent / per_unit))
    return flights, int(spent / per_unit)


def _scouted(
    cells: Cells, rays: int, stop: Callable[[], bool]
) -> tuple[Sequence[Place | None], int]:
    """Return where the most promising flights go first, and the rays flown to find out."""
    beam, spent = CellBeam(1), 0
    everywhere = dashes(cells)
    goals = everywhere[: rays // cells.rays_of(beam)]
    if len(goals) < FEW:
        return everywhere[:1], 0
    few, found = cells.some(SCOUTS), []
    for goal in goals:
        flight = fly_beam(few, beam, goal, stop=stop)
        spent += flight.rays
        found.append(flight.reward)
    best = np.argsort(-np.array(found), kind="stable")[:FINALISTS]
    return [goals[dash] for dash in best], spent


def dashes(cells: Cells) -> Sequence[Place | None]:
    """Return where flights may go first, in metres; None: anywhere.

    Around a start among the particles, in evenly spread headings and several lengths, such that
    the first few differ. From outside it is places where particles are, the middle one first.
    """
    field, uav = cells.field, cells.problem.uav_at_start
    middle, side_m = cells.middle_m, cells.side_m
    start = np.array([uav.x_m, uav.y_m])
    if np.abs(start - middle).max() > (0.5 + LENGTHS[0]) * side_m:
        share = (np.arange(LATTICE) + 0.5) / LATTICE - 0.5
        goals = middle + side_m * np.stack(np.meshgrid(share, share), axis=-1).reshape(-1, 2)
        nearest = np.argsort(np.abs(goals - middle).sum(axis=1), kind="stable")
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
