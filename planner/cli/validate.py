"""`planner validate`: whether the belief covers true vehicles as often as it says."""

import argparse
from typing import TYPE_CHECKING, Any

from planner.cli.arguments import add_backend, add_scenario, count, moment, path
from planner.cli.printing import print_result
from planner.messages import percent

if TYPE_CHECKING:
    from planner.arrays import Ints
    from planner.futures.futures import Futures
    from planner.mission.opening import OpenScenario
    from planner.mission.validate import Validation

SUMMARY = "check the belief against true vehicles of runs that no particle has seen"
DETAILS = """\
The true vehicles are targets that ride in realisations of the scenario's
traffic in which no particle rides, or those of files of yours, a file for each
day: SUMO's FCD, a futures.parquet, or the track of a GPS in one vehicle (GPX,
or CSV with time, lon and lat). They must set out as the scenario says of the
target. Intervals are over realisations, or days: cars of one queue behind each
other.
The exit code is 0 whatever is found; --json says so in "is_off".
"""
EXAMPLES = (
    ("validate traffic.toml", "against 20 unseen realisations"),
    ("validate traffic.toml --set target.driving=free", ""),
    ("validate berlin --truths mon.xml tue.xml --begin 8:00:00", ""),
    ("validate berlin --truths mon.gpx tue.gpx --begin 6:00:00", ""),
)
REALISATIONS, EACH = 20, 10


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner validate`."""
    add_scenario(parser)
    add_backend(parser, what="drive targets", needs="the net at the same place")
    parser.add_argument(
        "--realisations",
        type=count,
        default=REALISATIONS,
        metavar="N",
        help="of the traffic, in which truths ride (default: %(default)s)",
    )
    parser.add_argument(
        "--each",
        type=count,
        default=EACH,
        metavar="N",
        help="truths in each realisation (default: %(default)s)",
    )
    parser.add_argument(
        "--truths",
        type=path,
        nargs="+",
        metavar="FILE",
        help="true vehicles in files, one for each day, in place of the scenario's traffic",
    )
    parser.add_argument(
        "--begin",
        type=moment,
        metavar="TIME",
        help="the time in --truths that is time 0 of the search, in seconds or H:M:S; of a GPS "
        "in UTC, or as target.sighted_at has it",
    )


def run(arguments: argparse.Namespace) -> int:
    """Print how the belief covers truths, time by time."""
    from planner.cli.session import opened_scenario, planning_recorded, tell_belief
    from planner.mission.several import refuse_several
    from planner.mission.validate import validated

    opened = opened_scenario(arguments)
    refuse_several(opened, "validate")
    tell_belief(arguments)
    truths, run = _truths(arguments, opened)
    cloud = planning_recorded(arguments, opened).futures
    search = opened.scenario.search
    found = validated(cloud, truths, run, search.horizon_s, seed=search.seed)
    print_result(arguments, _content(found), [_table(found), *_verdict(found)])
    return 0


def _truths(arguments: argparse.Namespace, opened: "OpenScenario") -> "tuple[Futures, Ints]":
    """Return true vehicles, and the run of each."""
    from planner.cli.session import Drive, recorded
    from planner.futures.store import Recording
    from planner.mission.recorder import Recorder
    from planner.mission.truths import read_truths
    from planner.mission.validate import together_by_day

    if arguments.truths is not None:
        return together_by_day(read_truths(arguments.truths, opened, begin_s=arguments.begin))

    def record(recorder: Recorder) -> Recording:
        return recorder.validation(arguments.realisations, arguments.each)

    drive = Drive("recording truths", "traffic", "fewer (--each 5) take less")
    futures = recorded(arguments, opened, drive, record).futures
    assert futures.fates is not None
    return futures, futures.fates.realisation


def _table(found: "Validation") -> Any:
    from planner.report.formats import titled_table

    table = titled_table("")
    table.add_column("measure")
    for name in ("at", "truths within\nmiddle 90 %", "less 90 %", "their mean\nto particles'"):
        table.add_column(name, justify="right")
    for check in found.checks:
        flagged = " !" if check.is_off else ""
        ratio = check.ratio
        table.add_row(
            check.measure,
            f"{check.time_s:g} s",
            percent(check.covered),
            f"{percent(check.coverage.off, sign=True)} +- {percent(check.coverage.half)}{flagged}",
            "" if ratio is None else f"{percent(ratio.off, sign=True)} +- {percent(ratio.half)}",
        )
    return table


def _verdict(found: "Validation") -> list[str]:
    from planner.mission.validate import COVERED, FEWEST

    there = f" of {found.particle_runs} runs" if found.particle_runs else ""
    runs, least = found.truth_runs, found.smallest_seen
    said = "the belief is wrong (!)" if found.is_off else "nothing is seen against the belief"
    if not (found.can_show or found.is_off):
        said = f"nothing can be told from {runs} runs"
    lines = [
        f"{said}: {found.particles} particles{there}",
        f"against {found.truths} truths of {runs} runs",
        "+- is half of a 95 % interval over runs, for all checks together: the least",
        "deviation that so many could have shown",
    ]
    if not found.can_show:
        return [
            *lines,
            f"so few can show nothing: a belief that covers none would pass; take {FEWEST} runs",
        ]
    lines.append(
        f"the smallest effect that {runs} runs could have seen: {percent(COVERED - least)} covered "
        f"in place of {percent(COVERED, 0)}"
    )
    if least > 1.0 - COVERED:
        lines.append("a belief that is too wide, and covers all, would not have been seen by them")
    return lines


def _content(found: "Validation") -> dict[str, Any]:
    return {
        "is_off": found.is_off,
        "can_show": found.can_show,
        "smallest_seen": found.smallest_seen,
        "particles": found.particles,
        "particle_runs": found.particle_runs,
        "truths": found.truths,
        "truth_runs": found.truth_runs,
        "checks": [
            {
                "measure": check.measure,
                "time_s": check.time_s,
                "covered": check.covered,
                "off": check.coverage.off,
                "smallest_seen": check.coverage.half,
                "is_off": check.is_off,
                "way_off": None if check.ratio is None else check.ratio.off,
                "way_smallest_seen": None if check.ratio is None else check.ratio.half,
            }
            for check in found.checks
        ],
    }
