"""Runs as pages show them, made without SUMO: any names, and cars that follow roads."""

from dataclasses import replace
from typing import Any

import numpy as np

from planner.arrays import first_rows
from planner.clock import moment
from planner.detection.evaluate import evaluate
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.mission.opening import OpenScenario
from planner.mission.planning import problem_of
from planner.page.shown import Shown
from planner.search.plan import plan_of_waypoints

SIGHTED_AT = "2026-05-01T14:05:00+05:30"
HOVER_S = 20.0


def drives(opened: OpenScenario, many: int, *, knots: int = 30, seed: int = 1) -> Futures:
    """Motion along the edges of a net, which turns by chance; every third car leaves at its end."""
    rng, network = np.random.default_rng(seed), opened.network
    times, places, counts = [], [], []
    for _ in range(many):
        edge, time_s = int(rng.integers(len(network.edge_ids))), 0.0
        line = [network.edge_shape(edge)]
        while sum(map(len, line)) < knots and len(network.turns(edge)):
            edge = int(rng.choice(network.turns(edge)))
            line.append(network.edge_shape(edge)[1:])
        path = np.concatenate(line)[:knots]
        steps_s = np.hypot(*np.diff(path, axis=0).T) / rng.uniform(8.0, 14.0) + 0.01
        times.append(time_s + np.concatenate(([0.0], np.cumsum(steps_s))))
        places.append(path)
        counts.append(len(path))
    xy_m = np.concatenate(places)
    return Futures(
        np.concatenate(times),
        xy_m[:, 0],
        xy_m[:, 1],
        first_rows(counts),
        np.full(many, 1.0 / many),
        np.arange(many) % 3 == 0,
    )


def shown(opened: OpenScenario, many: int = 60, *, knots: int = 30) -> Shown:
    """Return a flight over some crossings, with what it is worth against cars by chance."""
    fresh = drives(opened, many, knots=knots)
    problem = problem_of(opened, fresh)
    nodes = problem.network.node_xy_m[:: max(len(problem.network.node_xy_m) // 12, 1)]
    stops = np.column_stack([nodes, np.where(np.arange(len(nodes)) % 4 == 0, HOVER_S, 0.0)])
    plan = plan_of_waypoints(problem, "spiral", stops)
    waits = plan_of_waypoints(problem, "wait", stops[:1])

    def worth(one: Plan) -> Any:
        return evaluate(one.tracks, fresh, problem.sensor, problem.objective)

    return Shown(opened, plan, fresh, worth(plan), {"wait: waits": worth(waits)})


def called(
    opened: OpenScenario,
    *,
    title: str | None = None,
    street: str = "",
    net: str | None = None,
    sighted_at: str | None = SIGHTED_AT,
) -> OpenScenario:
    """Return a scenario with other words in it.

    Parameters
    ----------
    street
        What the name of every street begins with.
    """
    scenario, network = opened.scenario, opened.network
    when = None if sighted_at is None else moment(sighted_at)
    target = scenario.target.model_copy(update={"sighted_at": when})
    section = scenario.network.model_copy(update={"net": net or scenario.network.net})
    scenario = replace(scenario, target=target, network=section, title=title or scenario.title)
    streets = tuple(f"{street}{name}" for name in network.edge_street)
    return replace(opened, scenario=scenario, network=replace(network, edge_street=streets))
