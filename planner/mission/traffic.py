"""The traffic of a scenario, from its section and the files that it names."""

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from planner.belief.particles import Particles
from planner.clock import seconds
from planner.errors import InputError
from planner.futures.demand import Demand
from planner.futures.steering import control_of
from planner.futures.sumo_config import SumoConfig, read_config
from planner.futures.traffic import ALWAYS, NO_PERMIT, Permit, Traffic, input_options
from planner.futures.traffic_files import InputFiles, refuse_outside
from planner.messages import as_written
from planner.network.road_network import RoadNetwork
from planner.provenance import sha256_of_file
from planner.scenario.draft import Draft
from planner.scenario.traffic import TrafficSection

SHORTEST_STEP_S, LONGEST_STEP_S = 0.01, 10.0  # in between SUMO's vehicles drive sensibly
# What a scenario's motion may depend on, though it cannot be had.
MATTERS = ("load-state", "remote-port", "device.fcd-replay.files", "configuration-file")

log = logging.getLogger(__name__)


def traffic_of(draft: Draft, network: RoadNetwork, permit: Permit = NO_PERMIT) -> Traffic | None:
    """Return the traffic in which a scenario's targets drive; None where nothing is said of any.

    What of its configuration and files SUMO is not told is logged, in one line.

    Raises
    ------
    InputError
        If one of its files cannot be read, or is not what can be taken.
    """
    section = draft.traffic
    if section is None or not section.is_given:
        return None
    # Absolute: a process elsewhere reads them too.
    allowed = tuple(folder.absolute() for folder in (draft.folder, *permit.folders))
    given_as, config = _config(section, draft, network, allowed)
    control = None if permit.control is None else control_of(permit.control)
    traffic = Traffic(
        given_as=given_as,
        at_s=section.at_s,
        realisations=section.realisations,
        seed=draft.search.seed if draft.search is not None else 0,
        depart_offset_s=section.depart_offset_s,
        options=config.options,
        routes=config.files.get("route-files", ()),
        additional=config.files.get("additional-files", ()),
        weights=config.files.get("weight-files", ()),
        demand=_demand(section, draft),
        allowed=allowed,
        control=control,
    )
    files = InputFiles(allowed)
    input_options(traffic, files)
    read = [*files.read, *([] if control is None else [control.path])]
    traffic = replace(
        traffic,
        files=tuple((file, sha256_of_file(file)) for file in read),
        left_out=(*(one for one in config.left_out if one not in ALWAYS), *files.left_out),
    )
    _tell_left_out(traffic)
    return traffic


def on_its_clock(particles: Particles, traffic: Traffic | None) -> Particles:
    """Return particles that meet signals as they stand when traffic is warmed up.

    Whoever drives without SUMO, by the signals alone, needs to know; in traffic SUMO begins there.
    """
    if traffic is None or particles.driving != "traffic":
        return particles
    return replace(particles, phase_s=np.full(len(particles), int(traffic.at_s), np.int32))


def _config(
    section: TrafficSection, draft: Draft, network: RoadNetwork, allowed: Sequence[Path]
) -> tuple[Path, SumoConfig]:
    """Return what is taken of a configuration, or of a section as if it were one."""
    if section.sumocfg is None:
        files = {"route-files": section.routes or (), "additional-files": section.additional or ()}
        paths = {key: tuple(allowed[0] / name for name in names) for key, names in files.items()}
        return draft.path, SumoConfig((), paths, ())
    path = allowed[0] / section.sumocfg
    refuse_outside(path, draft.path, allowed)
    config = read_config(path)
    for net in config.files.get("net-file", ()):
        refuse_outside(net, path, allowed)
        _refuse_other_net(net, network, path, section)
    begin_s = _time_of(config, "begin", path)
    if not 0.0 <= begin_s <= section.at_s:
        raise InputError(
            f"{path}: begins at {as_written(begin_s)} s, after traffic.at, "
            f"{as_written(section.at_s)} s, or before 0; give another time"
        )
    step_s = _time_of(config, "step-length", path, usual=1.0)
    if not SHORTEST_STEP_S <= step_s <= LONGEST_STEP_S:
        raise InputError(
            f"{path}: its step-length is {as_written(step_s)} s; give one from "
            f"{SHORTEST_STEP_S:g} to {LONGEST_STEP_S:g}"
        )
    return path, config


def _refuse_other_net(
    net: Path, network: RoadNetwork, config: Path, section: TrafficSection
) -> None:
    if not net.is_file() or sha256_of_file(net) != network.sha256:
        raise InputError(
            f"{config}: its net, {net}, is not that of [network]; write net = "
            f"{as_written(section.sumocfg)} there"
        )


def _time_of(config: SumoConfig, name: str, path: Path, *, usual: float = 0.0) -> float:
    """Return an option that is a time, seconds."""
    try:
        return seconds(dict(config.options).get(name, usual))
    except InputError as error:
        raise InputError(f"{path}: {name}: {error}") from error


def _demand(section: TrafficSection, draft: Draft) -> Demand | None:
    if section.vehicles_per_hour is None:
        return None
    horizon_s = draft.search.horizon_s if draft.search is not None else 0.0
    return Demand(section.vehicles_per_hour, section.at_s + horizon_s)


def _tell_left_out(traffic: Traffic) -> None:
    if not traffic.left_out:
        return
    matters = any(name in MATTERS for name in traffic.left_out)
    log.log(
        logging.WARNING if matters else logging.INFO,
        "%s: SUMO is not told of %s",
        traffic.given_as,
        ", ".join(traffic.left_out),
    )
