"""What `planner fly --alarms` does: a plan flown with false alarms, late or planned anew."""

import argparse
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from statistics import fmean
from typing import Any, NamedTuple

import numpy as np

from planner.cli.arguments import permit_of
from planner.cli.printing import print_result
from planner.cli.progress import progress_bar
from planner.cli.session import Drive, recorded
from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.errors import InputError
from planner.futures.crowd import crowds
from planner.messages import percent
from planner.mission.alarms import (
    ALARMS,
    Alarms,
    Compared,
    NextAlarm,
    by_chance,
    by_lookalikes,
    compared,
)
from planner.mission.live import BEST
from planner.mission.online import Mission, Remembering
from planner.mission.opening import OpenScenario
from planner.mission.recorder import Recorder
from planner.mission.run_folder import open_run, refuse_no_run
from planner.mission.several import refuse_fleet, refuse_several
from planner.report.finds import span_of
from planner.streams import stream

TARGETS, SEQUENCES, LASTS_S = 1000, 16, 120.0
# Realisations of the traffic whose cars are met, no particle nor target among them. Intervals are
# over which cars look like the target; what other traffic would change is not in them.
CROWDS = 2


class _Series(NamedTuple):
    """The false alarms of some flights."""

    said: str
    lasts_s: float
    flights: Sequence[Callable[[], NextAlarm]]


def fly_alarmed(arguments: argparse.Namespace) -> int:
    """Print what planning anew after false alarms is worth, on the same alarms and targets."""
    refuse_no_run(arguments.directory)
    opened, stored = open_run(arguments.directory, permit_of(arguments))
    refuse_several(opened, "fly --alarms")
    refuse_fleet(opened, ALARMS)
    seed = opened.scenario.search.seed if arguments.seed is None else arguments.seed
    among = _by_chance if arguments.alarms else _among_cars
    series = among(arguments, opened, seed)
    drive = Drive.of_truth("recording true targets", opened)
    drawn = partial(Recorder.truths, targets=arguments.targets or TARGETS, seed=seed)
    targets = recorded(arguments, opened, drive, drawn).futures
    mission = Mission(Remembering(opened, arguments.jobs), stored.plan, BEST)
    with progress_bar("flying with false alarms") as progress:
        found = compared(mission, targets, series.flights, series.lasts_s, progress)
    without = evaluate(stored.plan.tracks, targets, stored.sensor, stored.objective)
    print_result(arguments, _summary(found, without), [*_lines(series, found, without)])
    return 0


def _summary(found: Compared, without: Evaluation) -> dict[str, Any]:
    return {
        "sequences": len(found.late_s),
        "targets": len(without.weight),
        "without_alarms_s": without.expected_detection_time_s,
        "late_s": fmean(found.late_s),
        "anew_s": fmean(found.anew_s),
        "saved": found.saved,
        "saved_ci95": list(found.interval) if len(found.late_s) > 1 else None,
        "found_without_alarms": without.detection_probability,
        "found_late": fmean(found.late_found),
        "found_anew": fmean(found.anew_found),
    }


def _lines(series: _Series, found: Compared, without: Evaluation) -> Iterator[str]:
    within = "(of one flight there is no interval)"
    if len(found.late_s) > 1:
        within = f"(95 %: {span_of(percent, found.interval)}, paired)"
    yield f"{series.said}: {len(found.late_s)} flights against {len(without.weight):,} targets"
    yield (
        f"expected detection {fmean(found.late_s):,.0f} s if the plan is flown late, "
        f"{fmean(found.anew_s):,.0f} s if planned anew after each: {percent(found.saved)} less "
        f"{within}; "
        f"{without.expected_detection_time_s:,.0f} s without alarms"
    )
    yield (
        f"found: {percent(fmean(found.late_found))} if the plan is flown late, "
        f"{percent(fmean(found.anew_found))} if planned anew, "
        f"{percent(without.detection_probability)} without alarms"
    )


def _by_chance(arguments: argparse.Namespace, opened: OpenScenario, seed: int) -> _Series:
    """Return alarms that come at a rate."""
    lasts_s = LASTS_S if arguments.alarm_s is None else arguments.alarm_s
    alarms = Alarms(1.0 / arguments.alarms, lasts_s)
    horizon_s, many = opened.scenario.search.horizon_s, arguments.sequences or SEQUENCES
    gaps = [alarms.gaps_s(horizon_s, stream(seed, "alarms", number)) for number in range(many)]
    said = f"an alarm every {alarms.every_s:,.0f} s of search, {lasts_s:g} s each"
    return _Series(said, lasts_s, [partial(by_chance, one.tolist()) for one in gaps])


def _among_cars(arguments: argparse.Namespace, opened: OpenScenario, seed: int) -> _Series:
    """Return alarms that are cars in traffic, of which a share looks like the target."""
    sensor, traffic = opened.scenario.sensor, opened.traffic
    if traffic is None or sensor.lookalike is None or sensor.check_s is None:
        raise InputError(
            "--alarms: without a rate they are cars in traffic: set sensor.lookalike and "
            "sensor.check_s in a scenario that has [traffic], or give a rate, such as 1/600"
        )
    lasts_s = sensor.check_s if arguments.alarm_s is None else arguments.alarm_s
    # After those of particles and of targets, which are as many.
    unseen = [2 * traffic.realisations + number for number in range(CROWDS)]
    horizon_s = opened.scenario.search.horizon_s
    cars = crowds(opened.network, traffic, unseen, horizon_s, arguments.jobs)
    flights = []
    for number in range(arguments.sequences or SEQUENCES):
        there = cars[number % CROWDS]
        alike = stream(seed, "lookalikes", number).random(len(there)) < sensor.lookalike
        some = there.take(np.flatnonzero(alike))
        flights.append(partial(by_lookalikes, some, sensor.radius_m))
    said = (
        f"{percent(sensor.lookalike)} of {sum(map(len, cars)) / CROWDS:,.0f} cars look like the "
        f"target, {lasts_s:g} s each, in {CROWDS} realisations of the traffic"
    )
    return _Series(said, lasts_s, flights)
