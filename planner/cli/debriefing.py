"""What `planner fly --track` does: a recorded flight beside its plan, and what it leaves."""

import argparse
from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any

from planner.cli.arguments import permit_of
from planner.cli.printing import print_result
from planner.cli.session import Drive, output_folder, recorded
from planner.errors import InputError
from planner.export.from_run import placed
from planner.futures.state_at import RoadState, State, by_road, state_at
from planner.futures.store import Recording
from planner.mission.debrief import Debrief, Wanted, debrief, reading_of, still_unseen
from planner.mission.opening import OpenScenario
from planner.mission.plan_file import StoredPlan
from planner.mission.recorder import Recorder
from planner.mission.run_folder import (
    FLIGHTS,
    OTHER_TARGETS,
    open_run,
    own_futures,
    refuse_no_run,
)
from planner.mission.several import refuse_fleet, refuse_several
from planner.report import debrief as told
from planner.report import run_files, where
from planner.scenario.aircraft_file import with_aircraft
from planner.telemetry.flown import BREAK_S, Flown, flown
from planner.telemetry.read import read_log

FILES = (FLIGHTS, *where.FILES)


def debriefed(arguments: argparse.Namespace) -> int:
    """Print what a recorded flight was worth, and where the target can still be."""
    refuse_no_run(arguments.directory)
    with ExitStack() as stack:
        folder = output_folder(stack, arguments, FILES)
        opened, stored = open_run(arguments.directory, permit_of(arguments))
        refuse_several(opened, "fly --track")
        refuse_fleet(opened, "--track: is what one UAV recorded")
        flight = _flight(arguments, opened, stored)
        at_s = _at_s(arguments, flight, stored)
        targets = _fresh(arguments, opened, stored)
        found = debrief(flight, stored, targets.futures)
        believed = _believed(arguments, opened, targets).futures
        left = still_unseen(believed, flight.track, stored.sensor, at_s)
        state = state_at(left, opened.network, at_s)
        roads = by_road(state, opened.network)
        if folder is not None:
            run_files.write_flights(folder / FLIGHTS, targets, found.flown)
            where.write_where(folder, opened, state, roads, flown=flight.track)
    notes = [] if own_futures(arguments.directory) is None else [OTHER_TARGETS]
    written = [] if folder is None else [f"written to {arguments.output}"]
    blocks = [*_blocks(found, opened, state, roads), *notes, *written]
    print_result(arguments, _summary(found, opened, state, roads), blocks)
    return 0


def _flight(arguments: argparse.Namespace, opened: OpenScenario, stored: StoredPlan) -> Flown:
    """Return the flight that was recorded."""
    file = arguments.aircraft
    wanted = Wanted(
        uav=None if file is None else with_aircraft(opened.scenario.uav, file),
        take_off_s=arguments.takes_off_at,
        sensor_from_m=arguments.sensor_from,
        break_s=BREAK_S if arguments.break_after is None else arguments.break_after,
    )
    network, log = opened.network, read_log(arguments.track)
    if arguments.origin is not None:
        network = placed(network, arguments.origin)
    return flown(log, network, reading_of(opened, stored, wanted))


def _at_s(arguments: argparse.Namespace, flight: Flown, stored: StoredPlan) -> float:
    """Return for which time to say where the target can be; if not given, the flight's end."""
    horizon_s = stored.objective.horizon_s
    if arguments.at is None:
        return min(flight.track.end_s, horizon_s)
    if not 0.0 <= arguments.at <= horizon_s:
        raise InputError(
            f"--at {arguments.at:g}: the search is from 0 to {horizon_s:g} s; choose a time then"
        )
    return float(arguments.at)


def _fresh(arguments: argparse.Namespace, opened: OpenScenario, stored: StoredPlan) -> Recording:
    """Return the targets that both flights are held against: those of the run, or others."""
    many: int = arguments.targets or stored.evaluated["targets"]
    drive = Drive.of_truth("recording fresh targets", opened)

    def record(recorder: Recorder) -> Recording:
        if arguments.seed is None:
            return recorder.evaluation(many)
        return recorder.truths(many, seed=arguments.seed)

    return recorded(arguments, opened, drive, record)


def _believed(arguments: argparse.Namespace, opened: OpenScenario, targets: Recording) -> Recording:
    """Return particles of the belief that no plan was made on.

    Fresh targets are such, unless the scenario has them differ from what is believed.
    """
    if opened.scenario.truth == opened.scenario.target:
        return targets
    drive = Drive.of_belief("recording particles", opened)
    return recorded(arguments, opened, drive, Recorder.holdout)


def _summary(
    found: Debrief, opened: OpenScenario, state: State, roads: Sequence[RoadState]
) -> dict[str, Any]:
    elsewhere = state.elsewhere_probability
    still = where.where_content(
        roads, opened.network, time_s=state.time_s, elsewhere_probability=elsewhere
    )
    return told.as_dict(found) | {"still": still}


def _blocks(
    found: Debrief, opened: OpenScenario, state: State, roads: Sequence[RoadState]
) -> list[Any]:
    table = where.where_table(
        roads,
        opened.network,
        time_s=state.time_s,
        elsewhere_probability=state.elsewhere_probability,
    )
    return [
        *told.reading_lines(found),
        told.odds_table(found),
        told.still_line(found, state.time_s),
        table,
    ]
