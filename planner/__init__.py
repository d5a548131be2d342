"""Plans in which order a drone flies the roads to find a vehicle soonest on average.

scenario     what a person writes about a search, checked
network      a SUMO net as columns
belief       what is known of the target; particles drawn from it
futures      the particles driven by SUMO, recorded
flight       what the drone can fly: legs, tracks, plans
detection    UAV flight against futures: who is seen when
search       road orders: planners from problem to plan
bounds       how far a plan is from the best one
mission      a plan meets the truth
export       a plan for other programs
experiments  many conditions, kept one by one
report       tables, pictures, files
paper        evidence for the article
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from planner.belief.particles import Particles
    from planner.belief.prior import Prior
    from planner.belief.sampling import predefined, sample
    from planner.detection.evaluation import Evaluation, evaluate
    from planner.detection.first_detection import first_detection
    from planner.detection.objective import Objective
    from planner.detection.sensor import Sensor
    from planner.errors import (
        InputError,
        NotApplicableError,
        OutputError,
        PlannerError,
        ScenarioError,
        SumoError,
    )
    from planner.flight.plan import Plan
    from planner.flight.track import Track
    from planner.flight.uav import Uav
    from planner.futures.futures import Futures
    from planner.futures.record import record
    from planner.futures.state_at import by_road, state_at
    from planner.futures.store import Recording, read_recording
    from planner.mission.fly import MissionRecord, fly
    from planner.mission.opening import OpenScenario, open_scenario
    from planner.mission.plan_file import read_plan
    from planner.mission.recorder import Recorder, make_plan, problem_of
    from planner.network.read import read_net
    from planner.network.road_network import RoadNetwork
    from planner.search.greedy import GreedyOptions, greedy
    from planner.search.methods import METHODS, method_named
    from planner.search.plan import plan_of_legs
    from planner.search.problem import Budget, Problem
    from planner.streams import stream

# Where each public name lives; loaded when first used, as some of it takes a second.
_HOMES = {
    "planner.mission.opening": ("OpenScenario", "open_scenario"),
    "planner.belief.particles": ("Particles",),
    "planner.belief.prior": ("Prior",),
    "planner.belief.sampling": ("predefined", "sample"),
    "planner.detection.evaluation": ("Evaluation", "evaluate"),
    "planner.detection.first_detection": ("first_detection",),
    "planner.detection.objective": ("Objective",),
    "planner.detection.sensor": ("Sensor",),
    "planner.flight.plan": ("Plan",),
    "planner.flight.track": ("Track",),
    "planner.flight.uav": ("Uav",),
    "planner.errors": (
        "InputError",
        "NotApplicableError",
        "OutputError",
        "PlannerError",
        "ScenarioError",
        "SumoError",
    ),
    "planner.futures.futures": ("Futures",),
    "planner.futures.record": ("record",),
    "planner.futures.state_at": ("by_road", "state_at"),
    "planner.futures.store": ("Recording", "read_recording"),
    "planner.mission.fly": ("MissionRecord", "fly"),
    "planner.mission.plan_file": ("read_plan",),
    "planner.mission.recorder": ("Recorder", "make_plan", "problem_of"),
    "planner.network.read": ("read_net",),
    "planner.network.road_network": ("RoadNetwork",),
    "planner.search.greedy": ("GreedyOptions", "greedy"),
    "planner.search.methods": ("METHODS", "method_named"),
    "planner.search.plan": ("plan_of_legs",),
    "planner.search.problem": ("Budget", "Problem"),
    "planner.streams": ("stream",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "METHODS",
    "Budget",
    "Evaluation",
    "Futures",
    "GreedyOptions",
    "InputError",
    "MissionRecord",
    "NotApplicableError",
    "Objective",
    "OpenScenario",
    "OutputError",
    "Particles",
    "Plan",
    "PlannerError",
    "Prior",
    "Problem",
    "Recorder",
    "Recording",
    "RoadNetwork",
    "ScenarioError",
    "Sensor",
    "SumoError",
    "Track",
    "Uav",
    "by_road",
    "evaluate",
    "first_detection",
    "fly",
    "greedy",
    "make_plan",
    "method_named",
    "open_scenario",
    "plan_of_legs",
    "predefined",
    "problem_of",
    "read_net",
    "read_plan",
    "read_recording",
    "record",
    "sample",
    "state_at",
    "stream",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'planner' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
