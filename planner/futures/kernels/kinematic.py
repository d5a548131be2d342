"""A car alone on its route: limits, turns, signals, and what SUMO's driver loses there; compiled.

Nothing is random. Seconds of signals are SUMO's: a car's second of the cycle at the start, plus its
own time. SUMO moves a car in the second before a sample by what is shown in the sample's second.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets
from planner.futures.kernels.driver import (
    CRAWL_MPS,
    Driver,
    Stop,
    Stretch,
    drive_line,
    mean_speed,
    stop_before,
)
from planner.futures.kernels.motion import (
    AT,
    MOST_PIECES,
    SAME_S,
    Changes,
    Knots,
    Lines,
    Moment,
    Place,
    Trace,
    changes_for,
    drive,
    knots_for,
    lay_knots,
    longer,
    more_changes,
    note,
    point_at,
)
from planner.jit import compiled

STOP, YIELD = 0, 1  # as in `planner.network.signals`
NO_TURN = -1
NEVER_S = 1_000_000_000  # beyond any horizon: the signal never lets anybody pass


class Cars(NamedTuple):
    """The columns of ``Particles`` that say how they drive."""

    first_edge: Offsets  # (N + 1,)
    route_edge: Ints  # (M,)
    speed_mps: Floats  # (M,)
    start_m: Floats  # (N,)
    depart_s: Floats  # (N,)
    phase_s: Ints  # (N,)
    stop_s: Floats  # (N,)
    end_m: Floats  # (N,)
    flees_s: Floats  # (N,)
    flees: Floats  # (N,)


class Roads(NamedTuple):
    """What cars meet; lines are the E lanes and then the T ways through junctions."""

    first_turn: Offsets  # (E + 1,)
    turn_edge: Ints  # (T,)
    length_m: Floats  # (E + T,)
    limit_mps: Floats  # (E + T,)
    first_second: Offsets  # (T + 1,)
    shows: Ints  # (S,)
    offset_s: Ints  # (T,)
    actuated: Flags  # (T,)
    minor: Flags  # (T,)
    lines: Lines


class Scene(NamedTuple):
    """Cars, their driver and their roads, up to some second on the target's clock."""

    roads: Roads
    cars: Cars
    driver: Driver
    until_s: float


class Light(NamedTuple):
    """A signal that a car comes to."""

    turn: int
    edge: int  # before it
    phase_s: int  # SUMO's second at the car's time 0


class Route(NamedTuple):
    """Room for the lines of one route and the speeds on them."""

    line: Offsets  # (2 * edges - 1,) a lane, a way through a junction, a lane ...
    speed_mps: Floats  # at which the car drives there, evenly
    exit_mps: Floats  # the greatest at the line's end with which all that follows can be braked for
    entered_s: Floats  # when the car comes onto it


@compiled
def turn_to(roads: Roads, edge: int, onto: int) -> int:
    """Return the turn from one edge to the next, or NO_TURN."""
    for turn in range(roads.first_turn[edge], roads.first_turn[edge + 1]):
        if roads.turn_edge[turn] == onto:
            return turn
    return NO_TURN


@compiled
def lines_of(roads: Roads, cars: Cars, k: int, route: Route) -> int:
    """Fill in the lines of a car's route and return how many; it ends where no turn leads on."""
    first, edges, n = cars.first_edge[k], len(roads.first_turn) - 1, 0
    for i in range(first, cars.first_edge[k + 1]):
        edge = cars.route_edge[i]
        if i > first:
            turn = turn_to(roads, cars.route_edge[i - 1], edge)
            if turn == NO_TURN:
                break
            route.line[n] = edges + turn
            n += 1
        route.line[n] = edge
        n += 1
    return n


@compiled
def plan_speeds(scene: Scene, k: int, route: Route, count: int, factor: float) -> None:
    """Fill in the speeds on a car's lines, from the last one back.

    Parameters
    ----------
    factor
        Of limits and its own speed.
    """
    roads, cars, driver, _ = scene
    first, edges, follows_mps = cars.first_edge[k], len(roads.first_turn) - 1, np.inf
    for m in range(count - 1, -1, -1):
        line = route.line[m]
        limit_mps = factor * min(roads.limit_mps[line], cars.speed_mps[first + m // 2])
        route.speed_mps[m] = mean_speed(driver, limit_mps)
        exit_mps = min(follows_mps, route.speed_mps[m])
        if m + 1 < count and line < edges and roads.minor[route.line[m + 1] - edges]:
            exit_mps = min(exit_mps, driver.yields_mps)
        route.exit_mps[m] = exit_mps
        follows_mps = np.sqrt(exit_mps * exit_mps + 2.0 * driver.decel * roads.length_m[line])
        follows_mps = min(follows_mps, route.speed_mps[m])


@compiled
def shown_at(roads: Roads, turn: int, second: int) -> int:
    """Return what a turn's signal shows in a second."""
    first = roads.first_second[turn]
    cycle_s = roads.first_second[turn + 1] - first
    return int(roads.shows[first + (second - roads.offset_s[turn]) % cycle_s])


@compiled
def waits_s(roads: Roads, turn: int, second: int) -> int:
    """Return how many seconds a signal stops cars from a second on."""
    for wait_s in range(roads.first_second[turn + 1] - roads.first_second[turn]):
        if shown_at(roads, turn, second + wait_s) != STOP:
            return wait_s
    return NEVER_S


@compiled
def second_of(time_s: float, phase_s: int) -> int:
    """Return the second whose signals move a car at a time."""
    return int(np.floor(time_s)) + 1 + phase_s


@compiled
def is_prolonged(scene: Scene, light: Light, stop: Stop, to_m: float) -> bool:
    """Return whether an actuated signal still shows green when a car comes by its detector."""
    if not scene.roads.actuated[light.turn]:
        return False
    detector_m = to_m - min(scene.driver.detector_s * scene.roads.limit_mps[light.edge], to_m)
    sooner_m = max(stop.at_m - detector_m, 0.0)
    passes_s = stop.time_s - sooner_m / max(stop.speed_mps, CRAWL_MPS)
    return shown_at(scene.roads, light.turn, second_of(passes_s, light.phase_s)) != STOP


@compiled
def drive_to_signal(
    trace: Trace, scene: Scene, place: Place, stretch: Stretch, moment: Moment, light: Light
) -> tuple[Place, Moment]:
    """Drive to a stop line, and wait there for green if need be."""
    lines, driver = scene.roads.lines, scene.driver
    stop = stop_before(driver, place, stretch, moment)
    decides_s = stop.time_s + driver.late_s
    second = second_of(decides_s, light.phase_s)
    wait_s = waits_s(scene.roads, light.turn, second)
    if wait_s > 0 and is_prolonged(scene, light, stop, stretch.to_m):
        wait_s = 0
    onward = stretch
    if shown_at(scene.roads, light.turn, second + wait_s) == YIELD:
        exit_mps = min(stretch.exit_mps, driver.yields_mps)
        onward = Stretch(stretch.to_m, stretch.even_mps, exit_mps)
    if wait_s == 0:
        return drive_line(trace, lines, driver, place, onward, moment)
    green_s = np.floor(decides_s) + wait_s - driver.early_s
    to_brake = Stretch(max(stop.at_m, place.at_m), stretch.even_mps, stop.speed_mps)
    place, moment = drive_line(trace, lines, driver, place, to_brake, moment)
    rest_m = stretch.to_m - place.at_m
    stops_s = moment.time_s + 2.0 * rest_m / max(moment.speed_mps, CRAWL_MPS)
    if green_s >= stops_s or rest_m <= 0.0:
        to_line = Stretch(stretch.to_m, stretch.even_mps, 0.0)
        place, moment = drive_line(trace, lines, driver, place, to_line, moment)
        green_s = max(green_s, moment.time_s)
        x_m, y_m = point_at(lines, place.point, stretch.to_m)
        note(trace, x_m, y_m, green_s)
        return place, Moment(green_s, 0.0)
    time_s, speed_mps = moment
    brakes_s = green_s - time_s
    if brakes_s > 0.0:
        decel = speed_mps * speed_mps / (2.0 * rest_m)
        to_m = place.at_m + brakes_s * (speed_mps - 0.5 * decel * brakes_s)
        place, time_s = drive(trace, lines, place, to_m, moment, -decel)
        speed_mps = max(speed_mps - decel * brakes_s, 0.0)
    return drive_line(trace, lines, driver, place, onward, Moment(time_s, speed_mps))


@compiled
def first_place(lines: Lines, line: int, at_m: float) -> Place:
    """Return a place on a lane."""
    point, last = lines.first_point[line] + 1, lines.first_point[line + 1] - 1
    while point < last and lines.points[point, AT] <= at_m:
        point += 1
    return Place(point, at_m)


@compiled
def drive_car(trace: Trace, scene: Scene, k: int, route: Route) -> tuple[Trace, int]:
    """Note where one car comes by and when it enters each line.

    Returns
    -------
    trace, entered
        The trace, which may have grown, and how many lines it enters in time.
    """
    roads, cars, driver, until_s = scene
    lines, edges = roads.lines, len(roads.first_turn) - 1
    count = lines_of(roads, cars, k, route)
    flees = cars.flees_s[k] > 0.0
    plan_speeds(scene, k, route, count, cars.flees[k] if flees else 1.0)
    length_m = roads.length_m[route.line[0]]
    place = first_place(lines, route.line[0], min(max(cars.start_m[k], 0.0), length_m))
    brakes2 = 2.0 * driver.decel * (length_m - place.at_m)
    speed_mps = min(route.speed_mps[0], np.sqrt(route.exit_mps[0] ** 2 + brakes2))
    moment = Moment(cars.depart_s[k], speed_mps)
    trace.used[0] = 0
    x_m, y_m = point_at(lines, place.point, place.at_m)
    note(trace, x_m, y_m, moment.time_s)
    for m in range(count):
        if moment.time_s >= until_s and m > 0:
            return trace, m
        line = route.line[m]
        route.entered_s[m] = moment.time_s
        if flees and moment.time_s >= cars.depart_s[k] + cars.flees_s[k]:
            flees = False
            plan_speeds(scene, k, route, count, 1.0)
            brakes2 = 2.0 * driver.decel * roads.length_m[line]
            slower_mps = min(route.speed_mps[m], np.sqrt(route.exit_mps[m] ** 2 + brakes2))
            moment = Moment(moment.time_s, min(moment.speed_mps, slower_mps))
        points = lines.first_point[line + 1] - lines.first_point[line]
        trace = longer(trace, points + 4 * MOST_PIECES)
        if m > 0:
            place = Place(lines.first_point[line] + 1, 0.0)
        to_m = roads.length_m[line]
        if m + 1 == count:
            to_m = max(place.at_m, min(to_m, cars.end_m[k]))
        stretch = Stretch(to_m, route.speed_mps[m], route.exit_mps[m])
        turn = route.line[m + 1] - edges if line < edges and m + 1 < count else NO_TURN
        if turn != NO_TURN and roads.first_second[turn + 1] > roads.first_second[turn]:
            light = Light(turn, line, cars.phase_s[k])
            place, moment = drive_to_signal(trace, scene, place, stretch, moment, light)
        else:
            place, moment = drive_line(trace, lines, driver, place, stretch, moment)
    return trace, count


@compiled
def lay_changes(scene: Scene, route: Route, entered: int, changes: Changes, used: int) -> int:
    """Lay a car's changes of edge and return how many there are then.

    The inside of a junction counts to the edge after it.
    """
    first, edges = used, len(scene.roads.first_turn) - 1
    for m in range(entered):
        line = route.line[m]
        if m > 0 and line < edges:
            continue  # it has come onto it with the junction before
        edge = scene.roads.turn_edge[line - edges] if line >= edges else line
        if used > first and route.entered_s[m] <= changes.time_s[used - 1] + SAME_S:
            used -= 1  # it has passed that one in no time
        changes.time_s[used] = route.entered_s[m]
        changes.edge[used] = edge
        used += 1
    return used


@compiled
def drive_cars(scene: Scene, tolerance_m: float) -> tuple[Knots, Offsets, Changes, Offsets]:
    """Return the knots and changes of edge of all cars, and where each one's start.

    The columns have room left at their ends.
    """
    cars, until_s = scene.cars, scene.until_s
    n = len(cars.start_m)
    longest = 1
    for k in range(n):
        longest = max(longest, cars.first_edge[k + 1] - cars.first_edge[k])
    room = 2 * longest
    route = Route(np.empty(room, np.int64), np.empty(room), np.empty(room), np.empty(room))
    trace = Trace(np.empty((1024, 3)), np.zeros(1, np.int64))
    knots, changes = knots_for(1024 + 64 * n), changes_for(1024 + 16 * n)
    first_knot, first_change = np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64)
    laid, changed = 0, 0
    for k in range(n):
        if cars.first_edge[k + 1] > cars.first_edge[k] and cars.depart_s[k] <= until_s:
            trace, entered = drive_car(trace, scene, k, route)
            ends_s = min(until_s, cars.stop_s[k])
            knots, laid = lay_knots(trace, knots, laid, ends_s, tolerance_m)
            changes = more_changes(changes, changed, entered)
            while entered > 1 and route.entered_s[entered - 1] >= cars.stop_s[k]:
                entered -= 1
            changed = lay_changes(scene, route, entered, changes, changed)
        first_knot[k + 1], first_change[k + 1] = laid, changed
    return knots, first_knot, changes, first_change
