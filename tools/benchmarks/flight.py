"""The flight law: against an autopilot's recordings, and what planning with it costs and is worth.

First how the law times the mission that two recorded flights flew: its constants are fitted to the
one at 15 m/s, the one at 10 m/s is predicted, and there is no third recording. Then plans made with
the law in mind beside plans made as if the aircraft turned at once, which are timed by the law and
turned home when they must be. Both meet the same fresh targets; the interval is of the paired
difference. Seconds are of CPU, of the planning thread alone.

Particles are those of the kinematic clock in the towns, so that nothing has to be recorded.
Luxembourg is left out where its data are not (PLANNER_DATA).

python tools/benchmark.py --flight [--only recordings] [--only berlin]
"""

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from benchmarks.figures import Figure, machine, show
from benchmarks.search_towns import ROOT, drawn, luxembourg
from planner import OpenScenario, evaluate, method_named, open_scenario
from planner.arrays import Floats
from planner.flight.as_flown import as_flown, battery_of
from planner.flight.law import FlightLaw, timed
from planner.flight.plan import FlownLeg, Plan
from planner.futures.futures import Futures
from planner.intervals import NORMAL_95
from planner.mission.planning import budget_of, problem_of
from planner.search.dashes import portfolio
from planner.search.plan import plan_of_waypoints
from planner.search.problem import Problem

ACCELERATION_MPS2, CORNER_M = 1.4, 2.0  # fitted to the flight at 15 m/s alone
SHARE, LATE_S = 0.05, 20.0  # by which the law may miss a flight's end, and any of its waypoints
MOST_TIMES, PROMISE_S, SOONER_S = 2.5, 10.0, 15.0  # the aims
BY_S = 1200.0  # after the sighting
PROPOSALS, HOLDOUT, FRESH = 10_000, 500, 4000
AIRCRAFT = (
    "uav.acceleration_mps2=1.5",
    "uav.corner_m=2",
    "uav.climb_mps=2.5",
    "uav.descend_mps=1.5",
    "uav.altitude_m=100",
)
TOWN = ("uav.speed_mps=15", "uav.take_off_s=180", "search.horizon_s=1500")


def recordings() -> Iterator[Figure]:
    """Yield how far the law is from what an autopilot flew in its simulator."""
    sys.path.insert(0, str(ROOT / "tests"))
    support: Any = import_module("support.recorded_flights")
    flown = support.mission()
    for flight, speed_mps, how in (("sitl_15", 15.0, "fitted"), ("sitl_10", 10.0, "predicted")):
        told = flight == "sitl_15"  # the other one has no list of times
        reached_s = flown.reached_s if told else support.reached_s(flight, flown.xy_m)
        reached_s = reached_s - reached_s[0]
        law = FlightLaw(speed_mps, ACCELERATION_MPS2, CORNER_M)
        model_s = timed(flown.xy_m, np.zeros(len(flown.xy_m)), law).arrives_s
        end = 100.0 * abs(float(model_s[-1] / reached_s[-1]) - 1.0)
        allowed_s = np.maximum(SHARE * reached_s, LATE_S)
        worst = float((np.abs(model_s - reached_s) / allowed_s).max())
        yield Figure(f"{flight}, {how}: off at the end", "%", (end,), at_most=100.0 * SHARE)
        yield Figure("any waypoint: off / allowed", "times", (worst,), at_most=1.0)


class Made(NamedTuple):
    """A plan, and the CPU seconds that it took."""

    plan: Plan
    took_s: float


def planned(problem: Problem, opened: OpenScenario) -> Made:
    """Return the plan that `best` makes, timed with compiled code warm."""
    for _ in range(2):
        asked, rng = problem.replace(), np.random.default_rng(1)
        begun_s = time.thread_time()
        found = method_named("best").load()(asked, budget=budget_of(opened), rng=rng)
        took_s = time.thread_time() - begun_s
    return Made(found.plan, took_s)


def without_law(problem: Problem) -> Problem:
    """Return the problem with climb and acceleration left out."""
    return problem.replace(uav=replace(problem.uav, aircraft=None))


def flown_after(problem: Problem, plan: Plan) -> Plan:
    """Return a plan made without the law as the aircraft flies it, turned home when it must."""
    uav, (track,), (legs,) = problem.uav_at_start, plan.tracks, plan.legs
    assert uav.aircraft is not None
    up_s = uav.aircraft.law.climb_s
    shifted = replace(track, time_s=track.time_s + up_s, sensor_on=track.sensor_on + up_s)
    later = [
        FlownLeg(one.leg, one.depart_s + up_s, one.start_s + up_s, one.end_s + up_s) for one in legs
    ]
    plan = replace(plan, tracks=(shifted,), legs=(tuple(later),))
    return as_flown(plan, uav.aircraft.law, battery_of(uav, problem.airspace))


def broken_promise_s(problem: Problem, work: int) -> float:
    """Return by how much free flights earn less or more than their search said, seconds of E."""
    particles = problem.proposals or problem.futures
    off = []
    for flight in portfolio(problem, work)[0]:
        plan = plan_of_waypoints(problem, "", flight.waypoints)
        reward = problem.objective.reward(_seen_at(problem, plan, particles))
        off.append(abs(flight.reward - float(particles.weight @ reward)))
    return max(off)


def in_net(opened: OpenScenario, particles: int, fresh: Futures) -> Iterator[Figure]:
    """Yield what planning with the law costs, keeps of its promise, and gains."""
    problem = problem_of(opened, drawn(opened, particles, "planning"))
    problem = problem.replace(holdout=drawn(opened, HOLDOUT, "holdout"))
    if not opened.network.is_abstract:
        problem = problem.replace(proposals=drawn(opened, PROPOSALS, "proposals"))
        promise_s = broken_promise_s(problem, opened.scenario.search.work)
        yield Figure("promise and exact value apart", "s of E", (promise_s,), at_most=PROMISE_S)
    ideal = without_law(problem)
    made, blind = planned(problem, opened), planned(ideal, opened)
    times = made.took_s / blind.took_s
    yield Figure("planning with / without the law", "times", (times,), at_most=MOST_TIMES)
    plans = (made.plan, flown_after(problem, blind.plan))
    with_s, without_s = (_seen_at(problem, plan, fresh) for plan in plans)
    horizon_s, by_s = problem.horizon_s, BY_S
    yield Figure("E, planned with the law", "s", (_mean(np.minimum(with_s, horizon_s)),))
    sooner_s = np.minimum(without_s, horizon_s) - np.minimum(with_s, horizon_s)
    mean_s, half_s = _mean(sooner_s), _half(sooner_s)
    yield Figure(f"sooner than without, +- {half_s:.0f}", "s", (mean_s,))
    yield Figure("  lower limit", "s", (mean_s - half_s,), at_least=SOONER_S)
    more = 100.0 * ((with_s <= by_s).astype(float) - (without_s <= by_s))
    yield Figure(f"more found by {by_s / 60:g} min, +- {_half(more):.1f}", "points", (_mean(more),))
    if problem.uav.max_flight_time_s < np.inf:
        aircraft, (track,) = problem.uav.aircraft, made.plan.tracks
        assert aircraft is not None
        lasts_s = problem.uav.max_flight_time_s - aircraft.reserve_s
        aloft_s = track.end_s - float(track.time_s[0])
        yield Figure("in the air", "s", (aloft_s,), at_most=lasts_s)


def _seen_at(problem: Problem, plan: Plan, targets: Futures) -> Floats:
    return evaluate(plan.tracks, targets, problem.sensor, problem.objective).seen_at


def _mean(values: Floats) -> float:
    return float(np.mean(values))


def _half(values: Floats) -> float:
    return float(NORMAL_95 * np.std(values, ddof=1) / np.sqrt(len(values)))


def cases(only: Sequence[str] | None) -> Iterator[tuple[str, OpenScenario]]:
    """Yield the scenarios by name, with the aircraft."""

    def wanted(name: str) -> bool:
        return not only or name in only

    if wanted("berlin"):
        yield "berlin", open_scenario("berlin", overrides=list(AIRCRAFT))
    if wanted("berlin-mix"):
        yield "berlin-mix", open_scenario("berlin", overrides=list(AIRCRAFT), preset="mix")
    if wanted("grid5x5"):
        yield "grid5x5", open_scenario("grid5x5", overrides=list(AIRCRAFT))
    if wanted("luxembourg"):
        with luxembourg() as folder:
            if folder is not None:
                yield "luxembourg", open_scenario(folder, overrides=[*AIRCRAFT, *TOWN])


def main(argv: Sequence[str]) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", action="append", metavar="NAME", help="recordings, berlin, ...")
    parser.add_argument("--particles", type=int, default=500, metavar="N")
    wanted = parser.parse_args(argv)
    host, found = machine(), []
    if not wanted.only or "recordings" in wanted.only:
        found += [("recordings", figure) for figure in recordings()]
    for name, opened in cases(wanted.only):
        print(f"measuring {name} ...", file=sys.stderr)
        fresh = drawn(opened, FRESH, "fresh")
        found += [(name, figure) for figure in in_net(opened, wanted.particles, fresh)]
    show(found, host)
    print("There is no third recording.")
    return 0
