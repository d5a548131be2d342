"""A recorded flight held against its plan: what it was worth, and where the target can still be."""

from dataclasses import dataclass, replace

import numpy as np

from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.detection.sensor import Sensor
from planner.detection.survival import Searched, survival
from planner.flight.law import FlightLaw
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.mission.aircraft import aircraft_of
from planner.mission.fly import MissionRecord, fly
from planner.mission.opening import OpenScenario
from planner.mission.plan_file import StoredPlan
from planner.scenario.uav import UavSection
from planner.telemetry.flown import BREAK_S, Flown, Reading

AT_HEIGHT = 0.95  # of the planned height: from there on it is at it, by instruments


@dataclass(frozen=True)
class Wanted:
    """What a user says of a recording; None: the scenario and the recording say it."""

    uav: UavSection | None = None  # the aircraft that flew it
    take_off_s: float | None = None  # seconds on the target's clock
    sensor_from_m: float | None = None  # above the ground, from which height on the sensor counts
    break_s: float = BREAK_S


@dataclass(frozen=True, eq=False)
class Debrief:
    """What a plan, and the flight that was made of it, achieve on the same fresh targets."""

    flight: Flown
    planned_lift_off_s: float
    planned: Evaluation
    flown: MissionRecord


def debrief(flight: Flown, stored: StoredPlan, targets: Futures) -> Debrief:
    """Return what a plan and a recorded flight achieve on the same fresh targets."""
    planned = evaluate(stored.plan.tracks, targets, stored.sensor, stored.objective)
    as_plan = Plan("flown", (flight.track,), ((),))
    record = fly(as_plan, targets, stored.sensor, stored.objective)
    return Debrief(flight, stored.plan.take_off_s, planned, record)


def reading_of(opened: OpenScenario, stored: StoredPlan, wanted: Wanted) -> Reading:
    """Return how to understand a recording of a run's flight, by its scenario and its plan.

    Where a fleet flies, and nothing is said of the aircraft, it is taken for the first UAV's.
    """
    uav = opened.scenario.uav if wanted.uav is None else wanted.uav
    aircraft, from_m = aircraft_of(uav), wanted.sensor_from_m
    tracks = [np.stack([one.x_m, one.y_m], axis=1) for one in stored.plan.tracks]
    return Reading(
        around_m=np.concatenate([opened.network.shape_xy_m, opened.starts_m, *tracks]),
        horizon_s=stored.objective.horizon_s,
        law=FlightLaw(uav.speed_mps) if aircraft is None else aircraft.law,
        lands=opened.landings_m[0] is not None,
        sensor_from_m=AT_HEIGHT * uav.altitude_m if from_m is None else from_m,
        break_s=wanted.break_s,
        take_off_s=wanted.take_off_s,
        sighted_at=opened.scenario.target.sighted_at,
    )


def still_unseen(futures: Futures, track: Track, sensor: Sensor, until_s: float) -> Futures:
    """Return the futures of those that a flight has not seen by a time, with Bayes' weights.

    A particle counts as far as it would have been missed; one that would have been seen for certain
    is ruled out. What is left, and that there is no target at
    all, are as likely among each other as before. Nothing is left if all are ruled out.
    """
    unseen = survival(futures, [Searched(track, sensor)]).at(until_s)
    left = 1.0 - min(1.0, float(futures.weight @ (1.0 - unseen)))
    possible = unseen > 0.0
    remaining, share = futures.take(possible), unseen[possible]
    return replace(remaining, weight=remaining.weight * share / left) if len(share) else remaining
