"""The work of `planner compare --instances`: all methods on the frozen instances, one table."""

import argparse
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from planner.cli.comparison import compared_methods
from planner.cli.printing import print_result
from planner.cli.progress import progress_bar
from planner.detection.evaluation import Evaluation
from planner.errors import InputError
from planner.experiments.condition import Condition
from planner.experiments.instances import Instance, flown_again, instances_path, read_instances
from planner.experiments.run import run
from planner.files import written_whole
from planner.locks import temporary_folder
from planner.mission.recorder import Recorder
from planner.report import experiment_tables

PAGE = "instances.md"


def compare_on_instances(arguments: argparse.Namespace) -> int:
    """Plan for every instance with every method and print the table.

    Raises
    ------
    InputError
        If a scenario is named as well, or the results would have to go into a file.
    """
    if arguments.scenario is not None:
        raise InputError(f"--instances: brings its own scenarios; leave {arguments.scenario} out")
    instances = read_instances(instances_path())
    methods = compared_methods(arguments)
    conditions = {(one.name, m.name): one.condition(m) for one in instances for m in methods}
    with ExitStack() as stack:
        folder = arguments.output or Path(stack.enter_context(temporary_folder()))
        known = _known(instances, arguments.jobs)
        with progress_bar("instances") as progress:
            parts = {folder: [*conditions.values()]}
            results = run(parts, workers=arguments.jobs, progress=progress)[folder]
    values = _values(conditions, results.rows)
    blocks: list[Any] = [experiment_tables.instances_table(instances, known, values)]
    blocks += _moved(instances, known)
    if arguments.output:
        with written_whole(arguments.output / PAGE) as new:
            page = experiment_tables.instances_page(instances, known, values)
            new.write_text(page, encoding="utf-8")
        blocks.append(f"written to {arguments.output}")
    summary = {"instances": [_summary(one, known[one.name], values) for one in instances]}
    print_result(arguments, summary, blocks)
    return 0


def _known(instances: Sequence[Instance], jobs: int | None) -> dict[str, Evaluation]:
    """Return the values of the best known plans, flown again."""
    known = {}
    with progress_bar("flying the best known plans") as progress:
        for done, instance in enumerate(instances):
            progress(done, len(instances))
            opened = instance.opened()
            fresh = Recorder(opened, jobs).evaluation(instance.targets).futures
            known[instance.name] = flown_again(instance, opened, fresh)
    return known


def _values(
    conditions: Mapping[tuple[str, str], Condition], rows: Sequence[Mapping[str, Any]]
) -> dict[tuple[str, str], float | None]:
    found = {row["id"]: row["expected_detection_time_s"] for row in rows}
    return {pair: found[condition.id] for pair, condition in conditions.items()}


def _summary(
    instance: Instance, known: Evaluation, values: Mapping[tuple[str, str], float | None]
) -> dict[str, Any]:
    low_s, high_s = known.ci95_s
    return {
        "instance": instance.name,
        "best_known_s": known.expected_detection_time_s,
        "ci95_s": [low_s, high_s],
        "found_by": instance.method,
        "bound": None if instance.bound is None else vars(instance.bound),
        "methods": {m: value for (name, m), value in values.items() if name == instance.name},
    }


def _moved(instances: Sequence[Instance], known: Mapping[str, Evaluation]) -> list[str]:
    """Return a line for each best known plan whose value here differs from the recorded one."""
    return [
        f"{one.name}: the best known plan takes {value:,.1f} s here, but {one.value_s:,.1f} s were "
        "written down"
        for one in instances
        for value in [known[one.name].expected_detection_time_s]
        if abs(value - one.value_s) > 0.1
    ]
