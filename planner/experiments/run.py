"""Runs what is not finished of experiments, in processes, and writes their tables."""

import contextlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

from planner.errors import InputError, PlannerError
from planner.experiments.condition import Condition, credit_of
from planner.experiments.processes import Done, RunCondition, in_processes
from planner.experiments.result_store import ResultStore
from planner.experiments.results import Row, rows_of, write_results, write_timings
from planner.experiments.run_condition import Outcome, run_condition
from planner.experiments.target_sets import targets_of
from planner.futures.workers import cores
from planner.mission.opening import OpenScenario
from planner.mission.planning import needs_holdout
from planner.mission.recorder import Recorder
from planner.progress import Progress

DRAWN_BY = ("particles", "sampling", "seed", "horizon_s")  # keys of [search]

Backend = Callable[[RunCondition, Sequence[Condition], int], Iterator[Done]]
Key = tuple[str, Path]  # a condition's id, and the scenario file that it is of


@dataclass(frozen=True)
class Results:
    """The table of an experiment, and how much of it was run for it this time."""

    rows: tuple[Row, ...]
    run: int
    figures: Mapping[str, Any]  # all that came of each condition, by its id


def run(
    experiments: Mapping[Path, Sequence[Condition]],
    *,
    workers: int | None = None,
    progress: Progress | None = None,
    run_one: RunCondition = run_condition,
    backend: Backend = in_processes,
) -> dict[Path, Results]:
    """Run what is not finished of experiments and write the table of each as it is done.

    The tables are the same, byte for byte, whatever the workers, the order and the interruptions.
    Experiments take turns, so that processes which begin together begin with different work, and
    share what is to be compiled; conditions that are equal, on the same file, are run once for all.

    Parameters
    ----------
    experiments
        Conditions by the folder of the results, and of what is kept of each as it is done.
    workers
        Processes; one per core if not given.
    progress
        Called with the conditions finished so far and their number.
    run_one
        What runs a condition; it can be pickled.
    backend
        What has it done in processes: here, or by Dask.

    Raises
    ------
    InputError
        If there is no condition.
    OutputError
        If a folder cannot be written; what is kept already is not lost.
    """
    if not all(experiments.values()):
        raise InputError("no condition is left; choose levels that exist together")
    workers = workers or cores()
    begun = {
        out: _RunningExperiment(ResultStore(out), conditions)
        for out, conditions in experiments.items()
    }
    waiting: dict[Key, Condition] = {}
    for turn in zip_longest(*(one.waiting.items() for one in begun.values())):
        waiting |= [item for item in turn if item]
    _record_shared([*waiting.values()], workers, progress)
    results = {out: one.written() for out, one in begun.items() if not one.waiting}
    for done, (condition, outcome) in enumerate(backend(run_one, [*waiting.values()], workers), 1):
        for out, one in begun.items():
            if one.takes(condition, outcome) and not one.waiting:
                results[out] = one.written()
        if progress:
            progress(done, len(waiting))
    return {out: results[out] for out in experiments}


def _key(condition: Condition) -> Key:
    """Return what one condition has in common with those that may take its outcome."""
    return condition.id, condition.place


class _RunningExperiment:
    """An experiment some of whose conditions may wait to be run."""

    def __init__(self, store: ResultStore, conditions: Sequence[Condition]) -> None:
        store.clean()
        self.store, self.conditions = store, conditions
        self.figures = {one.id: store.figures(one) for one in conditions}
        self.waiting = {_key(one): one for one in conditions if self.figures[one.id] is None}
        self.run = len(self.waiting)

    def takes(self, condition: Condition, outcome: Outcome) -> bool:
        """Keep what came of a condition, if it waited for it."""
        mine = self.waiting.pop(_key(condition), None)
        if mine is None:
            return False
        self.store.keep(mine, outcome)
        self.figures[mine.id] = outcome.figures
        return True

    def written(self) -> Results:
        """Write the table of all conditions."""
        rows = [row for one in self.conditions for row in rows_of(one, self.figures[one.id] or {})]
        metrics, credit = self.conditions[0].metrics, credit_of(self.conditions)
        write_results(self.store.folder, rows, metrics, credit)
        times = [self.store.timing(one) for one in self.conditions]
        write_timings(self.store.folder, [one.id for one in self.conditions], times)
        return Results(tuple(rows), self.run, self.figures)


def _record_shared(waiting: Sequence[Condition], workers: int, progress: Progress | None) -> None:
    """Record what conditions share before any of them is run; the cache keeps it.

    What cannot be recorded is left to the conditions themselves, which report why.
    """
    recorded: set[str] = set()
    for condition in waiting:
        with contextlib.suppress(PlannerError):
            if condition.study:
                continue
            opened, method = condition.opened(), condition.planned_by
            holdout = needs_holdout(method, opened)
            key = _shared(opened, condition, holdout=holdout)
            if key in recorded:
                continue
            recorded.add(key)
            if progress:
                progress(0, len(waiting), f"recording {len(recorded)}")
            _record(Recorder(opened, workers), condition, holdout=holdout)


def _record(recorder: Recorder, condition: Condition, *, holdout: bool) -> None:
    recorder.planning()
    if condition.targets:
        recorder.evaluation(condition.targets)
    if holdout:
        recorder.holdout()
    for one in condition.sets:
        targets_of(one, condition, workers=recorder.workers or 1)


def _shared(opened: OpenScenario, condition: Condition, *, holdout: bool) -> str:
    """Return what decides which targets are drawn, as text."""
    scenario = opened.scenario.as_dict()
    search = {key: scenario["search"].get(key) for key in DRAWN_BY}
    sets = [one.as_dict() for one in condition.sets]
    drawn = [scenario["target"], scenario["truth"], search, condition.targets, holdout, sets]
    return json.dumps([opened.network.sha256, *drawn], sort_keys=True)
