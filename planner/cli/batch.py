"""The work of `planner experiment`: run what is not finished yet and print the table."""

import argparse
import logging
import os
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from planner.cli.arguments import permit_of
from planner.cli.backends import cluster_of
from planner.cli.printing import print_result
from planner.cli.progress import progress_bar
from planner.cli.session import LONG_S
from planner.errors import InputError, OutputError
from planner.experiments.condition import Condition, horizons_s
from planner.experiments.dask_backend import by_dask
from planner.experiments.duration import duration_of, known_times
from planner.experiments.experiment import Experiment
from planner.experiments.experiment_file import read_experiment
from planner.experiments.processes import in_processes
from planner.experiments.result_store import ResultStore
from planner.experiments.run import Backend, Results, run
from planner.experiments.run_condition import run_condition
from planner.files import write_json
from planner.futures.workers import cores
from planner.guard import read_json
from planner.interrupts import undone_if_stopped
from planner.messages import counted
from planner.paper.studies import STUDIES
from planner.report import experiment_tables

log = logging.getLogger(__name__)

MARK = "experiment.json"  # says whose results a folder holds
RESUME = "\nplanner: what is finished is kept; the same command goes on from there\n"


def run_experiment(arguments: argparse.Namespace) -> int:
    """Run an experiment, or list its conditions."""
    chosen = chosen_experiment(arguments, arguments.experiment)
    conditions = chosen.conditions()
    if arguments.dry_run:
        return list_conditions(arguments, {Path(): conditions})
    out = results_folder(arguments)
    results = run_experiments(arguments, {out: chosen}, {out: conditions}, chosen.path.stem)[out]
    summary = {
        "results": str(out),
        "conditions": len(conditions),
        "run": results.run,
        "failed": sum(row["reason"] is not None for row in results.rows),
    }
    blocks = [
        _table(results.rows, conditions, chosen.title),
        *experiment_tables.failures(results.rows),
        f"{results.run} conditions run, {len(conditions) - results.run} were finished before",
        f"written to {out}",
    ]
    print_result(arguments, summary, blocks)
    return int(summary["failed"] == len(results.rows))  # if all failed, the file is at fault


def chosen_experiment(arguments: argparse.Namespace, name: str) -> Experiment:
    """Return the experiment of a name or file, reduced by --quick and --only."""
    read = read_experiment(name, STUDIES).permitted(permit_of(arguments))
    chosen = read.also_by(arguments.method)
    return (chosen.quick() if arguments.quick else chosen).only(arguments.only)


def results_folder(arguments: argparse.Namespace) -> Path:
    """Return the folder of --output.

    Raises
    ------
    InputError
        If there is none.
    """
    if arguments.output is None:
        raise InputError("-o: is missing; name the folder of the results, or give --dry-run")
    out: Path = arguments.output
    return out


def run_experiments(
    arguments: argparse.Namespace,
    chosen: Mapping[Path, Experiment],
    conditions: Mapping[Path, Sequence[Condition]],
    title: str,
) -> dict[Path, Results]:
    """Run what is not finished of experiments, by the folder of their results."""
    workers, backend = arguments.jobs, _backend(arguments)
    for out, one in chosen.items():
        _claim(out, one, quick=arguments.quick)
    _announce(chosen, conditions, workers or cores())
    with progress_bar(title) as progress, undone_if_stopped(_say_how_to_resume):
        run_one = partial(run_condition, studies=STUDIES)
        return run(conditions, run_one=run_one, workers=workers, progress=progress, backend=backend)


def _announce(
    chosen: Mapping[Path, Experiment], conditions: Mapping[Path, Sequence[Condition]], workers: int
) -> None:
    """Say how long what is not finished will take, if that is long."""
    waiting: dict[tuple[str, Path], Condition] = {}
    times: list[tuple[Condition, dict[str, Any]]] = []
    for out, some in conditions.items():
        store = ResultStore(out)
        for one in some:
            if store.figures(one) is None:
                waiting[one.id, one.place] = one
            else:
                times.append((one, store.timing(one)))
    duration = duration_of([*waiting.values()], known_times(times))
    if duration.time_s / workers > LONG_S:
        log.warning(
            "%s: %s, %s: %s",
            " and ".join(dict.fromkeys(one.path.stem for one in chosen.values())),
            counted(len(waiting), "condition"),
            counted(duration.runs, "SUMO run"),
            duration.sentence(workers),
        )


def list_conditions(
    arguments: argparse.Namespace, experiments: Mapping[Path, Sequence[Condition]]
) -> int:
    """Print conditions and how long they will take; nothing is run.

    Parameters
    ----------
    experiments
        Conditions by the folder of their results, below --output.
    """
    listed, waiting, blocks = [], [], []
    times: list[tuple[Condition, dict[str, Any]]] = []
    for folder, conditions in experiments.items():
        store = ResultStore(arguments.output / folder) if arguments.output else None
        finished = [store is not None and store.figures(c) is not None for c in conditions]
        blocks.append(experiment_tables.conditions_table(conditions, finished))
        for one, done in zip(conditions, finished, strict=True):
            listed.append({"id": one.id, **one.as_dict(), "finished": done})
            if store and done:
                times.append((one, store.timing(one)))
            else:
                waiting.append(one)
    duration = duration_of(waiting, known_times(times))
    summary = {"conditions": listed, "duration": duration.as_dict()}
    print_result(arguments, summary, [*blocks, duration.sentence(arguments.jobs or cores())])
    return 0


def _say_how_to_resume() -> None:
    # Not by way of sys.stderr, in the midst of which the main thread may hold still.
    os.write(2, RESUME.encode())


def _backend(arguments: argparse.Namespace) -> Backend:
    cluster = cluster_of(arguments)
    return in_processes if cluster is None else partial(by_dask, cluster=cluster)


def _table(rows: Sequence[Any], conditions: Sequence[Condition], title: str) -> Any:
    first = conditions[0]
    if first.study:
        return experiment_tables.study_table(rows, title)
    factors = [*first.levels, *(["targets"] if first.sets else [])]
    return experiment_tables.results_table(rows, factors, title, horizons_s(conditions))


def _claim(out: Path, chosen: Experiment, *, quick: bool) -> None:
    """Mark a folder as the place of an experiment's results; a quick one is another experiment.

    Raises
    ------
    OutputError
        If it holds those of another experiment, or cannot be written.
    """
    mine = {"experiment": chosen.path.stem, "title": chosen.title} | (
        {"quick": True} if quick else {}
    )
    path = out / MARK
    if not path.exists():
        write_json(path, mine)
        return
    try:
        found = read_json(path)
    except InputError:
        found = None
    if found != mine:
        raise OutputError(f"{out}: holds another experiment; choose another folder")
