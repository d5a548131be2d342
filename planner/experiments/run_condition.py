"""Runs one condition: opens, records, plans and evaluates; the outcome is plain data."""

import logging
import platform
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from planner.errors import NotApplicableError, OutputError, PlannerError, ScenarioError, SumoError
from planner.experiments.condition import Condition
from planner.experiments.target_sets import figures_on
from planner.mission.planning import holdout_for, problem_of
from planner.mission.recorder import Recorder
from planner.mission.trial import Trial, try_method
from planner.provenance import versions

log = logging.getLogger(__name__)

Study = Callable[[Condition], dict[str, Any]]
Studies = Mapping[str, Study]

NO_STUDIES: Studies = {}
RUN_WITH = ("planner", "sumo", "numpy", "numba")  # with each condition; the table's file names all


@dataclass(frozen=True)
class Outcome:
    """The outcome of a condition."""

    figures: dict[str, Any]  # the same on every run
    timing: dict[str, Any]  # wall-clock times and the like, which are not
    final: bool = True  # False: it failed for a reason that may be gone the next time


def run_condition(condition: Condition, studies: Studies = NO_STUDIES) -> Outcome:
    """Return the outcome of a condition; a failure is an outcome too.

    Parameters
    ----------
    studies
        By name, what a condition may run in place of a method.

    Raises
    ------
    OutputError
        If the cache cannot be written: nothing could be run then.
    """
    begun_s = time.perf_counter()
    figures: dict[str, Any] = {}
    took_s, final = None, True
    try:
        if condition.study:
            figures = studies[condition.study](condition)
        else:
            figures, took_s = _tried(condition)
    except OutputError:
        raise
    except PlannerError as error:
        figures, final = {"reason": reason_of(error)}, not isinstance(error, SumoError)
    except Exception as error:
        log.warning("condition %s:\n%s", condition.id, traceback.format_exc())
        figures, final = {"reason": f"{type(error).__name__}: {error}"}, False
    timing = {
        "planning_s": took_s,
        "whole_s": time.perf_counter() - begun_s,
        "host": platform.node(),
        "retries": 0,
    }
    return Outcome(figures | {"versions": _versions()}, timing, final)


def _versions() -> str:
    known = versions()
    return ", ".join(f"{name} {known[name]}" for name in RUN_WITH)


def _tried(condition: Condition) -> tuple[dict[str, Any], float]:
    method = condition.planned_by
    opened = condition.opened()
    recorder = Recorder(opened, 1)
    holdout = holdout_for(method, recorder)
    futures = recorder.planning().futures
    fresh = recorder.evaluation(condition.targets).futures if condition.targets else futures
    trial = try_method(method, recorder, futures, fresh, holdout=holdout)
    figures = {
        **(_fresh(trial) if condition.targets else {}),
        "planned_s": trial.planned.expected_detection_time_s,
        "roads": trial.roads,
        "work": trial.result.work,
    }
    if condition.sets:
        problem = problem_of(opened, futures, method=method)
        figures["sets"] = figures_on(condition, problem, trial.plan)
    return figures, trial.took_s


def _fresh(trial: Trial) -> dict[str, Any]:
    low_s, high_s = trial.evaluated.ci95_s
    by_s = trial.evaluated.objective.by_s
    found_by = None if by_s is None else trial.evaluated.found_by_probability(by_s)
    return {
        "expected_detection_time_s": trial.evaluated.expected_detection_time_s,
        "ci95_low_s": low_s,
        "ci95_high_s": high_s,
        "detection_probability": trial.evaluated.detection_probability,
        "found_before_goal_probability": trial.evaluated.found_before_goal_probability,
        "found_by_probability": found_by,
    }


def reason_of(error: PlannerError) -> str:
    """Return what is wrong in one line that names no path of this machine."""
    if isinstance(error, ScenarioError):
        return "; ".join(map(str, error.faults))
    if isinstance(error, NotApplicableError):
        return f"not applicable: {error}"
    return " ".join(str(error).split())
