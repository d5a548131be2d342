"""Whether a plan can be flown as it is: what an export would say against it."""

from collections.abc import Iterator, Sequence

from planner.clock import clock
from planner.errors import InputError
from planner.export.checks import faults, nearness, of_flights, too_near
from planner.export.from_run import run_flight
from planner.flight.plan import ROUNDING_S, Plan
from planner.flight.separation import meetings_of
from planner.futures.none import NO_TARGETS
from planner.mission.aircraft import aircraft_of
from planner.mission.opening import OpenScenario
from planner.mission.plan_file import StoredPlan
from planner.mission.planning import problems_of
from planner.network.georeference import is_georeferenced
from planner.search.problem import Problem


def against(opened: OpenScenario, plan: Plan) -> list[str]:
    """Return what speaks against flying a plan, a line each.

    Real aircraft's is what an export checks; ideal ones', the battery, the way home, the airspace
    and how near UAVs come to each other.
    """
    problems = problems_of(opened, NO_TARGETS)
    names = plan.names if len(plan.tracks) > 1 else ("",)
    stored = StoredPlan(plan, problems[0].sensor, problems[0].objective, {})
    are_real = all(aircraft_of(uav) is not None for uav in opened.scenario.uavs)
    if are_real and is_georeferenced(opened.network):
        runs = [run_flight(opened, one) for one in stored.each]
        said = [[*faults(run, most_waypoints=None)] for run in runs]
        near = [*too_near(runs, names)]
    else:
        said = [[*_of_ideal(problems, one.plan)] for one in stored.each]
        met = meetings_of(plan, [problem.uav for problem in problems])
        near = [nearness(names[one], names[other], from_s) for one, other, from_s in met]
    return [*of_flights(names, said), *near]


def _of_ideal(problems: Sequence[Problem], plan: Plan) -> Iterator[str]:
    """Yield what speaks against one flight of a plan."""
    (flight,), (track,) = plan.flights, plan.tracks
    problem = problems[flight.uav]
    lasts_s = problem.uav.of_flight(flight.number).max_flight_time_s
    lands_s = float(track.time_s[0]) + lasts_s
    if track.end_s > lands_s + ROUNDING_S:
        yield f"it is in the air until {clock(track.end_s)}, its battery {clock(lands_s)}"
    if problem.airspace is not None:
        try:
            problem.airspace.refuse(track)
        except InputError as error:
            yield str(error)
