"""A target that was found and is lost again: to find it anew is to plan on a tight belief.

Time 0 is the moment of the loss from then on, and the place of it is where the target starts.
Without a plan the UAV would wait where it lost it, and all others where they are.
"""

from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any

from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.errors import InputError
from planner.flight.plan import Plan, Sortie
from planner.futures.none import NO_TARGETS
from planner.futures.traffic import NO_PERMIT, Permit
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.planning import problems_of
from planner.mission.resume import Resumed, called, grounded
from planner.mission.run_folder import PROVENANCE
from planner.mission.several import refuse_several
from planner.mission.standing import Standing
from planner.network.place_words import Where
from planner.scenario.toml_text import toml_text
from planner.scenario.uav import UavSection
from planner.search.plan import plan_of_wait

RADIUS_M = 30.0  # how well the place of a loss is known
GAP_S = 30.0  # for how long it has been lost, where nobody says
EVERY_S = 300.0  # how often it is lost, for the share of time in contact


def lost(
    folder: Path,
    going_on: Resumed,
    place: Where,
    at_s: float,
    gap_s: float = GAP_S,
    permit: Permit = NO_PERMIT,
) -> Resumed:
    """Return the search for a target that was lost, from now on; all wait if nobody plans.

    Parameters
    ----------
    folder
        Of the run whose target it is.
    going_on
        Its mission from now on; who followed the target is where ``at_loss`` has it.
    place
        Where it was lost.
    at_s
        Now, seconds on the target's clock.
    gap_s
        For how long it has been lost, seconds.
    permit
        What its traffic may be.

    Raises
    ------
    InputError
        If no time is left to search.
    """
    opened = going_on.opened
    _refuse_no_time(opened, at_s, gap_s)
    changes = _changes(opened, place, at_s - gap_s)
    overrides = [f"{key}={toml_text(value)}" for key, value in changes.items()]
    anew = open_scenario(folder / PROVENANCE, overrides=overrides, permit=permit)
    return Resumed(anew, _waiting(anew), gap_s)


def at_loss(opened: OpenScenario, plan: Plan, place: Where, standing: Standing) -> Standing:
    """Return where UAVs are once a target is lost that one of them has followed.

    A single UAV is where the target was lost, if nothing else is said.

    Raises
    ------
    InputError
        If there are several targets, or several UAVs of which none is said to have followed it,
        or who has is on the ground by the plan.
    """
    refuse_several(opened, "--lost-at")
    if len(opened.scenario.uavs) == 1 and not standing.joined:
        said = standing.uavs.get(0, standing.of_only)
        there = replace(said, xy_m=said.xy_m or (place.x_m, place.y_m))
        standing = Standing(standing.at_s, uavs={**standing.uavs, 0: there})
    elif all(one.xy_m is None for one in [standing.of_only, *standing.uavs.values()]):
        raise InputError(
            "--lost-at: one of several UAVs has followed the target; say which one, and where it "
            "is, as --uav 2 --uav-at PLACE"
        )
    _refuse_grounded(opened, plan, standing)
    return standing


def _refuse_grounded(opened: OpenScenario, plan: Plan, standing: Standing) -> None:
    many = len(opened.scenario.uavs) + len(standing.joined)
    for number in grounded(opened, plan, standing):
        if number in standing.uavs and standing.uavs[number].xy_m is not None:
            raise InputError(
                f"--lost-at: by its plan {called(number, many)} is on the ground at "
                f"{clock(standing.at_s)}, and who has followed the target flies; give --at a time "
                "of its flight, or tell where the target was seen as --report"
            )


def _refuse_no_time(opened: OpenScenario, at_s: float, gap_s: float) -> None:
    horizon_s, zero_s = opened.scenario.search.horizon_s, at_s - gap_s
    if not 0.0 <= zero_s < at_s < horizon_s:
        raise InputError(
            f"--gap {gap_s:g}: the search is from 0:00:00 to {clock(horizon_s)}, and it was lost "
            f"at {clock(zero_s)}; give another time"
        )
    if opened.scenario.target.mix is not None:
        raise InputError("target.mix: is several beliefs, none of which starts at the loss anew")


def _changes(opened: OpenScenario, place: Where, zero_s: float) -> dict[str, Any]:
    """Return what is another way from a time on, which is time 0 then, by key of the scenario."""
    scenario = opened.scenario
    uavs = [_from(one, zero_s, scenario.target.last_seen_ago_s) for one in scenario.uavs]
    changes: dict[str, Any] = {
        "uav": uavs if len(uavs) > 1 else uavs[0],
        "search.horizon_s": scenario.search.horizon_s - zero_s,
        "news": {},
    }
    for key in ("target", "truth"):
        changes |= {
            f"{key}.start": {"x_m": place.x_m, "y_m": place.y_m, "radius_m": RADIUS_M},
            f"{key}.distance_m": "anywhere",
            f"{key}.last_seen_ago_s": 0.0,
        }
        if scenario.target.sighted_at is not None:
            moment = scenario.target.sighted_at + timedelta(seconds=zero_s)
            changes[f"{key}.sighted_at"] = moment.isoformat()
    return changes


def _from(uav: UavSection, zero_s: float, last_seen_ago_s: float) -> dict[str, Any]:
    """Return what a scenario says of a UAV, with times since another time 0."""
    table = uav.model_dump(mode="json", exclude_none=True)
    table["take_off_s"] = 0.0
    if uav.in_air is not None:
        table["in_air"]["at_s"] = uav.in_air.at_s - zero_s
    elif uav.sorties != 0:
        table["take_off_s"] = max(0.0, last_seen_ago_s + uav.take_off_s - zero_s)
    return table


def _waiting(opened: OpenScenario) -> Plan:
    """Return the plan in which each UAV that flies waits where it is."""
    flying = [
        (number, plan_of_wait(problem, "hover", problem.uav.x_m, problem.uav.y_m))
        for number, problem in enumerate(problems_of(opened, NO_TARGETS))
        if problem.uav.sorties
    ]
    tracks = tuple(plan.tracks[0] for _, plan in flying)
    legs = tuple(plan.legs[0] for _, plan in flying)
    return Plan("hover", tracks, legs, tuple(Sortie(number) for number, _ in flying))


def contact(search: Evaluation, every_s: float = EVERY_S) -> float:
    """Return the share of the time in which the target is seen, if it is lost again and again.

    Parameters
    ----------
    search
        What it takes to find it anew, from the loss on.
    every_s
        For how long it is seen in between.
    """
    return every_s / (every_s + search.expected_detection_time_s)
