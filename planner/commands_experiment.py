"""What `planner experiment` does: read the file, run what is not finished, print the table."""

import argparse
import json
from collections.abc import Sequence
from typing import Any

from planner.cli import print_json
from planner.errors import InputError, OutputError
from planner.experiments.condition import Condition
from planner.experiments.experiment import Experiment
from planner.experiments.experiment_file import read_experiment
from planner.experiments.kept import Kept
from planner.experiments.run import run
from planner.report import experiment_tables, tables
from planner.report.progress import progress
from planner.report.run_files import write_json

MARK = "experiment.json"  # tells whose results a folder holds


def experiment(arguments: argparse.Namespace) -> int:
    """Run an experiment, or list its conditions."""
    chosen = read_experiment(arguments.experiment)
    chosen = (chosen.quick() if arguments.quick else chosen).only(arguments.only)
    conditions = chosen.conditions()
    if arguments.dry_run:
        return _listed(arguments, conditions)
    if arguments.output is None:
        raise InputError("-o: is missing; name the folder of the results, or give --dry-run")
    _claim(arguments, chosen)
    with progress(chosen.path.stem) as told:
        results = run(conditions, arguments.output, workers=arguments.jobs, told=told)
    failed = experiment_tables.failures(results.rows)
    told_last = (
        f"{results.run} conditions run, {len(conditions) - results.run} were finished before"
    )
    out = {
        "results": str(arguments.output),
        "conditions": len(conditions),
        "run": results.run,
        "failed": sum(row["reason"] is not None for row in results.rows),
    }
    table = _table(results.rows, conditions[0], chosen.title)
    _tell(arguments, out, [table, *failed, told_last, f"written to {arguments.output}"])
    return 0


def _table(rows: Sequence[Any], first: Condition, title: str) -> Any:
    if first.study:
        return experiment_tables.study_table(rows, title)
    sets = ["targets"] if first.sets else []
    return experiment_tables.results_table(rows, [*first.levels, *sets], title)


def _listed(arguments: argparse.Namespace, conditions: Sequence[Condition]) -> int:
    kept = arguments.output and Kept(arguments.output)
    finished = [bool(kept) and kept.figures(condition) is not None for condition in conditions]
    listed = [
        {"id": condition.id, **condition.as_dict(), "finished": done}
        for condition, done in zip(conditions, finished, strict=True)
    ]
    table = experiment_tables.conditions_table(conditions, finished)
    _tell(arguments, {"conditions": listed}, [table])
    return 0


def _claim(arguments: argparse.Namespace, chosen: Experiment) -> None:
    """Refuse a folder that holds the results of another experiment; mark it as this one's.

    Raises
    ------
    OutputError
        If it is another one's, or cannot be written.
    """
    mine = {"experiment": chosen.path.stem, "title": chosen.title}
    path = arguments.output / MARK
    if not path.exists():
        write_json(path, mine)
        return
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        found = None
    if found != mine:
        raise OutputError(f"{arguments.output}: holds another experiment; choose another folder")


def _tell(arguments: argparse.Namespace, told: dict[str, Any], shown: Sequence[Any]) -> None:
    if arguments.json:
        print_json(told)
        return
    out = tables.console()
    for thing in shown:
        out.print(thing)
