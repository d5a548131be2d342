"""Sensors that miss, fleets, news in flight, wrong beliefs: every figure beside what it must reach.

Most is measured on the 5 x 5 grid from 60, 120 and 300 km, on 65,536 common fresh targets. The
whole takes about three hours of CPU, most of it for reports and alarms, and more when towns have to
be recorded first; times of answers are by the clock, so leave the computer alone meanwhile. --small
shows in some minutes that all works, and no more.

python tools/benchmark.py --online [--only reports] [--km 120] [--small]
"""

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from benchmarks import answers, beliefs, fleet, misses, news, two_targets
from benchmarks.figures import Figure, machine, show
from benchmarks.grid import DISTANCES_KM, fresh, opened_at
from benchmarks.towns import TOWNS
from planner.errors import PlannerError


class Size(NamedTuple):
    """How much is measured."""

    seeds: int  # of planning
    targets: int  # that judge plans
    reports: int  # at each of three times
    sequences: int  # of alarms
    finds: int  # drawn, of the first of two targets
    berlin: int  # targets that judge plans there
    particles: int  # that plans are made on after a report in a town


FULL = Size(5, targets=65_536, reports=200, sequences=64, finds=64, berlin=2100, particles=2000)
SMALL = Size(2, targets=4096, reports=2, sequences=2, finds=4, berlin=200, particles=200)
Section = tuple[str, Iterator[Figure]]


def _misses(size: Size, distances_km: Sequence[int]) -> Iterator[Section]:
    for km in distances_km:
        yield f"misses, {km} km", misses.on_the_grid(km, size.seeds, size.targets)
    yield "misses, berlin", misses.in_berlin(size.seeds, size.berlin)


def _fleets(size: Size, distances_km: Sequence[int]) -> Iterator[Section]:
    for km in distances_km:
        judges = fresh(opened_at(km), size.targets)
        yield f"fleets, {km} km", fleet.fleet_rows(km, size.seeds, judges)


def _silence(size: Size, distances_km: Sequence[int]) -> Iterator[Section]:
    for km in distances_km:
        yield f"no news, {km} km", news.silence_rows(km, size.targets)


def _reports(size: Size, distances_km: Sequence[int]) -> Iterator[Section]:
    for km in distances_km:
        yield f"reports, {km} km", news.report_rows(km, size.targets, size.reports)


def _alarms(size: Size, distances_km: Sequence[int]) -> Iterator[Section]:
    for km in sorted({*distances_km} & {*news.LATE_AIMS}):
        yield f"alarms, {km} km", news.alarm_rows(km, size.targets, size.sequences)


def _targets(size: Size, distances_km: Sequence[int]) -> Iterator[Section]:
    for km in distances_km:
        yield f"two targets, {km} km", two_targets.corner_rows(km, size.targets, size.finds)
        yield f"two alike, {km} km", two_targets.alike_rows(km, size.targets, size.finds)


def _caution(size: Size, distances_km: Sequence[int]) -> Iterator[Section]:
    for km in distances_km:
        yield f"caution, {km} km", beliefs.caution_rows(km, size.seeds, size.targets)


def _questions(_: Size, distances_km: Sequence[int]) -> Iterator[Section]:
    for km in distances_km:
        yield f"questions, {km} km", answers.question_rows(km)


def _live(size: Size, _: Sequence[int]) -> Iterator[Section]:
    for town in TOWNS:
        yield f"live, {town}", answers.live_rows(town, size.particles)


PARTS: dict[str, Callable[[Size, Sequence[int]], Iterator[Section]]] = {
    "misses": _misses,
    "fleets": _fleets,
    "no-news": _silence,
    "reports": _reports,
    "alarms": _alarms,
    "targets": _targets,
    "caution": _caution,
    "questions": _questions,
    "live": _live,
}


def main(argv: Sequence[str] | None = None) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        prog="benchmark.py --online",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--only",
        choices=PARTS,
        action="append",
        metavar="NAME",
        help=f"this part; repeatable: {', '.join(PARTS)}",
    )
    parser.add_argument(
        "--km", type=int, choices=DISTANCES_KM, action="append", help="this distance; repeatable"
    )
    parser.add_argument(
        "--small", action="store_true", help="few seeds, targets, reports and alarms"
    )
    parser.add_argument("--seeds", type=int, metavar="N", help="of planning (default: 5)")
    parser.add_argument("--targets", type=int, metavar="N", help="default: 65,536")
    wanted = parser.parse_args(argv)
    size = SMALL if wanted.small else FULL
    size = size._replace(seeds=wanted.seeds or size.seeds, targets=wanted.targets or size.targets)
    host, figures = machine(), list[tuple[str, Figure]]()
    try:
        for name in wanted.only or PARTS:
            for section, rows in PARTS[name](size, wanted.km or DISTANCES_KM):
                for row in rows:
                    told = f"{section}: {row.what}: {row.median:,.4g} {row.unit}"
                    print(told, file=sys.stderr, flush=True)
                    figures.append((section, row))
    except PlannerError as error:
        print(f"benchmark: {error}", file=sys.stderr)
        return 2
    show(figures, host)
    return 0
