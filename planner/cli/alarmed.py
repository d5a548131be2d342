"""What `planner fly --alarms` does: a plan flown with false alarms, late or planned anew."""

import argparse
from functools import partial

from planner.cli.arguments import permit_of
from planner.cli.printing import print_result
from planner.cli.progress import progress_bar
from planner.cli.session import Drive, recorded
from planner.messages import percent
from planner.mission.alarms import Alarms, compared
from planner.mission.live import BEST
from planner.mission.online import Mission, Remembering
from planner.mission.recorder import Recorder
from planner.mission.run_folder import open_run, refuse_no_run
from planner.mission.several import refuse_several
from planner.streams import stream

TARGETS, SEQUENCES, LASTS_S = 1000, 16, 120.0


def fly_alarmed(arguments: argparse.Namespace) -> int:
    """Print what planning anew after false alarms is worth, on the same alarms and targets."""
    refuse_no_run(arguments.directory)
    opened, stored = open_run(arguments.directory, permit_of(arguments))
    refuse_several(opened, "fly --alarms")
    seed = opened.scenario.search.seed if arguments.seed is None else arguments.seed
    lasts_s = LASTS_S if arguments.alarm_s is None else arguments.alarm_s
    alarms = Alarms(1.0 / arguments.alarms, lasts_s)
    drive = Drive.of_truth("recording true targets", opened)
    drawn = partial(Recorder.truths, targets=arguments.targets or TARGETS, seed=seed)
    targets = recorded(arguments, opened, drive, drawn).futures
    mission = Mission(Remembering(opened, arguments.jobs), stored.plan, BEST)
    horizon_s, many = opened.scenario.search.horizon_s, arguments.sequences or SEQUENCES
    gaps = [alarms.gaps_s(horizon_s, stream(seed, "alarms", number)) for number in range(many)]
    with progress_bar("flying with false alarms") as progress:
        found = compared(mission, targets, gaps, lasts_s, progress)
    low, high = found.interval
    late_s, anew_s = sum(found.late_s) / many, sum(found.anew_s) / many
    without_s = stored.evaluated["expected_detection_time_s"]
    summary = {
        "sequences": many,
        "targets": len(targets),
        "without_alarms_s": without_s,
        "late_s": late_s,
        "anew_s": anew_s,
        "saved": found.saved,
        "saved_ci95": [low, high] if many > 1 else None,
    }
    said = (
        f"an alarm every {alarms.every_s:,.0f} s of search, {lasts_s:g} s each: {many} flights "
        f"against {len(targets):,} targets"
    )
    worth = (
        f"expected detection {late_s:,.0f} s if the plan is flown late, {anew_s:,.0f} s if planned "
        f"anew after each: {percent(found.saved)} less (95 %: {percent(low)} .. {percent(high)}, "
        f"paired); {without_s:,.0f} s without alarms"
    )
    print_result(arguments, summary, [said, worth])
    return 0
