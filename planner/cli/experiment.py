"""What `planner experiment` does: read the file, run what is not finished, print the table."""

import argparse
import json
import os
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from planner.cli.session import tell
from planner.errors import InputError, OutputError
from planner.experiments.condition import Condition
from planner.experiments.duration import duration_of, known_times
from planner.experiments.experiment import Experiment
from planner.experiments.experiment_file import read_experiment
from planner.experiments.processes import in_processes
from planner.experiments.result_store import ResultStore
from planner.experiments.run import Backend, Results, run
from planner.experiments.run_condition import run_condition
from planner.files import write_json
from planner.futures.workers import cores
from planner.interrupts import undone_if_stopped
from planner.paper.experiments import EXPERIMENTS
from planner.paper.studies import STUDIES
from planner.report import experiment_tables
from planner.report.progress import progress

MARK = "experiment.json"  # tells whose results a folder holds


GO_ON = "\nplanner: what is finished is kept; the same command goes on from there\n"
PAPER = "paper"  # the name that stands for all of these


def experiment(arguments: argparse.Namespace) -> int:
    """Run an experiment, or list its conditions."""
    if arguments.experiment == PAPER:
        return _paper(arguments)
    chosen = _chosen(arguments, arguments.experiment)
    conditions = chosen.conditions()
    if arguments.dry_run:
        return _listed(arguments, {Path(): conditions})
    out = _output(arguments)
    results = _run(arguments, {out: chosen}, {out: conditions}, chosen.path.stem)[out]
    failed = experiment_tables.failures(results.rows)
    told = {
        "results": str(out),
        "conditions": len(conditions),
        "run": results.run,
        "failed": sum(row["reason"] is not None for row in results.rows),
    }
    table = _table(results.rows, conditions[0], chosen.title)
    tell(arguments, told, [table, *failed, _told_last(results, conditions), f"written to {out}"])
    return int(told["failed"] == len(results.rows))  # where all failed, the file is at fault


def _paper(arguments: argparse.Namespace) -> int:
    """Run all experiments of the paper and write one report."""
    from planner.paper.claims import verdicts_table
    from planner.paper.report import claims_of, write_report

    chosen = {name: _chosen(arguments, name) for name in EXPERIMENTS}
    conditions = {name: one.conditions() for name, one in chosen.items()}
    if arguments.dry_run:
        stems = {Path(one.path.stem): conditions[name] for name, one in chosen.items()}
        return _listed(arguments, stems)
    out = _output(arguments)
    parts = {out / one.path.stem: one for one in chosen.values()}
    waiting = dict(zip(parts, conditions.values(), strict=True))
    found = {part.name: rs for part, rs in _run(arguments, parts, waiting, PAPER).items()}
    claims = claims_of(found)
    page = write_report(out, found, claims, quick=arguments.quick)
    failed = [line for one in found.values() for line in experiment_tables.failures(one.rows)]
    told = {
        "report": str(page),
        "conditions": sum(map(len, conditions.values())),
        "run": sum(results.run for results in found.values()),
        "failed": sum(row["reason"] is not None for r in found.values() for row in r.rows),
        "claims": {claim.text: claim.verdict for claim in claims},
    }
    tell(arguments, told, [verdicts_table(claims), *failed, f"written to {page}"])
    return 0


def _chosen(arguments: argparse.Namespace, name: str) -> Experiment:
    chosen = read_experiment(name, STUDIES)
    return (chosen.quick() if arguments.quick else chosen).only(arguments.only)


def _output(arguments: argparse.Namespace) -> Path:
    if arguments.output is None:
        raise InputError("-o: is missing; name the folder of the results, or give --dry-run")
    out: Path = arguments.output
    return out


def _run(
    arguments: argparse.Namespace,
    chosen: Mapping[Path, Experiment],
    conditions: Mapping[Path, Sequence[Condition]],
    title: str,
) -> dict[Path, Results]:
    for out, one in chosen.items():
        _claim(out, one, quick=arguments.quick)
    workers, backend = arguments.jobs, _backend(arguments)
    with progress(title) as told, undone_if_stopped(_tell_how_to_go_on):
        run_one = partial(run_condition, studies=STUDIES)
        return run(conditions, run_one=run_one, workers=workers, told=told, backend=backend)


def _tell_how_to_go_on() -> None:
    # Not by way of sys.stderr, in the midst of which the main thread may hold still.
    os.write(2, GO_ON.encode())


def _backend(arguments: argparse.Namespace) -> Backend:
    if arguments.backend == "processes":
        if arguments.address is not None:
            raise InputError(f"--address {arguments.address}: goes with --backend dask")
        return in_processes
    from planner.experiments.dask_backend import by_dask

    return partial(by_dask, address=arguments.address)


def _told_last(results: Results, conditions: Sequence[Condition]) -> str:
    return f"{results.run} conditions run, {len(conditions) - results.run} were finished before"


def _table(rows: Sequence[Any], first: Condition, title: str) -> Any:
    if first.study:
        return experiment_tables.study_table(rows, title)
    sets = ["targets"] if first.sets else []
    return experiment_tables.results_table(rows, [*first.levels, *sets], title)


def _listed(arguments: argparse.Namespace, experiments: Mapping[Path, Sequence[Condition]]) -> int:
    """List conditions, by the folder in -o of what comes of them, and tell how long they take."""
    listed, waiting, tables_of = [], [], []
    times: list[tuple[Condition, dict[str, Any]]] = []
    for folder, conditions in experiments.items():
        kept = ResultStore(arguments.output / folder) if arguments.output else None
        finished = [kept is not None and kept.figures(c) is not None for c in conditions]
        tables_of.append(experiment_tables.conditions_table(conditions, finished))
        for one, done in zip(conditions, finished, strict=True):
            listed.append({"id": one.id, **one.as_dict(), "finished": done})
            if kept and done:
                times.append((one, kept.timing(one)))
            else:
                waiting.append(one)
    workers = arguments.jobs or cores()
    takes = duration_of(waiting, known_times(times))
    told = {"conditions": listed, "duration": takes.as_dict()}
    tell(arguments, told, [*tables_of, takes.told(workers)])
    return 0


def _claim(out: Path, chosen: Experiment, *, quick: bool) -> None:
    """Refuse a folder that holds the results of another experiment; mark it as this one's.

    A quick one is another one.

    Raises
    ------
    OutputError
        If it is another one's, or cannot be written.
    """
    mine = {"experiment": chosen.path.stem, "title": chosen.title} | (
        {"quick": True} if quick else {}
    )
    path = out / MARK
    if not path.exists():
        write_json(path, mine)
        return
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        found = None
    if found != mine:
        raise OutputError(f"{out}: holds another experiment; choose another folder")
