"""How near plans are to their bound on the grid, beside what is aimed at: value and bound by time.

Seconds are those of one core at work, so that a busy machine measures the same.

python tools/benchmark_certificate.py [--u0-km 120] [--seconds 60]
"""

import argparse
import sys
import time

import numpy as np

import planner
from planner.detection.first_detection import first_detection
from planner.search.best import best
from planner.search.certificate import Effort, certified
from planner.streams import stream

AIMS = {0: 0.30, 60: 0.10, 120: 0.10, 180: 0.10, 300: 0.08, 500: 0.015, 700: 0.003}  # gaps
CURVE_S = (5.0, 10.0, 20.0, 40.0, 80.0, 160.0, 320.0)


def measured(u0_km: int, seconds: float) -> tuple[float, float, float, list[str]]:
    """Return value, bound and gap of `best` after so many seconds, and the curve as texts."""
    overrides = [f"uav.start.distance_m={1000 * u0_km}", "search.particles=1000"]
    opened = planner.open_scenario("grid5x5", overrides=overrides)
    problem = planner.problem_of(opened, planner.Recorder(opened).planning().futures)
    begun_s = time.process_time()
    curve: list[str] = []
    budget = planner.Budget(
        work=opened.scenario.search.work, stop=lambda: time.process_time() > begun_s + seconds / 4
    )
    plan = best(problem, budget=budget, rng=stream(1, "planner", "best"))

    def told(_: int, value: float, bound: float, gap: float) -> None:
        passed_s = time.process_time() - begun_s
        if len(curve) < len(CURVE_S) and passed_s >= CURVE_S[len(curve)]:
            curve.append(f"{passed_s:.0f} s: {value:.0f} >= {bound:.0f} ({gap:.1%})")

    effort = Effort(steps=10**6, stop=lambda: time.process_time() > begun_s + seconds, told=told)
    made = certified(problem, plan, effort)
    seen_at = first_detection(problem.futures, plan.tracks[0], problem.sensor.radius_m)
    assert np.isclose(made.value, problem.futures.weight @ np.minimum(seen_at, problem.horizon_s))
    return made.value, made.bound, made.gap, curve


def main() -> int:
    """Print value, bound and gap beside the aim for each distance; 1 if an aim is missed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--u0-km", type=int, action="append", choices=list(AIMS))
    parser.add_argument("--seconds", type=float, default=60.0)
    wanted = parser.parse_args()
    measured(700, 1.0)  # compiles
    missed = 0
    print(f"{'u0 km':>6} {'value s':>9} {'bound s':>9} {'gap':>8} {'aim':>8}")
    for u0_km in wanted.u0_km or AIMS:
        value, bound, gap, curve = measured(u0_km, wanted.seconds)
        aim = AIMS[u0_km]
        missed += gap > aim
        verdict = "reached" if gap <= aim else "missed"
        print(f"{u0_km:6} {value:9.1f} {bound:9.1f} {gap:8.2%} {aim:8.1%} {verdict}", flush=True)
        print("       " + "; ".join(curve), flush=True)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
