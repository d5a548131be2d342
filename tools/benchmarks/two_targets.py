"""What planning anew at the first find gains, of two targets in one flight.

On the 5 x 5 grid, detects .9: of targets from two corners, and of two of which the same is
believed. The time of the first find is drawn; what is expected of the other one is taken over all
fresh targets.
"""

from collections.abc import Iterator

import numpy as np

from benchmarks.figures import Figure
from benchmarks.grid import SEED, fresh, opened_at
from planner import Futures, OpenScenario, Remembering, Standing, Track, evaluate, stream
from planner.arrays import Floats
from planner.intervals import student_interval
from planner.paper.in_flight import Flight
from planner.scenario.news import FoundNews

DETECTS = "sensor.detects=0.9"
FIRST = 'start={"r0c0-r0c1"=0.5,"r0c0-r1c0"=0.5},distance_m={uniform=[0,7500]}'
OTHER = 'start={"r4c0-r4c1"=0.5,"r4c0-r5c0"=0.5},distance_m={uniform=[0,7500]}'
CORNERS, ALIKE = f"target=[{{{FIRST}}},{{{OTHER}}}]", f"target=[{{{FIRST}}},{{{FIRST}}}]"
PARTICLES = "search.particles=4096"  # as many of each as there usually are of one
SAVES = 5.0  # percent, lower limit, from two corners


def corner_rows(u0_km: int, targets: int, finds: int) -> Iterator[Figure]:
    """Measure what planning anew at the first find saves of targets from two corners."""
    whole_s, saved_s = _measured(opened_at(u0_km, DETECTS, CORNERS, PARTICLES), targets, finds)
    shares = 100.0 * saved_s / whole_s
    yield Figure("two corners: sum of detection times", "s", (whole_s,))
    yield Figure("two corners: planned anew, less by", "%", (float(shares.mean()),))
    low, _ = student_interval(shares.tolist())
    yield Figure("the same, lower 95 % limit", "%", (low,), at_least=SAVES)


def alike_rows(u0_km: int, targets: int, finds: int) -> Iterator[Figure]:
    """Measure the same of two targets with one belief: nothing, beyond its interval."""
    whole_s, saved_s = _measured(opened_at(u0_km, DETECTS, ALIKE, PARTICLES), targets, finds)
    shares = 100.0 * saved_s / whole_s
    low, high = student_interval(shares.tolist())
    yield Figure("one belief: sum of detection times", "s", (whole_s,))
    yield Figure("one belief: planned anew, less by", "%", (float(shares.mean()),))
    yield Figure("the same, lower 95 % limit", "%", (low,), at_most=0.0)
    yield Figure("the same, upper 95 % limit", "%", (high,), at_least=0.0)


def _measured(opened: OpenScenario, targets: int, finds: int) -> tuple[float, Floats]:
    """Return the sum of times as planned, and what each of some drawn pairs of finds saves of it.

    With target a found first at t, the flight goes on for the other one, b, from there. Up to t
    both flights are the same, so what is saved is the difference of E[b's time] over all of b's
    fresh targets. That is integrated over when a is found, by draws in equal strata; those after
    which b is found already differ in nothing. Intervals are as if draws had no strata: too wide.
    """
    flight = Flight.planned(Remembering(opened, 1), fresh(opened, targets))
    (track,), problem = flight.plan.tracks, flight.problem
    found = evaluate((track,), flight.targets, problem.sensor, problem.objective)
    each, rng = found.each, stream(SEED, "finds")
    judges = [flight.targets.take(flight.targets.target == number) for number in each]
    saved_s = np.zeros(finds)
    for number, one in each.items():
        times_s, probability = one.curve()
        drawn = (np.arange(finds) + rng.random(finds)) / finds
        other = 1 - number
        for row in np.flatnonzero(drawn < probability[-1]).tolist():
            found_s = float(np.interp(drawn[row], probability, times_s))
            saved_s[row] += _saved_s(flight, number, found_s, judges[other])
    return found.expected_detection_time_s, saved_s


def _saved_s(flight: Flight, target: int, found_s: float, judges: Futures) -> float:
    """Return what the flight planned anew when a target is found saves, of the other one's time."""
    (track,), mission = flight.plan.tracks, flight.mission()
    if found_s >= track.end_s:
        return 0.0
    going_on = mission.heard(Standing(found_s), [FoundNews(kind="found", target=target)])
    mission.goes_on(going_on, mission.planned(going_on).attempt.plan)
    return _expected_s(flight, (track,), judges) - _expected_s(flight, mission.tracks, judges)


def _expected_s(flight: Flight, tracks: tuple[Track, ...], judges: Futures) -> float:
    """Return the expected time of one target alone, but for its not being there."""
    problem = flight.problem
    found = evaluate(tracks, judges, problem.sensor, problem.objective)
    return float(judges.weight @ found.time_s)
