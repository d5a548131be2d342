"""``plan.json``: the flight that alone reproduces every figure of a plan."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from planner.detection.evaluation import Evaluation
from planner.detection.mistimed import Mistimed
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.detection.several import Find, find_of, first_and_last
from planner.errors import InputError
from planner.files import write_json
from planner.flight.law import Aircraft
from planner.flight.legs import Legs, leg_ends
from planner.flight.plan import FlownLeg, Plan, Sortie
from planner.flight.track import Track
from planner.flight.uav import Uav
from planner.guard import read_json
from planner.messages import as_written
from planner.mission.places import frame, place, waypoints
from planner.network.road_network import RoadNetwork
from planner.search.problem import Problem

SCHEMA = "planner.plan/2"
LEG_TIMES = ("depart_s", "start_s", "end_s")
ROUNDED_S = 1.0  # by which a leg may begin before its track, or end after it
SCHEMAS = ("planner.plan/1", SCHEMA)  # that are read


@dataclass(frozen=True, eq=False)
class StoredPlan:
    """A plan read back, with the sensor and the objective it was made for."""

    plan: Plan
    sensor: Sensor  # its radius and rate; when it is on stands in the tracks
    objective: Objective
    evaluated: Mapping[str, Any]  # its figures on fresh targets, as ``plan_content`` tells them

    @property
    def each(self) -> "tuple[StoredPlan, ...]":
        """Each flight of the plan alone."""
        plan = self.plan
        flights = zip(plan.tracks, plan.legs, plan.flights, strict=True)
        return tuple(
            replace(self, plan=Plan(plan.method, (track,), (legs,), (flight,)))
            for track, legs, flight in flights
        )


def write_plan(path: Path, content: Mapping[str, Any]) -> None:
    """Write ``plan.json`` from what ``plan_content`` returns."""
    write_json(path, content)


def plan_content(
    plan: Plan,
    problem: Problem,
    *,
    planned: Evaluation,
    evaluated: Evaluation,
    seed: int,
    sighted_at: datetime | None = None,
) -> dict[str, Any]:
    """Return a plan and its figures as plain data.

    Parameters
    ----------
    problem
        The one that it solves, of the first UAV.
    planned
        On the particles that the plan was made from.
    evaluated
        On fresh targets, drawn under ``seed``.
    sighted_at
        Which moment time 0 is, with its offset from UTC; None: nobody said.
    """
    network = problem.network
    uavs = [problem.uavs[flight.uav].of_flight(flight.number) for flight in plan.flights]
    return {
        "schema": SCHEMA,
        **network.credit,
        "method": plan.method,
        "sighted_at": None if sighted_at is None else sighted_at.isoformat(),
        "network": frame(network),
        "uavs": [
            {
                **_whose(plan, number),
                **_uav(uav, network),
                **_aircraft(uav.aircraft, track),
                "waypoints": waypoints(track, network),
                "legs": [_leg(flown, network) for flown in legs],
                "sensor_on": track.sensor_on.tolist(),
            }
            for number, (uav, track, legs) in enumerate(
                zip(uavs, plan.tracks, plan.legs, strict=True)
            )
        ],
        "planned": {
            "expected_detection_time_s": planned.expected_detection_time_s,
            "detection_probability": planned.detection_probability,
            "particles": len(planned.weight),
            "horizon_s": planned.objective.horizon_s,
            "radius_m": problem.sensor.radius_m,
            **_misses(problem.sensor),
            **({} if planned.objective.sought == 1 else {"sought": planned.objective.sought}),
            **_objective(planned),
            **_first_and_last(planned),
        },
        "evaluated": figures(evaluated) | {"targets": len(evaluated.weight), "seed": seed},
    }


def _misses(sensor: Sensor) -> dict[str, float]:
    """Return at which rate a sensor detects that may miss; of a perfect one nothing."""
    return {} if sensor.is_perfect else {"rate_per_s": sensor.rate_per_s}


def timing_content(timing: Sequence[Mistimed]) -> list[dict[str, float]]:
    """Return what a plan is worth if it is flown at other times, as plain data."""
    return [_mistimed(one) for one in timing]


def _mistimed(one: Mistimed) -> dict[str, float]:
    evaluated, by_s = one.evaluated, one.evaluated.objective.by_s
    found = {} if by_s is None else {"found_by_probability": evaluated.found_by_probability(by_s)}
    return {
        "pace": one.timing.pace,
        "late_s": one.timing.late_s,
        "expected_detection_time_s": evaluated.expected_detection_time_s,
        "detection_probability": evaluated.detection_probability,
        **found,
    }


def figures(evaluation: Evaluation) -> dict[str, Any]:
    """Return the figures by which plans are compared, as plain data."""
    return {
        "expected_detection_time_s": evaluation.expected_detection_time_s,
        "ci95_s": list(evaluation.ci95_s),
        "detection_probability": evaluation.detection_probability,
        "found_before_goal_probability": evaluation.found_before_goal_probability,
        **_objective(evaluation),
        **_several(evaluation),
    }


def _several(evaluation: Evaluation) -> dict[str, Any]:
    """Return what is told of several targets one by one; of one there is nothing to add."""
    if evaluation.objective.sought == 1:
        return {}
    first, last = first_and_last(evaluation)
    each = [{"target": n, **_find(find_of(one))} for n, one in evaluation.each.items()]
    return {"several": {"each": each, "first": _find(first), "last": _find(last)}}


def _first_and_last(planned: Evaluation) -> dict[str, Any]:
    """Return when any and all of several targets are found, which the particles alone tell."""
    if planned.objective.sought == 1:
        return {}
    finds = zip(("first", "last"), first_and_last(planned), strict=True)
    return {name: _without_intervals(_find(find)) for name, find in finds}


def _without_intervals(table: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in table.items() if "ci95" not in key}


def _find(find: Find) -> dict[str, Any]:
    return {
        "expected_detection_time_s": find.expected_s,
        "ci95_s": list(find.ci95_s),
        "found_probability": find.probability,
        "found_probability_ci95": list(find.interval),
    }


def _objective(evaluation: Evaluation) -> dict[str, Any]:
    by_s = evaluation.objective.by_s
    if by_s is None:
        return {"objective": "time"}
    return {
        "objective": "probability",
        "found_by_s": by_s,
        "found_by_probability": evaluation.found_by_probability(by_s),
    }


def _whose(plan: Plan, number: int) -> dict[str, int]:
    """Return which flight of which UAV one is, unless it is the only one of the first."""
    if plan.flights == (Sortie(0),):
        return {}
    uav, again = plan.flights[number]
    return {"uav": uav, "flight": again}


def _uav(uav: Uav, network: RoadNetwork) -> dict[str, Any]:
    longest_s, home = uav.max_flight_time_s, uav.return_to_m
    return {
        "altitude_m": uav.altitude_m,
        "speed_mps": uav.speed_mps,
        "max_flight_time_s": None if np.isinf(longest_s) else longest_s,
        "start": place((uav.x_m, uav.y_m), network),
        "landing": None if home is None else place(home, network),
        **({} if np.isinf(uav.link_m) else {"link_m": uav.link_m}),
    }


def _aircraft(aircraft: Aircraft | None, track: Track) -> dict[str, Any]:
    """Return what a plan says of a real aircraft; of the ideal one there is nothing to say."""
    if aircraft is None:
        return {}
    law = aircraft.law
    rates = ("acceleration_mps2", "corner_m", "climb_mps", "descend_mps")
    found = {rate: getattr(law, rate) for rate in rates}
    return {
        "aircraft": {
            **{rate: value if np.isfinite(value) else None for rate, value in found.items()},
            "hover": law.can_hover,
            "min_speed_mps": None if law.can_hover else law.min_speed_mps,
            "reserve_s": aircraft.reserve_s,
            "wind_mps": list(law.wind_mps),
            "headwind_mps": aircraft.headwind_mps,
        },
        "corners": track.corners,
    }


def _leg(flown: FlownLeg, network: RoadNetwork) -> dict[str, Any]:
    from_node, to_node = leg_ends(network, flown.leg)
    return {
        "road": network.road_ids[flown.road],
        "from_node": from_node,
        "to_node": to_node,
        "depart_s": flown.depart_s,
        "start_s": flown.start_s,
        "end_s": flown.end_s,
    }


def read_plan(path: Path, network: RoadNetwork) -> StoredPlan:
    """Return the plan in a ``plan.json`` of schema 2 or 1.

    Raises
    ------
    InputError
        If the file is missing, is no plan, is for another network, or names roads that are not
        in this one.
    """
    if not path.is_file():
        raise InputError(f"{path}: is missing; `planner plan SCENARIO -o DIR` writes one")
    content = read_json(path)
    try:
        return _stored(content, network)
    except (KeyError, TypeError, ValueError, IndexError, AssertionError) as error:
        raise InputError(f"{path}: is no plan for this network ({error!r}); plan again") from error


def _stored(content: Mapping[str, Any], network: RoadNetwork) -> StoredPlan:
    if content["schema"] not in SCHEMAS:
        raise ValueError(f"schema {content['schema']!r}, not {SCHEMA!r}")
    if content["schema"] == SCHEMA and content["network"]["sha256"] != network.sha256:
        raise ValueError("it was made on another one")
    tracks, legs, flights = [], [], []
    for number, uav in enumerate(content["uavs"]):
        time_s, x_m, y_m, *_ = np.array(uav["waypoints"], dtype=float).T
        on = np.array(uav["sensor_on"], dtype=float).reshape(-1, 2)
        tracks.append(Track(time_s, x_m, y_m, on))
        legs.append(tuple(_flown(leg, network, tracks[-1]) for leg in uav["legs"]))
        flights.append(Sortie(_count(uav.get("uav", number)), _count(uav.get("flight", 0))))
    if not tracks:
        raise ValueError("no uavs")
    return StoredPlan(
        Plan(_text(content["method"]), tuple(tracks), tuple(legs), tuple(flights)),
        _sensor(content["planned"]),
        Objective(
            _above_zero(content["planned"]["horizon_s"]),
            content["planned"].get("found_by_s"),
            content["planned"].get("sought", 1),
        ),
        {**content["evaluated"], "targets": _whole(content["evaluated"]["targets"])},
    )


def _sensor(planned: Mapping[str, Any]) -> Sensor:
    radius_m = _above_zero(planned["radius_m"])
    rate_per_s = planned.get("rate_per_s")
    return Sensor(radius_m, rate_per_s=np.inf if rate_per_s is None else _above_zero(rate_per_s))


def _whole(number: object) -> int:
    if type(number) is not int or number < 1:
        raise ValueError(f"evaluated on {as_written(number)} targets")
    return number


def _count(number: object) -> int:
    if type(number) is not int or number < 0:
        raise ValueError(f"UAVs and their flights count from 0, not {as_written(number)}")
    return number


def _text(name: object) -> str:
    if not isinstance(name, str):
        raise ValueError(f"the method is {as_written(name)}, no name")
    return name


def _above_zero(number: float) -> float:
    if not 0 < number < np.inf:
        raise ValueError(f"{number} is not above zero")
    return float(number)


def _flown(leg: Mapping[str, Any], network: RoadNetwork, track: Track) -> FlownLeg:
    depart_s, start_s, end_s = np.array([leg[key] for key in LEG_TIMES], float).tolist()
    begins_s, ends_s = track.time_s[0] - ROUNDED_S, track.end_s + ROUNDED_S
    if not begins_s <= depart_s <= start_s <= end_s <= ends_s:
        raise ValueError(f"a leg from {start_s:g} to {end_s:g} s, when nobody flies")
    road = network.road_index[leg["road"]]
    against = leg["from_node"] != network.node_ids[network.road_from[road]]
    if network.road_from[road] == network.road_to[road]:  # a loop: the way tells, not the nodes
        quarters_m = network.road_length_m[road] * np.array([0.25, 0.75])
        off_m = network.xy(np.full(2, road), quarters_m) - track.xy(start_s + (end_s - start_s) / 4)
        against = bool(np.argmin(np.hypot(*off_m.T)))
    return FlownLeg(Legs.both(road)[against], depart_s, start_s, end_s)
