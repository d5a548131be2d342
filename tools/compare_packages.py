"""Compare planners of other packages with those of this program, on the paper's grid.

    pip install 'sumo-search-planner[orienteering]' pomdp-py
    python tools/compare_packages.py            # a table in Markdown; a few minutes

All plan on the same particles and are judged on the same fresh targets. CPU seconds are those of
planning, after everything has been compiled.
"""

import argparse
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from planner import NotApplicableError, Recorder, make_plan, method_named, open_scenario, problem_of
from planner.detection.evaluate import evaluate
from planner.errors import InputError

POUCT = f"{Path(__file__).parent / 'peers' / 'pouct.py'}:pouct"
METHODS = {
    "best": "best",
    "beam": "beam",
    "OR-Tools, orienteering": "orienteering",
    "pomdp-py, POUCT": POUCT,
}
DISTANCES_KM = (60, 120)
PARTICLES, TARGETS = 512, 4000


def rows(distances_km: Sequence[int], names: Sequence[str]) -> Iterator[str]:
    """Yield the table's rows, one for each distance and planner."""
    for distance_km in distances_km:
        settings = [f"uav.start.distance_m={1000 * distance_km}", f"search.particles={PARTICLES}"]
        opened = open_scenario("grid5x5", overrides=settings)
        recorder = Recorder(opened)
        futures, fresh = recorder.planning().futures, recorder.evaluation(TARGETS).futures
        holdout = recorder.holdout().futures
        problem = problem_of(opened, futures)
        make_plan(method_named("best"), opened, recorder, futures, holdout=holdout)  # compiles
        for name in names:
            try:
                method = method_named(METHODS[name])
                begun_s = time.process_time()
                made = make_plan(method, opened, recorder, futures, holdout=holdout)
                took_s = time.process_time() - begun_s
            except (NotApplicableError, InputError) as error:
                yield f"| {distance_km} km | {name} | - | - | {error} |"
                continue
            found = evaluate(made.plan.tracks, fresh, problem.sensor, problem.objective)
            low_s, high_s = found.ci95_s
            yield (
                f"| {distance_km} km | {name} | {found.expected_detection_time_s:,.0f} s "
                f"| {low_s:,.0f} .. {high_s:,.0f} s | {took_s:.1f} s |"
            )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", choices=METHODS, action="append", help="this planner alone")
    parser.add_argument("--km", type=int, action="append", help="this distance alone (60, 120)")
    wanted = parser.parse_args()
    print("| start | planner | expected detection | 95 % | CPU |")
    print("|---|---|--:|--:|--:|")
    for row in rows(wanted.km or DISTANCES_KM, wanted.only or [*METHODS]):
        print(row, flush=True)


if __name__ == "__main__":
    main()
