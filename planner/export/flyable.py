"""Whether a plan can be flown as it is: what an export would say against it."""

from planner.clock import clock
from planner.errors import InputError
from planner.export.checks import faults
from planner.export.from_run import run_flight
from planner.flight.plan import ROUNDING_S, Plan
from planner.futures.none import NO_TARGETS
from planner.mission.aircraft import aircraft_of
from planner.mission.opening import OpenScenario
from planner.mission.plan_file import StoredPlan
from planner.mission.planning import problem_of
from planner.network.georeference import is_georeferenced


def against(opened: OpenScenario, plan: Plan) -> list[str]:
    """Return what speaks against flying a plan, a line each.

    A real aircraft's is what an export checks; the ideal one's, the battery, the way home and the
    airspace.
    """
    problem = problem_of(opened, NO_TARGETS)
    if aircraft_of(opened.scenario.uav) is not None and is_georeferenced(opened.network):
        stored = StoredPlan(plan, problem.sensor, problem.objective, {})
        return [*faults(run_flight(opened, stored), most_waypoints=None)]
    said, lands_s = [], problem.uav.landing_s
    for track in plan.tracks:
        if track.end_s > lands_s + ROUNDING_S:
            said.append(
                f"it is in the air until {clock(track.end_s)}, its battery {clock(lands_s)}"
            )
        if problem.airspace is not None:
            try:
                problem.airspace.refuse(track)
            except InputError as error:
                said.append(str(error))
    return said
