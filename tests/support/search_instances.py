"""Random problems for the planners: curved roads, targets on and off them, states in between."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from planner.arrays import Floats
from planner.detection.evaluate import evaluate
from planner.detection.first_detection import first_detection
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.uav import Uav
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork
from planner.search.plan import plan_of_legs
from planner.search.problem import Problem
from planner.search.state import SearchState
from support.instances import figure1, figure3, grid, network_of_roads, physics_futures


def random_network(rng: np.random.Generator, *, nodes: int = 7, roads: int = 10) -> RoadNetwork:
    """Roads between random nodes, some of them with bends."""
    names = [f"n{i}" for i in range(nodes)]
    places = {name: tuple(rng.uniform(0, 12000, 2)) for name in names}
    pairs = [rng.choice(nodes, 2, replace=False) for _ in range(roads)]
    net = network_of_roads(
        places, [(f"e{i}", names[a], names[b]) for i, (a, b) in enumerate(pairs)]
    )
    shapes = [
        np.vstack([net.shape(road)[:1], rng.uniform(0, 12000, (bends, 2)), net.shape(road)[1:]])
        for road, bends in enumerate(rng.integers(0, 3, roads))
    ]
    return replace(
        net,
        first_point=np.concatenate(([0], np.cumsum([len(shape) for shape in shapes]))),
        shape_xy_m=np.concatenate(shapes),
    )


def driven(net: RoadNetwork, rng: np.random.Generator, count: int) -> Futures:
    """Targets that drive at constant speed where roads lead them, some stopping, some vanishing."""
    routes = []
    for _ in range(count):
        route = [int(rng.integers(len(net.road_ids)))]
        while len(route) < 5 and len(net.turns(route[-1])) > 0:
            route.append(int(rng.choice(net.turns(route[-1]))))
        routes.append([net.road_ids[road] for road in route])
    return physics_futures(
        net,
        routes,
        rng.uniform(0, 2000, count),
        rng.uniform(5, 30, count),
        gone=list(rng.random(count) < 0.4),
        weight=rng.dirichlet(np.ones(count)),
        depart_s=rng.choice([0.0, 300.0], count),
        stop_m=np.where(rng.random(count) < 0.3, 4000.0, np.inf),
    )


def strayed(rng: np.random.Generator, count: int) -> Futures:
    """Targets that go anywhere, in pieces of any length, also none."""
    counts = rng.integers(0, 8, count)
    times = [np.sort(rng.uniform(-200, 1500, many)) for many in counts]
    knots = int(counts.sum())
    return Futures(
        time_s=np.concatenate(times),
        x_m=rng.uniform(-3000, 15000, knots),
        y_m=rng.uniform(-3000, 15000, knots),
        first_knot=np.concatenate(([0], np.cumsum(counts))),
        weight=rng.dirichlet(np.ones(count)),
        gone=rng.random(count) < 0.5,
    )


def random_problem(seed: int, *, particles: int = 40, by_s: float | None = None) -> Problem:
    """A problem on one of the paper's nets, a small grid or a random one."""
    rng = np.random.default_rng(seed)
    nets = [figure1, figure3, lambda: grid(3, 3, road_m=5000.0), lambda: random_network(rng)]
    net = nets[seed % 4]()
    futures = strayed(rng, particles) if seed % 3 == 0 else driven(net, rng, particles)
    return Problem(
        network=net,
        futures=futures,
        uav=Uav(*rng.uniform(-8000, 8000, 2), float(rng.uniform(0, 100)), 100.0),
        sensor=Sensor(float(rng.choice([50.0, 300.0, 1500.0])), bool(rng.random() < 0.5)),
        objective=Objective(2000.0, by_s),
    )


def flown(problem: Problem, state: SearchState, leg: int) -> Floats | None:
    """When one leg, flown next, sees each particle, by the whole track; None after the landing."""
    uav = problem.uav
    here = replace(
        uav,
        x_m=state.x_m,
        y_m=state.y_m,
        take_off_s=state.time_s,
        max_flight_time_s=uav.landing_s - state.time_s,
    )
    plan = plan_of_legs(problem.replace(uav=here), "one leg", [leg])
    if not plan.legs[0]:
        return None
    return first_detection(problem.futures, plan.tracks[0], problem.sensor.radius_m)


def orders(problem: Problem, order: list[int]) -> Iterator[list[int]]:
    """Every order that goes on from another one along roads, until no leg begins in time."""
    yield order
    legs, track = problem.legs, plan_of_legs(problem, "", order).tracks[0]
    if order and track.end_s >= problem.objective.ends_s:
        return
    for leg in range(len(legs)):
        if not order or legs.from_node[leg] == legs.to_node[order[-1]]:
            longer = [*order, leg]
            if len(plan_of_legs(problem, "", longer).legs[0]) == len(longer):
                yield from orders(problem, longer)


def seen_by_order(problem: Problem, order: Sequence[int]) -> Floats:
    """When a flight along an order sees each particle."""
    tracks = plan_of_legs(problem, "", order).tracks
    return evaluate(tracks, problem.futures, problem.sensor, problem.objective).seen_at


def most_together(problems: Sequence[Problem]) -> float:
    """Return what the best pair of all orders of two UAVs earns: every pair is flown."""
    first, second = (
        np.array([seen_by_order(problem, order) for order in orders(problem, [])])
        for problem in problems
    )
    problem = problems[0]
    return max(
        float((problem.objective.reward(np.minimum(one, second)) @ problem.futures.weight).max())
        for one in first
    )
