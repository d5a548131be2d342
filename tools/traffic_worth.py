"""What traffic is worth to a plan: made on free futures, on one realisation, on a mixture.

Each plan is flown against the same true vehicles, which ride in realisations that no particle has
seen, and intervals are over these. Beside it stands what a cheat would report: flown in the very
realisation that the particles have ridden in, whose queues the plan has learnt.

Recordings are kept in the cache: a run that is stopped goes on. Bologna is left out where its data
are not (set PLANNER_DATA to the folder that holds bologna_acosta).

python tools/traffic_worth.py [--particles 200] [--truths 10] [--only bologna] [-j 2]
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from benchmarks.traffic_cases import berlin, bologna

from planner import (
    Futures,
    OpenScenario,
    Plan,
    evaluate,
    make_plan,
    method_named,
    open_scenario,
    problem_of,
)
from planner.arrays import Floats
from planner.belief.mixture import in_traffic
from planner.belief.particles import Realisations
from planner.belief.recipe import Drawn
from planner.futures.record import How
from planner.futures.store import recorded
from planner.intervals import means_of_runs, student_interval
from planner.messages import percent
from planner.mission.recorder import Recorder

UNSEEN, JUDGES = 100, 10  # realisations of truths: from which one on, and how many
MIXED = 4  # realisations in a mixture
METHOD = "rate"
BELIEFS = {
    "free": ("target.driving=free",),
    "one realisation": ("traffic.realisations=1",),
    f"mixture of {MIXED}": (f"traffic.realisations={MIXED}",),
}


class Case(NamedTuple):
    """A town with traffic, as a scenario file."""

    name: str
    path: Path


def cases(folder: Path, particles: int) -> Iterator[Case]:
    """Yield the towns that there are."""
    for per_hour in (1000, 3000, 4500):
        path = berlin(folder / f"berlin{per_hour}", per_hour, particles)
        yield Case(f"Berlin, {per_hour:,}/h", path)
    rush_hour = bologna(folder / "bologna", particles)
    if rush_hour is not None:
        yield Case("Bologna, rush hour", rush_hour)


@dataclass(frozen=True)
class Judged:
    """When a plan finds truths, realisation by realisation, and what it promised."""

    promised_s: float
    found_s: Floats  # (realisations,) mean of min(tau, horizon)
    cheating_s: Floats  # (realisations,), of one that the particles have ridden in


def judged(case: Case, truths: int, workers: int) -> dict[str, Judged]:
    """Return how the plan of each belief does."""
    opened = open_scenario(case.path, overrides=BELIEFS["one realisation"])
    unseen = _truths(opened, Realisations(UNSEEN, JUDGES), JUDGES * truths, "unseen", workers)
    seen = _truths(opened, Realisations(0, 1), JUDGES * truths // 2, "seen", workers)
    found = {}
    for name, overrides in BELIEFS.items():
        believed = open_scenario(case.path, overrides=overrides)
        recorder = Recorder(believed, workers)
        futures = recorder.planning().futures
        plan = make_plan(method_named(METHOD), believed, recorder, futures).plan
        promised_s = float(_when(believed, plan, futures) @ futures.weight)
        by_run, cheating = (_by_run(believed, plan, some) for some in (unseen, seen))
        found[name] = Judged(promised_s, by_run, cheating)
    return found


def _truths(
    opened: OpenScenario, there: Realisations, count: int, name: str, workers: int
) -> Futures:
    search, prior = opened.scenario.search, in_traffic(opened.truth_prior)
    recipe = Drawn(prior, count, search.horizon_s, search.seed, ("worth", name), realisations=there)
    assert opened.traffic is not None
    said = {"worth": name, "traffic": opened.traffic.digest}
    how = How(workers=workers, traffic=opened.traffic)
    return recorded(opened.network, recipe, scenario=said, how=how).futures


def _when(opened: OpenScenario, plan: Plan, futures: Futures) -> Floats:
    """Return when a plan finds each target, (N,) seconds, the horizon if never."""
    problem = problem_of(opened, futures)
    seen_at = evaluate(plan.tracks, futures, problem.sensor, problem.objective).seen_at
    return np.minimum(seen_at, problem.objective.horizon_s)


def _by_run(opened: OpenScenario, plan: Plan, truths: Futures) -> Floats:
    assert truths.fates is not None
    return means_of_runs(_when(opened, plan, truths), truths.fates.realisation)


def rows(case: Case, found: dict[str, Judged]) -> Iterator[str]:
    """Yield the rows of a case."""
    best = found[f"mixture of {MIXED}"]
    for name, one in found.items():
        later = (one.found_s - best.found_s) / best.found_s.mean()
        low, high = student_interval(later.tolist())
        against = (
            ""
            if one is best
            else f"{percent(later.mean(), sign=True)} ± {percent((high - low) / 2)}"
        )
        cheats = one.cheating_s.mean() / found["one realisation"].cheating_s.mean() - 1
        cheated = "" if name == "one realisation" else percent(cheats, sign=True)
        yield (
            f"| {case.name} | {name} | {one.promised_s:.0f} s | {one.found_s.mean():.0f} s "
            f"| {against} | {one.cheating_s.mean():.0f} s | {cheated} |"
        )


def main(argv: Sequence[str] | None = None) -> int:
    """Plan, fly, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--particles", type=int, default=200, help="that a plan is made on")
    parser.add_argument("--truths", type=int, default=10, help="in each unseen realisation")
    parser.add_argument("--only", metavar="TEXT", default="", help="cases whose name holds it")
    parser.add_argument("-j", "--jobs", type=int, default=2)
    wanted = parser.parse_args(argv)
    print("| | plan made on | promises | finds, unseen | later than mixture |", end="")
    print(" same realisation (cheating) | later than its own |")
    print("|---|---|--:|--:|--:|--:|--:|", flush=True)
    with TemporaryDirectory() as folder:
        for case in cases(Path(folder), wanted.particles):
            if wanted.only.lower() in case.name.lower():
                found = judged(case, wanted.truths, wanted.jobs)
                print("\n".join(rows(case, found)), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
