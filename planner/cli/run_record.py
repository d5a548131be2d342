"""What a run's ``run.json`` holds: whence it comes, how long it took, and how much went into it."""

import argparse
import sys
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from planner.futures.futures import Futures
from planner.futures.store import Recording
from planner.mission import run_folder
from planner.mission.opening import OpenScenario
from planner.mission.trial import Trial
from planner.provenance import provenance
from planner.scenario.source import paths_in_record


class Watch:
    """Wall-clock time of the parts of a run."""

    def __init__(self) -> None:
        self.started = datetime.now(UTC)
        self.took_s: dict[str, float] = {}
        self._last_s = time.perf_counter()

    def lap(self, part: str) -> None:
        """Take note of how long a part took that ends now."""
        now_s = time.perf_counter()
        self.took_s[part] = now_s - self._last_s
        self._last_s = now_s


def record_of(
    arguments: argparse.Namespace,
    opened: OpenScenario,
    content: Mapping[str, Any],
    planning: Recording,
    watch: Watch,
) -> dict[str, Any]:
    """Return whence a run comes.

    Parameters
    ----------
    content
        Of its ``plan.json``.
    planning
        What it was planned on.
    """
    scenario = opened.scenario
    made_by = provenance(
        [Path(sys.argv[0]).name, *sys.argv[1:]],
        scenario.as_dict(),
        seed=scenario.search.seed,
        sha256=run_folder.hashes(opened, content, planning),
        started=watch.started,
        took_s=watch.took_s,
    )
    made_by |= opened.network.credit
    return made_by | paths_in_record("scenario_path", scenario.path, arguments.output)


def planning_record(trial: Trial) -> dict[str, Any]:
    """Return what a search did."""
    made = trial.result
    return {
        "work": trial.work_allowed,
        "work_done": made.work,
        "stopped_early": made.stopped,
        "trace": [list(point) for point in made.trace],  # work done, best value then
    }


def targets_record(planning: Recording, holdout: Futures | None, trial: Trial) -> dict[str, int]:
    """Return how many targets there were, by what for."""
    return {
        "planning": len(planning.futures),
        "holdout": 0 if holdout is None else len(holdout),
        "evaluation": len(trial.evaluated.weight),
    }
