"""Measure the paper's planners over many seeds, and compare each mean with a reference value.

Measured is the expected detection time E[min(tau, 10,000 s)] on the grid of Section 5, for start
distances u0 of the UAV from Figure 8 of the paper: radius 500 m, take-off at 0, 16 roads, 1,000
particles. Every plan is evaluated on the same fresh targets, which no planner has seen.
"""

import argparse
import json
import logging
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from planner import Evaluation, Futures, OpenScenario, Recorder, evaluate, make_plan, method_named
from planner import open_scenario as open_any
from planner.cli.printing import console
from planner.cli.progress import progress_bar
from planner.errors import PlannerError
from planner.files import written_whole
from planner.intervals import NORMAL_95
from planner.messages import percent
from planner.mission.planning import problem_of
from planner.progress import Progress

EPILOG = """\
A row agrees if the two means differ by no more than their 95 % interval. The interval has three
parts: planning seeds here, planning seeds of the reference, and the fresh targets of both. So one
in 20 rows that truly agree is expected to be reported as different.

The first run records all targets in SUMO, which takes some minutes with the default numbers; later
runs read them from the cache.
"""

U0_KM = (0, 60, 120, 180, 300, 500, 700)
SETTING = ("sensor.radius_m=500", "uav.take_off_s=0", "search.depth=16", "search.horizon_s=10000")
# The reference values are means of a throw-away program without SUMO that this one replaced.
REFERENCE_TARGETS = 20_000  # what the reference values were evaluated on
REFERENCE_SEEDS = 10
ROUNDING_S = 0.5  # reference values are whole seconds


@dataclass(frozen=True)
class Row:
    """A method, its settings, and its reference values: a mean, or a range that contains it."""

    name: str
    method: str
    reference_s: Mapping[int, float | tuple[float, float]]  # by u0 in km
    overrides: tuple[str, ...] = ()
    random: bool = False  # plans depend on the particles
    seeds: Mapping[int, int] = field(default_factory=dict)  # of a reference, if not 10


def _by_u0(*values: float | tuple[float, float]) -> dict[int, float | tuple[float, float]]:
    return dict(zip(U0_KM, values, strict=True))


def _greedy(direction: str, *values: float, ties: str = "lowest index", **others: Any) -> Row:
    name = f"greedy, {direction}" + ("" if ties == "lowest index" else f", {ties}")
    overrides = (f'greedy.direction="{direction}"', f'greedy.ties="{ties}"')
    return Row(name, "greedy", _by_u0(*values), overrides, random=True, **others)


LONG = 10000.0
ROWS = (
    Row("exhaustive", "exhaustive", _by_u0(840, 8563, LONG, LONG, LONG, LONG, LONG)),
    Row(
        "exhaustive-shortest",
        "exhaustive-shortest",
        _by_u0(230, (5500, 6000), (9600, 9715), LONG, LONG, LONG, LONG),
    ),
    Row("wait", "wait", _by_u0(6815, 7448, 7160, 7416, 7350, 7429, 8297)),
    _greedy("own", 230, 1570, 3073, 4265, 5534, 6956, 8183),
    # At 60 km ten seeds gave 1,554 s, two hundred 1,612 s.
    _greedy("both", 207, 1612, 2975, 4255, 5906, 7278, 8220, seeds={60: 200}),
    _greedy("nearest end", 230, 1436, 2817, 3999, 5498, 6894, 8179),
    # The choice between equally good roads matters most where few targets can be met.
    _greedy("own", 230, 1570, 3073, 4265, 5534, 6956, 8183, ties="earliest end"),
    _greedy("nearest end", 230, 1436, 2817, 3999, 5498, 6894, 8179, ties="earliest end"),
)


@dataclass(frozen=True)
class Cell:
    """One method at one distance, over all planning seeds."""

    method: str
    u0_km: int
    mean_s: float
    seeds_error_s: float  # standard error of the mean over planning seeds
    targets_error_s: float  # standard error that all seeds share: the fresh targets
    spread_s: float  # standard deviation from one seed to another
    found: float  # probability
    reference_s: float | tuple[float, float]
    reference_error_s: float
    by_seed_s: tuple[float, ...]

    @property
    def apart_s(self) -> float:
        """By how much the mean lies above the reference; 0 within its range."""
        low, high = np.broadcast_to(self.reference_s, 2)
        return float(self.mean_s - np.clip(self.mean_s, low, high))

    @property
    def allowed_s(self) -> float:
        """By how much means of the same quantity may lie apart, with 95 % confidence."""
        errors = (self.seeds_error_s, self.targets_error_s, self.reference_error_s)
        return NORMAL_95 * float(np.hypot.reduce(errors)) + ROUNDING_S

    @property
    def agrees(self) -> bool:
        """Whether chance explains the difference."""
        return abs(self.apart_s) <= self.allowed_s


def cell(row: Row, u0_km: int, evaluations: Sequence[Evaluation]) -> Cell:
    """Return the statistics of one method's plans, given one evaluation per seed."""
    values = np.array([one.expected_detection_time_s for one in evaluations])
    spread_s = float(values.std(ddof=1)) if len(values) > 1 else 0.0
    # The targets' share: all plans meet all of them, so take each target's mean time over plans.
    time_s = np.mean([one.time_s for one in evaluations], axis=0)
    targets_s = float(time_s.std(ddof=1)) if len(time_s) > 1 else 0.0
    seeds = row.seeds.get(u0_km, REFERENCE_SEEDS)
    reference_s = row.reference_s[u0_km]
    return Cell(
        method=row.name,
        u0_km=u0_km,
        mean_s=float(values.mean()),
        seeds_error_s=spread_s / len(values) ** 0.5,
        targets_error_s=targets_s / len(time_s) ** 0.5,
        spread_s=spread_s,
        found=float(np.mean([one.detection_probability for one in evaluations])),
        reference_s=reference_s,
        reference_error_s=float(
            np.hypot(spread_s / seeds**0.5, targets_s / REFERENCE_TARGETS**0.5)
        ),
        by_seed_s=tuple(values.tolist()),
    )


def opened_at(u0_km: int, seed: int, overrides: Iterable[str] = ()) -> OpenScenario:
    """Return the scenario with the UAV at a distance from the origin."""
    distance = f"uav.start.distance_m={1000 * u0_km}"
    given = (*SETTING, f"search.seed={seed}", distance, *overrides)
    return open_any("grid5x5", overrides=given)


def recordings(wanted: argparse.Namespace, progress: Progress) -> tuple[list[Futures], Futures]:
    """Return the particles of each planning seed, and the fresh targets common to all.

    Seed 0 is nobody's but the targets'.
    """
    total = wanted.seeds * wanted.particles + wanted.targets

    def recorder(seed: int, before: int) -> Recorder:
        opened = opened_at(0, seed, [f"search.particles={wanted.particles}"])
        return Recorder(opened, wanted.jobs, lambda done, *_: progress(before + done, total))

    fresh = recorder(0, 0).evaluation(wanted.targets).futures
    planning = [
        recorder(seed, wanted.targets + (seed - 1) * wanted.particles).planning().futures
        for seed in range(1, wanted.seeds + 1)
    ]
    return planning, fresh


def measured(row: Row, u0_km: int, planning: Sequence[Futures], fresh: Futures) -> Cell:
    """Return what one method achieves at one distance."""
    opened = opened_at(u0_km, 1, row.overrides)
    one = partial(_evaluated, row, opened, fresh)
    with ThreadPoolExecutor(2) as threads:  # the compiled code releases the GIL
        return cell(row, u0_km, list(threads.map(one, planning if row.random else planning[:1])))


def _evaluated(row: Row, opened: OpenScenario, fresh: Futures, futures: Futures) -> Evaluation:
    plan = make_plan(method_named(row.method), opened, Recorder(opened), futures).plan
    problem = problem_of(opened, futures)
    return evaluate(plan.tracks, fresh, problem.sensor, problem.objective)


def cells(wanted: argparse.Namespace) -> Iterator[Cell]:
    """Record, plan and evaluate; yield the table's rows."""
    with progress_bar("recording in SUMO") as progress:
        planning, fresh = recordings(wanted, progress)
    rows = [row for row in ROWS if not wanted.only or row.name in wanted.only]
    pairs = [(row, u0_km) for row in rows for u0_km in U0_KM if u0_km in wanted.u0_km]
    with progress_bar("planning and evaluating") as progress:
        for done, (row, u0_km) in enumerate(pairs):
            progress(done, len(pairs))
            yield measured(row, u0_km, planning, fresh)


def show(found: Sequence[Cell], title: str) -> None:
    """Print the table, and how many rows agree."""
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    table.add_column("method", no_wrap=True)
    columns = ("u0 km", "E s", "± se", "spread", "found", "reference", "± se", "apart")
    for name in (*columns, "allowed"):
        table.add_column(name, justify="right")
    table.add_column("verdict")
    for one in found:
        table.add_row(*_texts(one), end_section=one.u0_km == max(c.u0_km for c in found))
    out = console()
    out.print(table)
    out.print(f"{sum(one.agrees for one in found)} of {len(found)} agree")


def _texts(one: Cell) -> Iterator[str]:
    yield from (one.method, str(one.u0_km), f"{one.mean_s:,.0f}")
    yield f"{np.hypot(one.seeds_error_s, one.targets_error_s):.0f}"
    yield from (f"{one.spread_s:.0f}", percent(one.found))
    yield "..".join(f"{value:,.0f}" for value in np.unique(one.reference_s))
    yield from (f"{one.reference_error_s:.0f}", f"{one.apart_s:+,.0f}", f"{one.allowed_s:.0f}")
    yield "agrees" if one.agrees else "DIFFERS"


def arguments(argv: Sequence[str] | None = None) -> argparse.Namespace:
    """Return what the command line asks for."""
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add: Callable[..., Any] = parser.add_argument
    add("--seeds", type=_count, default=40, help="sets of particles to plan on (default 40)")
    add("--particles", type=_count, default=1000, help="particles in each set (default 1000)")
    add("--targets", type=_count, default=20000, help="fresh targets (default 20000)")
    help_u0 = f"start distances, all by default: {' '.join(map(str, U0_KM))}"
    add("--u0-km", type=int, nargs="+", choices=U0_KM, default=U0_KM, metavar="KM", help=help_u0)
    names = [row.name for row in ROWS]
    help_only = f"only this method, one of: {'; '.join(names)}; repeatable"
    add("--only", action="append", choices=names, metavar="METHOD", help=help_only)
    add("-j", "--jobs", type=_count, help="processes that run SUMO (default one per core)")
    add("--json", type=Path, metavar="FILE", help="also write the rows, with every seed, to FILE")
    return parser.parse_args(argv)


def _count(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a number from 1 up")
    return number


def main(argv: Sequence[str] | None = None) -> None:
    """Print the table."""
    wanted = arguments(argv)
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    try:
        found = list(cells(wanted))
        title = (
            f"E[min(tau, 10,000 s)]: {wanted.seeds} planning seeds of {wanted.particles:,} "
            f"particles, {wanted.targets:,} fresh targets"
        )
        show(found, title)
        if wanted.json:
            with written_whole(wanted.json) as path:
                rows = [asdict(one) | {"agrees": one.agrees} for one in found]
                path.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    except PlannerError as error:
        print(f"paper_table: {error}", file=sys.stderr)
        raise SystemExit(2) from error


if __name__ == "__main__":
    main()
