"""Free flights grown by a beam over a space-time cell index: it turns anywhere, and hovers.

Cells are as wide as the sensor sees, a tick is as long as the UAV needs to cross one. What is tried
from a place is measured in them, so that the same constants serve a town and a country.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats
from planner.detection.first_detection import columns
from planner.flight.legs import unit
from planner.futures.futures import Futures
from planner.search.beam import bytes_of
from planner.search.kernels.cell_beam import (
    BEST,
    FIGURES,
    PARENT,
    RAYS,
    REWARD,
    SLOT,
    CellStates,
    Crowd,
    Field,
    Rays,
    Setting,
    fly_ray,
    grow_tick,
    nobody_seen,
    note_unseen,
    pack_unseen,
)
from planner.search.kernels.cell_index import SEEN, CellIndex, cell_index
from planner.search.kernels.cells import Slabs
from planner.search.kernels.motion import Course
from planner.search.plan import plan_of_waypoints
from planner.search.problem import Problem
from planner.search.sightings import seen_by
from planner.search.stop import never
from planner.search.what_if import goal_of, rows_of, turning_of

HEADINGS = 16
STOPS = (1, 2, 3, 4, 6, 8, 11, 16)  # after how many ticks of a flight it may turn
LEAST_TICKS, MOST_TICKS = 20, 1000  # they are longer where there were more
PLACES = 64  # headings suffice where there are more nodes
# Of a tick's states goes on one in each square of the sensor's radius, and so many in each of so
# many radii: else all were soon in the same corner of the net.
DENSE, WIDE_RADII = 3, 16.0
NEVER = 2**31 - 1  # ticks


@dataclass(frozen=True)
class CellBeam:
    """How a beam of free flights searches."""

    width: int  # states that go on from each tick
    headings: int = HEADINGS
    stops: tuple[int, ...] = STOPS
    places: int = PLACES  # nodes that are flown to as well; none where there are more
    apart_radii: float = 1.0  # of two states that go on, in the sensor's radius
    dense: int = DENSE  # states in a square of `WIDE_RADII`


@dataclass(frozen=True, eq=False)
class FreeFlight:
    """A chain of straight flights, and what it earns."""

    waypoints: Floats  # (W, 3) x and y in metres, seconds of hovering there
    reward: float  # on the particles that it was made on
    rays: int  # flown to find it


class Cells:
    """Where particles are by cell and tick; any number of beams share it.

    Parameters
    ----------
    particles
        The futures to search on: the problem's own, or others of the same target.
    weight
        How likely each is, and unseen when the search starts, (N,).
    ticks
        At most so many.
    """

    def __init__(self, problem: Problem, particles: Futures, weight: Floats, ticks: int) -> None:
        self.problem, self._particles = problem, particles
        uav, radius_m = problem.uav_at_start, float(problem.sensor.radius_m)
        lasts_s = max(problem.objective.ends_s - uav.take_off_s, 1e-3)
        tick_s = max(2.0 * radius_m / uav.speed_mps, lasts_s / ticks)
        self.ticks = Slabs(float(uav.take_off_s), tick_s, int(np.ceil(lasts_s / tick_s)) + 1)
        self.index: CellIndex = cell_index(
            columns(particles),
            rows_of(particles.pieces),
            weight.copy(),
            self.ticks,
            (radius_m, float(problem.sensor.rate_per_s)),
            goal_of(problem, particles),
        )

    @classmethod
    def of(cls, problem: Problem, rays: float = np.inf) -> "Cells":
        """Return those of the particles to search on: proposals if there are any, else its own.

        Parameters
        ----------
        rays
            How many may be flown: where they are few, ticks are longer.
        """
        ticks = int(min(MOST_TICKS, max(LEAST_TICKS, rays / (HEADINGS + 1))))
        if problem.proposals is not None and problem.start is None:
            return cls(problem, problem.proposals, problem.proposals.weight, ticks)
        return cls(problem, problem.futures, problem.weight_at_start, ticks)

    def some(self, many: int, ticks: int) -> "Cells":
        """Return those of so many unseen particles at most, chosen by chance, in so many ticks."""
        weight = self.index.weight
        unseen = np.flatnonzero(weight > 0.0)
        # Not every so manieth: of a Sobol sequence such a part leaves whole regions out.
        few = np.sort(np.random.default_rng(0).permutation(unseen)[:many])
        share = weight[few] * (weight.sum() / max(weight[few].sum(), 1e-300))
        return Cells(self.problem, self._particles.take(few), share, ticks)

    def brings(self, flight: FreeFlight) -> Floats:
        """Return the reward per unit of unseen weight that a flight brings after each tick."""
        tracks = plan_of_waypoints(self.problem, "", flight.waypoints).tracks
        times_s = self.ticks.begin_s + self.ticks.lasts_s * np.arange(float(self.ticks.many))
        seen = seen_by(self.problem, tracks, self._particles, self.index.weight)
        return seen.brings(np.asarray(times_s))

    @property
    def middle_m(self) -> Floats:
        """The middle of where particles are, (2,) metres."""
        box = self.index.box
        across_m = box.size_m * np.array([box.columns, box.rows])
        return np.array([box.west_m, box.south_m]) + 0.5 * across_m

    @property
    def side_m(self) -> float:
        """The side of a square that holds all particles, metres."""
        return float(self.index.box.size_m * max(self.index.box.columns, self.index.box.rows))

    @property
    def field(self) -> Field:
        """Where and until when may be flown: where particles are, and from the start to there."""
        box, uav = self.index.box, self.problem.uav_at_start
        home_x_m, home_y_m = (np.inf, np.inf) if uav.return_to_m is None else uav.return_to_m
        return Field(
            float(min(box.west_m, uav.x_m)),
            float(min(box.south_m, uav.y_m)),
            float(max(box.west_m + box.columns * box.size_m, uav.x_m)),
            float(max(box.south_m + box.rows * box.size_m, uav.y_m)),
            float(home_x_m),
            float(home_y_m),
            max(1e-9, float(uav.home_mps)),
            float(uav.turns_home_s),
            float(uav.landing_s),
            float(self.problem.objective.ends_s),
        )

    def rays_of(self, beam: CellBeam) -> int:
        """Return about how many rays a beam of that kind flies."""
        places = _places(self.problem, beam)
        far_m = beam.stops[-1] * self.ticks.lasts_s * self.problem.uav.speed_mps
        apart_m = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
        near = int((apart_m <= far_m).sum() / max(1, len(places)))
        return self.ticks.many * beam.width * (beam.headings + 1 + near)


def fly_beam(
    cells: Cells,
    beam: CellBeam,
    first_m: tuple[float, float] | None = None,
    *,
    like: FreeFlight | None = None,
    stop: Callable[[], bool] = never,
    most: float = np.inf,
) -> FreeFlight:
    """Return the flight with the greatest reward that a beam finds.

    Parameters
    ----------
    first_m
        Where every flight goes first, x and y in metres; anywhere if not given.
    like
        A flight that tells what unseen particles usually bring later; without one, only what has
        been earned counts.
    stop
        Asked between ticks; once it says so, the best flight so far is returned.
    most
        After how many rays that is returned too.
    """
    setting = _setting(cells, beam)
    states = _first_states(cells, setting, first_m)
    brings = np.zeros(cells.ticks.many) if like is None else cells.brings(like)
    for tick in range(cells.ticks.many):
        if states.heads[tick] < 0:
            continue
        if states.counts[RAYS] >= most or stop():
            break
        states = grow_tick(tick, states, setting, float(brings[tick]))
    best = int(states.counts[BEST])
    return FreeFlight(
        _waypoints(states, best), float(states.figures[REWARD, best]), int(states.counts[RAYS])
    )


def _setting(cells: Cells, beam: CellBeam) -> Setting:
    """Return what a beam moves in, as its kernel takes it."""
    law, radius_m = cells.problem.legs.law, float(cells.problem.sensor.radius_m)
    angle = 2.0 * np.pi * np.arange(beam.headings) / beam.headings
    ways = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    velocity = law.over_ground_mps(ways)[:, None] * ways
    rays = Rays(
        np.vstack([velocity, np.zeros((1, 2))]),
        np.array(beam.stops),
        _places(cells.problem, beam),
        turning_of(law),
    )
    apart_m = max(beam.apart_radii * radius_m, 1e-6)
    crowd = Crowd(beam.width, apart_m, max(WIDE_RADII * radius_m, 1e-6), beam.dense)
    return Setting(cells.index, rays, cells.field, crowd)


def _places(problem: Problem, beam: CellBeam) -> Floats:
    """Return the places that are flown to from anywhere near, (V, 2) metres: nodes, if few."""
    nodes = problem.network.node_xy_m
    return nodes.copy() if len(nodes) <= beam.places else np.empty((0, 2))


def _first_states(
    cells: Cells, setting: Setting, first_m: tuple[float, float] | None
) -> CellStates:
    """Return the state before take-off, or the one after it at a place that is flown to first."""
    uav, weight = cells.problem.uav_at_start, cells.index.weight
    links, figures = np.full((3, 64), -1, np.int32), np.zeros((FIGURES, 64))
    figures[:, 0] = uav.take_off_s, uav.x_m, uav.y_m, 0.0, weight.sum(), uav.take_off_s
    links[SLOT, 0] = 0
    masks = np.zeros((64, bytes_of(cells.problem, np.ones(len(weight)))), np.uint8)
    looked = nobody_seen(len(weight), not cells.problem.sensor.is_perfect)
    looked.seen_in[weight <= 0.0] = SEEN
    if len(looked.miss):
        looked.miss[:] = weight > 0.0
    pack_unseen(looked, masks[0])
    heads = np.full(cells.ticks.many, -1, np.int32)
    states = CellStates(links, figures, masks, heads, np.array([1, 1, 0, 0]))
    offset = np.subtract((uav.x_m, uav.y_m) if first_m is None else first_m, (uav.x_m, uav.y_m))
    if not offset.any():
        heads[0] = 0
        return states
    law, way = cells.problem.legs.law, unit(offset)
    lasts_s = float(np.hypot(*offset) / law.over_ground_mps(way))
    begin_s = float(uav.take_off_s + law.corner_loss_s(np.zeros(2), way))
    straight = setting._replace(rays=setting.rays._replace(stops=np.array([NEVER])))
    note_unseen(0, states, cells.index, looked)
    vx, vy = (offset / lasts_s).tolist()
    course = Course(float(uav.x_m), float(uav.y_m), vx, vy, begin_s)
    fly_ray(course, lasts_s, 0, states, looked, straight)
    return states


def _waypoints(states: CellStates, state: int) -> Floats:
    """Return the way to a state, (W, 3): x, y, seconds of hovering."""
    way: list[list[float]] = []
    while (parent := int(states.links[PARENT, state])) >= 0:
        (time_s, x_m, y_m, *_, since_s), (_, *before_m) = (
            states.figures[:, one].tolist() for one in (state, parent)
        )
        hovers = before_m[:2] == [x_m, y_m]
        wait_s = time_s - since_s if hovers else 0.0
        if way and way[-1][:2] == [x_m, y_m]:
            way[-1][2] += wait_s
        else:
            way.append([x_m, y_m, wait_s])
        state = parent
    return np.array(way[::-1]).reshape(-1, 3)
