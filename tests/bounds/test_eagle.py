"""Eagle's search problem (Operations Research 32, 1984) flown on a net of cells.

Nine cells in three rows. The target starts in cell 9 and, after each look, stays with probability
0.4 or moves to one of the adjacent cells, all equally likely. The searcher looks into its own cell
or into an adjacent one of where it looked last, and finds what is there.

The published optima, for ten looks, come out of an exact enumeration below. The planner gets the
same problem with fewer looks, for then all paths of the target can be its particles, each with its
probability: cells are nodes, a road to each neighbour and one back into the cell take the UAV as
long as there is between two looks. A particle is at its cell's node for a moment at each look, and
far away in between; the sensor looks along roads only. Other flights come to no look in time.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from planner.arrays import Floats
from planner.bounds.certificate import Effort, certified
from planner.detection.evaluate import evaluate
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from planner.search.stop import WorkDone
from support.instances import network_of_roads

CELLS, FIRST = 9, 8  # cells count from 0 here; the target starts in the last
STAYS = 0.4
PUBLISHED = (0.7786, 0.8631, 0.8631, 0.8631, 0.8631, 1.0, 0.8631, 1.0, 1.0)  # by start cell
PITCH_M, SPEED_MPS, RADIUS_M = 15_000.0, 100.0, 1000.0
LOOK_S = PITCH_M / SPEED_MPS  # from one look to the next
THERE_S = 5.0  # before and after a look
JUMP_S = 1e-6
AWAY_M = (1e6, 3.7e5)  # the straight way there passes no other cell


def beside(cell: int) -> list[int]:
    """Adjacent cells."""
    row, column = divmod(cell, 3)
    near = [(row - 1, column), (row, column - 1), (row, column + 1), (row + 1, column)]
    return [3 * r + c for r, c in near if 0 <= r < 3 and 0 <= c < 3]


def moves() -> Floats:
    """Probability of the next cell by cell, (9, 9)."""
    chances = STAYS * np.eye(CELLS)
    for cell in range(CELLS):
        chances[cell, beside(cell)] = (1.0 - STAYS) / len(beside(cell))
    return chances


def best_search(start: int, looks: int, detects: float = 1.0) -> tuple[float, list[int]]:
    """Greatest probability of detection, and where it looks, from all paths of the searcher."""
    at = [start]
    missed, paths = {start: np.eye(CELLS)[[FIRST]]}, {start: np.array([at])}
    for look in range(looks):
        reached: dict[int, list[Floats]] = {cell: [] for cell in range(CELLS)}
        passed: dict[int, list[Floats]] = {cell: [] for cell in range(CELLS)}
        for cell, mass in missed.items():
            for onto in (cell, *beside(cell)):
                left = mass.copy()
                left[:, onto] *= 1.0 - detects
                reached[onto].append(left @ moves() if look + 1 < looks else left)
                passed[onto].append(np.insert(paths[cell], look + 1, onto, axis=1))
        missed = {cell: np.concatenate(masses) for cell, masses in reached.items() if masses}
        paths = {cell: np.concatenate(passed[cell]) for cell in missed}
    found = [(1.0 - mass.sum(axis=1), paths[cell]) for cell, mass in missed.items()]
    chance, path = max(
        ((float(chances.max()), some[chances.argmax()].tolist()) for chances, some in found),
        key=lambda pair: pair[0],
    )
    return chance, path


def target_paths(looks: int) -> tuple[Floats, Floats]:
    """Return all paths of the target, (paths, looks) cells, and their probabilities."""
    paths, weight, chances = np.full((1, 1), FIRST), np.ones(1), moves()
    for _ in range(looks - 1):
        some = [(onto, np.flatnonzero(chances[paths[:, -1], onto])) for onto in range(CELLS)]
        weight = np.concatenate([weight[who] * chances[paths[who, -1], onto] for onto, who in some])
        paths = np.concatenate(
            [np.insert(paths[who], paths.shape[1], onto, 1) for onto, who in some]
        )
    return paths, weight


def cells() -> RoadNetwork:
    """A node per cell, a road between neighbours, and one from each back to itself."""
    names = {f"c{cell}": (cell % 3 * PITCH_M, -(cell // 3) * PITCH_M) for cell in range(CELLS)}
    pairs = [(a, b) for a in range(CELLS) for b in [a, *beside(a)] if a <= b]
    net = network_of_roads(names, [(f"c{a}c{b}", f"c{a}", f"c{b}") for a, b in pairs])
    shapes = []
    for road, (a, b) in enumerate(pairs):
        ends = net.shape(road)
        turn = ends[:1] + PITCH_M / 2 * np.array([[0.6, 0.8]])
        shapes.append(ends if a != b else np.vstack([ends[:1], turn, ends[1:]]))
    first_point = np.concatenate(([0], np.cumsum([len(shape) for shape in shapes])))
    return replace(net, first_point=first_point, shape_xy_m=np.concatenate(shapes))


def cell_problem(start: int, looks: int) -> Problem:
    net = cells()
    paths, weight = target_paths(looks)
    many, away = len(paths), np.array(AWAY_M)
    # Away, there at the look, away again: two knots in a moment where it jumps.
    at_s = LOOK_S * np.arange(1, looks + 1)
    comes_s, goes_s = at_s - THERE_S, at_s + THERE_S
    time_s = np.stack([comes_s - JUMP_S, comes_s, goes_s, goes_s + JUMP_S], axis=1)
    place = np.broadcast_to(away, (many, looks, 4, 2)).copy()
    place[:, :, 1] = place[:, :, 2] = net.node_xy_m[paths]
    futures = Futures(
        time_s=np.tile(time_s.ravel(), many),
        x_m=place[..., 0].ravel(),
        y_m=place[..., 1].ravel(),
        first_knot=4 * looks * np.arange(many + 1),
        weight=weight,
        gone=np.zeros(many, dtype=bool),
    )
    until_s = (looks + 0.5) * LOOK_S
    uav = Uav(*net.node_xy_m[start], 0.0, SPEED_MPS)
    return Problem(net, futures, uav, Sensor(RADIUS_M, False), Objective(until_s, until_s))


def legs_through(problem: Problem, path: list[int]) -> list[int]:
    ends = zip(problem.legs.from_node.tolist(), problem.legs.to_node.tolist(), strict=True)
    leg = {pair: i for i, pair in enumerate(ends)}
    return [leg[pair] for pair in pairwise(path)]


@pytest.mark.parametrize("start", range(CELLS))
def test_the_published_optima(start: int) -> None:
    assert best_search(start, 10)[0] == pytest.approx(PUBLISHED[start], abs=5.1e-5)


@pytest.mark.parametrize("looks", [2, 3, 4, 5, 6])
@pytest.mark.parametrize("start", [0, 1, 4, 5])
def test_the_bound_meets_the_optimum(start: int, looks: int) -> None:
    """The flown plan is worth what the enumeration says, and the bound comes down to that."""
    chance, path = best_search(start, looks)
    problem = cell_problem(start, looks)
    plan = plan_of_legs(problem, "", legs_through(problem, path))
    certificate = certified(problem, plan, Effort(stop=WorkDone(3000)))
    assert certificate.value == pytest.approx(chance, abs=1e-9)
    assert chance - 1e-9 <= certificate.bound <= chance + 0.002


@pytest.mark.parametrize(("detects", "best"), [(1.0, 0.703437), (0.7, 0.565590)])
def test_looks_that_miss(detects: float, best: float) -> None:
    """A look is a contact of ten seconds: the flown plan finds as probably as enumeration says."""
    chance, path = best_search(0, 8, detects)
    assert chance == pytest.approx(best, abs=5.1e-7)
    problem = cell_problem(0, 8)
    rate_per_s = np.inf if detects == 1.0 else -np.log1p(-detects) / (2.0 * THERE_S)
    sensor = replace(problem.sensor, rate_per_s=rate_per_s)
    # One cell more, so that the last look lasts as long as the others.
    (track,) = plan_of_legs(problem, "", legs_through(problem, [*path, path[-1]])).tracks
    flown = evaluate([track], problem.futures, sensor, problem.objective)
    assert flown.figure == pytest.approx(chance, abs=1e-6)  # where it jumps it is not quite away
