"""Asks what is lost if the drone starts from farther away.

    python tools/example_compare_starts.py [SCENARIO] [KM ...]

The particles and the fresh targets are the same for every start: only the flight differs.
"""

import sys
from dataclasses import replace

import planner


def main(scenario: str = "grid5x5", *kilometres: str) -> None:
    """Plan from each distance to the north-west of the net's first node."""
    opened = planner.open_scenario(scenario)
    recorder = planner.Recorder(opened)
    problem = planner.problem_of(opened, recorder.planning().futures)
    targets = recorder.truths(1000, seed=1).futures
    budget = planner.Budget(roads=opened.scenario.search.depth)
    x_m, y_m = problem.network.node_xy_m[0].tolist()
    print("start, km   expected detection, s   found")
    for start_km in map(float, kilometres or ("0", "60", "120", "180")):
        aside_m = start_km * 1000 / 2**0.5
        uav = replace(problem.uav, x_m=x_m - aside_m, y_m=y_m + aside_m)
        case = problem.replace(uav=uav)
        plan = planner.greedy(case, budget=budget, rng=planner.stream(1, "example")).plan
        flown = planner.fly(plan, targets, case.sensor, case.objective).evaluation
        mean_s, found = flown.expected_detection_time_s, flown.detection_probability
        print(f"{start_km:9.0f}   {mean_s:21,.0f}   {found:5.1%}")


if __name__ == "__main__":
    main(*sys.argv[1:])
