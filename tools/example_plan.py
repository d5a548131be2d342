"""Plans one search and writes the flight's waypoints as CSV.

python tools/example_plan.py [SCENARIO] [OUTPUT.csv]
"""

import csv
import sys
from pathlib import Path

import planner


def main(scenario: str = "grid5x5", output: str = "waypoints.csv") -> None:
    """Plan greedily, fly against 200 fresh targets, and write what an autopilot would want."""
    opened = planner.open_scenario(scenario)
    recorder = planner.Recorder(opened)
    problem = planner.problem_of(opened, recorder.planning().futures)
    budget = planner.Budget(roads=opened.scenario.search.depth)
    plan = planner.greedy(problem, budget=budget, rng=planner.stream(1, "example")).plan

    targets = recorder.truths(200, seed=1).futures
    flown = planner.fly(plan, targets, problem.sensor, problem.objective).evaluation
    low_s, high_s = flown.ci95_s
    print(f"expected detection time {flown.expected_detection_time_s:,.0f} s", end=" ")
    print(f"({low_s:,.0f} to {high_s:,.0f}); found {flown.detection_probability:.0%}")

    (track,) = plan.tracks  # one UAV
    with Path(output).open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["time_s", "x_m", "y_m", "altitude_m"])
        for time_s, x_m, y_m in zip(track.time_s, track.x_m, track.y_m, strict=True):
            rows.writerow([f"{time_s:.2f}", f"{x_m:.2f}", f"{y_m:.2f}", problem.uav.altitude_m])
    print(f"{len(track.time_s)} waypoints in {output}")


if __name__ == "__main__":
    main(*sys.argv[1:])
