"""A UAV that joins a search: one more in the scenario, from the ground, when it is ready."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from planner.errors import Fault, InputError
from planner.mission.opening import OpenScenario
from planner.mission.uav_airspace import airspace_for
from planner.scenario.aircraft_file import aircraft_written_out
from planner.scenario.checks import horizon_faults, uav_faults
from planner.scenario.faults import faults_of
from planner.scenario.fleet import ALTITUDE, with_heights
from planner.scenario.uav import UavSection

KEY = "joined"  # by which its faults are told
OWN = ("start", "take_off_s", "in_air", "sorties", "swap_s", ALTITUDE)  # that it shares with nobody


@dataclass(frozen=True)
class Joined:
    """Who joins."""

    ready_s: float  # when it can take off, seconds on the target's clock
    # as a table [[uav]] has it; what is left out is as its aircraft has it, if it names one, else
    # as the first UAV has it, but for the place and the height
    uav: Mapping[str, Any]


def with_joined(opened: OpenScenario, joined: Iterable[Joined], at_s: float) -> OpenScenario:
    """Return a scenario with more UAVs, the last ones; none of them takes off before a time.

    Raises
    ------
    InputError
        If one of them is faulty.
    """
    for one in joined:
        opened = _with(opened, one, at_s)
    return opened


def _with(opened: OpenScenario, one: Joined, at_s: float) -> OpenScenario:
    scenario = opened.scenario
    section = _section(opened, one, max(one.ready_s, at_s) - scenario.target.last_seen_ago_s)
    airspace, faults = airspace_for(section, scenario, opened.network)
    faults += [*uav_faults(section)]
    faults += horizon_faults(scenario.target, section, scenario.search)
    _refuse(fault.renamed("uav", KEY) for fault in faults)
    return replace(
        opened,
        scenario=replace(scenario, others=(*scenario.others, section)),
        other_airspaces=(*opened.other_airspaces, airspace),
    )


def _section(opened: OpenScenario, one: Joined, take_off_s: float) -> UavSection:
    """Return what a scenario says of who joins, at a height of its own."""
    scenario, faults = opened.scenario, list[Fault]()
    there = [uav.model_dump(mode="json", exclude_none=True) for uav in scenario.uavs]
    if "aircraft" in one.uav:
        abstract = opened.network.is_abstract
        table = aircraft_written_out(one.uav, scenario.folder, faults, abstract=abstract)
    else:
        table = {**{key: said for key, said in there[0].items() if key not in OWN}, **one.uav}
    _refuse(fault.renamed("uav", KEY) for fault in faults)
    table["take_off_s"] = take_off_s
    usual_m = scenario.uav.altitude_m
    *_, table = with_heights([*there, one.uav], [*there, table], usual_m)
    section, errors = UavSection.checked(table)
    _refuse(faults_of(KEY, UavSection, errors))
    assert section is not None
    return section


def _refuse(faults: Iterable[Fault]) -> None:
    """Do nothing if nothing is wrong; else tell the first thing that is."""
    for fault in faults:
        raise InputError(str(fault))
