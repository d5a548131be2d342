"""Certified runs without a scenario: the files of `planner plan` and `planner certify`."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from planner.bounds.certificate import Effort, certified
from planner.detection.evaluate import evaluate
from planner.flight.law import FlightLaw
from planner.flight.plan import Plan
from planner.flight.uav import Uav
from planner.mission.certificate_file import (
    certificate_content,
    sha256_of_motion,
    sha256_of_net,
    write_certificate,
)
from planner.mission.plan_file import plan_content, write_plan
from planner.provenance import provenance, sha256_of_json
from planner.search.problem import Problem
from planner.search.stop import WorkDone

RATES = ("acceleration_mps2", "corner_m", "climb_mps", "descend_mps")


def write_certified(folder: Path, problem: Problem, plan: Plan, *, steps: int = 60) -> None:
    """What both commands write, but for what verify.py does not read."""
    planned = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective)
    path = folder / "plan.json"
    figures: Any = {"planned": planned, "evaluated": planned, "seed": 1}
    write_plan(path, plan_content(plan, problem, **figures))
    certificate = certified(problem, plan, Effort(stop=WorkDone(steps)))
    content = certificate_content(problem, certificate)
    write_record(folder, problem)
    write_certificate(folder, problem, certificate, path, content)


def write_record(folder: Path, problem: Problem) -> None:
    """The run.json of a scenario that asks for a problem, and gives the plan in the folder."""
    sha256 = {
        "net": problem.network.sha256,
        "roads": sha256_of_net(problem.network),
        "motion": sha256_of_motion(problem.futures),
    }
    record = provenance(["planner", "plan"], scenario_of(problem), seed=1, sha256=sha256)
    (folder / "run.json").write_text(json.dumps(record), encoding="utf-8")
    reseal(folder)


def scenario_of(problem: Problem) -> dict[str, Any]:
    """What a scenario says of a problem, as run.json has it."""
    by_s, sensor = problem.objective.by_s, problem.sensor
    objective = (
        {"objective": "time"} if by_s is None else {"objective": "probability", "by_s": by_s}
    )
    uavs, detects = [_of_uav(uav) for uav in problem.uavs], sensor.detects(problem.uav.speed_mps)
    return {
        "target": {"last_seen_ago_s": 0.0},
        "uav": uavs if problem.others else uavs[0],
        "sensor": {
            "radius_m": sensor.radius_m,
            "detects_in_transit": sensor.detects_in_transit,
            **({} if sensor.is_perfect else {"detects": detects}),
        },
        "search": {
            "horizon_s": problem.objective.horizon_s,
            "seed": 1,
            "planning_time_s": 0.0,
            **objective,
        },
    }


def _of_uav(uav: Uav) -> dict[str, Any]:
    longest_s = uav.max_flight_time_s
    return {
        "speed_mps": uav.speed_mps,
        "altitude_m": uav.altitude_m,
        "start": {"x_m": uav.x_m, "y_m": uav.y_m},
        "take_off_s": uav.take_off_s,
        **({} if np.isinf(longest_s) else {"max_flight_time_s": longest_s}),
        **({} if uav.sorties == 1 else {"sorties": uav.sorties}),
        **({} if uav.return_to_m is None else {"return_to": "start"}),
        **({} if uav.aircraft is None else _of_law(uav.aircraft.law)),
    }


def _of_law(law: FlightLaw) -> dict[str, Any]:
    east, north = law.wind_mps
    from_deg = float(np.degrees(np.arctan2(-east, -north)))
    rates = {key: getattr(law, key) for key in RATES}
    return {
        **{key: rate for key, rate in rates.items() if np.isfinite(rate)},
        "hover": law.can_hover,
        "min_speed_mps": law.min_speed_mps or None,
        "wind": {"speed_mps": float(np.hypot(east, north)), "from_deg": from_deg},
    }


def reseal(folder: Path) -> None:
    """Have run.json hold the digests of its scenario and of the plan, as a careful forger would."""
    plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    plan.pop("certificate", None)
    record = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    record["sha256"]["plan"] = sha256_of_json(plan)
    record["sha256"]["scenario"] = sha256_of_json(record["scenario"])
    (folder / "run.json").write_text(json.dumps(record), encoding="utf-8")
