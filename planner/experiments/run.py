"""An experiment run: what is not finished yet, in processes, then the table of all."""

import contextlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner.belief.opening import Opened
from planner.errors import InputError, PlannerError
from planner.experiments.condition import Condition
from planner.experiments.conduct import conduct, opened_of
from planner.experiments.kept import Kept
from planner.experiments.met import targets_of
from planner.experiments.pool import Conduct, Done, conducted
from planner.experiments.results import Row, rows_of, write_results, write_timings
from planner.futures.workers import cores
from planner.mission.preparation import Recorder, needs_judges
from planner.search.methods import method_named

DRAWN_BY = ("particles", "sampling", "seed", "horizon_s")  # keys of [search]

Backend = Callable[[Conduct, Sequence[Condition], int], Iterator[Done]]
Told = Callable[[int, int, str], None]  # done, in all, what is being done


@dataclass(frozen=True)
class Results:
    """The table of an experiment, and how much of it was run for it this time."""

    rows: tuple[Row, ...]
    run: int
    figures: Mapping[str, Any]  # all that came of each condition, by its id


def run(
    conditions: Sequence[Condition],
    out: Path,
    *,
    workers: int | None = None,
    told: Told | None = None,
    conduct: Conduct = conduct,
    backend: Backend = conducted,
) -> Results:
    """Run what is not finished of an experiment and write the table of all of it.

    The table is the same, byte for byte, whatever the workers, the order and the interruptions.

    Parameters
    ----------
    out
        The folder of the results, and of what is kept of each condition as it is done.
    workers
        Processes; one per core if not given.
    told
        Hears how far the work has come.
    conduct
        What runs a condition; it can be pickled.
    backend
        What has it done in processes: here, or by Dask.

    Raises
    ------
    InputError
        If there is no condition.
    OutputError
        If the folder cannot be written; what is kept already is not lost.
    """
    if not conditions:
        raise InputError("no condition is left; choose levels that exist together")
    workers, kept = workers or cores(), Kept(out)
    kept.clean()
    figures = {condition.id: kept.figures(condition) for condition in conditions}
    waiting = [condition for condition in conditions if figures[condition.id] is None]
    _record_shared(waiting, workers, told)
    for done, (condition, outcome) in enumerate(backend(conduct, waiting, workers), 1):
        kept.keep(condition, outcome)
        figures[condition.id] = outcome.figures
        if told:
            told(done, len(waiting), "")
    rows = [row for c in conditions for row in rows_of(c, figures[c.id] or {})]
    write_results(out, rows, conditions[0].metrics)
    write_timings(out, [c.id for c in conditions], [kept.timing(c) for c in conditions])
    return Results(tuple(rows), len(waiting), figures)


def _record_shared(waiting: Sequence[Condition], workers: int, told: Told | None) -> None:
    """Record what conditions share before any of them is run; the cache keeps it.

    What cannot be recorded is left to the conditions themselves, which tell why.
    """
    recorded: set[str] = set()
    for condition in waiting:
        with contextlib.suppress(PlannerError):
            if condition.study:
                continue
            opened, method = opened_of(condition), method_named(condition.method)
            judged = needs_judges(method, opened)
            key = _shared(opened, condition, judged=judged)
            if key in recorded:
                continue
            recorded.add(key)
            if told:
                told(0, len(waiting), f"recording {len(recorded)}")
            _record(Recorder(opened, workers), condition, judged=judged)


def _record(recorder: Recorder, condition: Condition, *, judged: bool) -> None:
    recorder.planning()
    if condition.targets:
        recorder.evaluation(condition.targets)
    if judged:
        recorder.judging()
    for one in condition.sets:
        targets_of(one, condition, workers=recorder.workers or 1)


def _shared(opened: Opened, condition: Condition, *, judged: bool) -> str:
    """Return what decides which targets are drawn, as text."""
    scenario = opened.scenario.as_dict()
    search = {key: scenario["search"].get(key) for key in DRAWN_BY}
    sets = [one.as_dict() for one in condition.sets]
    drawn = [scenario["target"], scenario["truth"], search, condition.targets, judged, sets]
    return json.dumps([opened.network.sha256, *drawn], sort_keys=True)
