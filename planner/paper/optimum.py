"""How far plans are from the best possible: their values beside a lower bound.

The bound holds for all plans over roads on the same particles, whatever found them.
"""

from typing import Any

from planner.bounds.certificate import Effort, certified, gap_of
from planner.detection.evaluate import evaluate
from planner.experiments.condition import Condition
from planner.mission.planning import holdout_for, make_plan, problem_of
from planner.mission.recorder import Recorder
from planner.search.methods import method_named
from planner.search.stop import WorkDone

COMPARED = ("greedy", "lookahead", "best")  # the last one's plan is what the bound is sought for
STEP_WORK = 250  # units of search.work for one step of the search for better prices
BOUND = "no plan over roads is better than"


def optimum_of(condition: Condition) -> dict[str, Any]:
    """Return what methods reach on the particles planned with, and a bound on all plans there.

    All take off as late as a method that plans by simulation. A row for each: the expected
    detection time and by what share it is above the bound.
    """
    opened = condition.opened()
    recorder = Recorder(opened, 1)
    futures = recorder.planning().futures
    values = {}
    for name in COMPARED:
        method = method_named(name)
        holdout = holdout_for(method, recorder)
        problem = problem_of(opened, futures, method=method)
        plan = make_plan(method, opened, recorder, futures, holdout=holdout).plan
        flown = evaluate(plan.tracks, futures, problem.sensor, problem.objective)
        values[name] = flown.expected_detection_time_s
    steps = max(1, opened.scenario.search.work // STEP_WORK)
    bound_s = certified(problem, plan, Effort(stop=WorkDone(steps))).bound
    rows = [
        {"what": name, "expected_detection_time_s": value_s, "gap": gap_of(value_s, bound_s)}
        for name, value_s in values.items()
    ]
    rows.append({"what": BOUND, "expected_detection_time_s": bound_s, "gap": 0.0})
    return {"rows": [row | {"particles": len(futures)} for row in rows]}
