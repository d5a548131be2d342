"""A target that was found and is lost again: to find it anew is to plan on a tight belief.

Time 0 is the moment of the loss from then on, and the place of it is where the target starts.
Without a plan the UAV would wait where it lost it.
"""

from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np

from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.errors import InputError
from planner.futures.none import NO_TARGETS
from planner.futures.traffic import NO_PERMIT, Permit
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.planning import problem_of
from planner.mission.resume import OfUav, Resumed, Standing
from planner.mission.run_folder import PROVENANCE
from planner.mission.several import refuse_fleet, refuse_several
from planner.network.place_words import Where
from planner.scenario.toml_text import toml_text
from planner.search.plan import plan_of_wait

RADIUS_M = 30.0  # how well the place of a loss is known
GAP_S = 30.0  # for how long it has been lost, where nobody says
EVERY_S = 300.0  # how often it is lost, for the share of time in contact


def lost(
    folder: Path,
    opened: OpenScenario,
    place: Where,
    standing: Standing,
    gap_s: float = GAP_S,
    permit: Permit = NO_PERMIT,
) -> Resumed:
    """Return the search for a target that was lost, from now on; it waits there if nobody plans.

    Parameters
    ----------
    folder
        Of the run whose target it is, and ``opened`` its scenario.
    place
        Where it was lost.
    standing
        Where the UAV is now; where the target was lost, if that does not say.
    gap_s
        For how long it has been lost, seconds.
    permit
        What its traffic may be.

    Raises
    ------
    InputError
        If no time is left to search, or not one UAV alone follows one target.
    """
    said = _said_of_only(opened, standing)
    _refuse_no_time(opened, standing.at_s, gap_s)
    changes = _changes(opened, place, said, standing.at_s, gap_s)
    overrides = [f"{key}={toml_text(value)}" for key, value in changes.items()]
    anew = open_scenario(folder / PROVENANCE, overrides=overrides, permit=permit)
    there = problem_of(anew, NO_TARGETS)
    waits = plan_of_wait(there, "hover", there.uav.x_m, there.uav.y_m)
    return Resumed(anew, waits, gap_s)


def _said_of_only(opened: OpenScenario, standing: Standing) -> OfUav:
    """Return what is said of the only UAV, which follows the target."""
    refuse_several(opened, "--lost-at")
    refuse_fleet(opened, "--lost-at: one UAV follows a target")
    said = standing.uavs.get(0, standing.of_only)
    if standing.joined or {*standing.uavs} - {0} or said.lost_s is not None:
        raise InputError(
            "--lost-at: UAV 1 alone follows the target, and flies on; leave out who else flies, "
            "or is lost"
        )
    return said


def _refuse_no_time(opened: OpenScenario, at_s: float, gap_s: float) -> None:
    horizon_s, zero_s = opened.scenario.search.horizon_s, at_s - gap_s
    if not 0.0 <= zero_s < at_s < horizon_s:
        raise InputError(
            f"--gap {gap_s:g}: the search is from 0:00:00 to {clock(horizon_s)}, and it was lost "
            f"at {clock(zero_s)}; give another time"
        )
    if opened.scenario.target.mix is not None:
        raise InputError("target.mix: is several beliefs, none of which starts at the loss anew")


def _changes(
    opened: OpenScenario, place: Where, said: OfUav, at_s: float, gap_s: float
) -> dict[str, Any]:
    """Return what is another way from now on, by key of the scenario."""
    scenario, zero_s, left_s = opened.scenario, at_s - gap_s, said.left_s
    if left_s is None:
        landing_s = problem_of(opened, NO_TARGETS).uav.landing_s
        left_s = landing_s - at_s if np.isfinite(landing_s) else None
    x_m, y_m = said.xy_m or (place.x_m, place.y_m)
    in_air = {"place": {"x_m": x_m, "y_m": y_m}, "at_s": gap_s}
    changes: dict[str, Any] = {
        "uav.in_air": in_air | ({} if left_s is None else {"left_s": left_s}),
        "uav.take_off_s": 0.0,
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
