"""What `planner compare --instances` does: all methods on the frozen instances, one table."""

import argparse
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from planner.cli.session import tell
from planner.detection.evaluation import Evaluation
from planner.errors import InputError
from planner.experiments.condition import Condition
from planner.experiments.instances import Instance, flown_again, instances_path, read_instances
from planner.experiments.run import run
from planner.files import written_whole
from planner.mission.recorder import Recorder
from planner.report import experiment_tables
from planner.report.progress import progress
from planner.search.methods import METHODS

PAGE = "instances.md"


def compare_instances(arguments: argparse.Namespace) -> int:
    """Plan for every instance with every method and print the table.

    Raises
    ------
    InputError
        If a scenario is named as well, or the results would have to go into a file.
    """
    if arguments.scenario is not None:
        raise InputError(f"--instances: brings its own scenarios; leave {arguments.scenario} out")
    instances = read_instances(instances_path())
    conditions = {(one.name, m.name): one.condition(m.name) for one in instances for m in METHODS}
    with ExitStack() as stack:
        folder = arguments.output or Path(
            stack.enter_context(tempfile.TemporaryDirectory(prefix="planner-"))
        )
        known = _known(instances, arguments.jobs)
        with progress("instances") as told:
            results = run({folder: [*conditions.values()]}, workers=arguments.jobs, told=told)[
                folder
            ]
    values = _values(conditions, results.rows)
    table = experiment_tables.instances_table(instances, known, values)
    written = []
    if arguments.output:
        with written_whole(arguments.output / PAGE) as new:
            page = experiment_tables.instances_page(instances, known, values)
            new.write_text(page, encoding="utf-8")
        written = [f"written to {arguments.output}"]
    told_of = [_told(one, known[one.name], values) for one in instances]
    shown: list[Any] = [table, *_moved(instances, known), *written]
    tell(arguments, {"instances": told_of}, shown)
    return 0


def _known(instances: Sequence[Instance], jobs: int | None) -> dict[str, Evaluation]:
    """Return what the best plans known are worth when they are flown again."""
    known = {}
    with progress("flying the best plans known") as told:
        for done, instance in enumerate(instances):
            told(done, len(instances))
            opened = instance.opened()
            fresh = Recorder(opened, jobs).evaluation().futures
            known[instance.name] = flown_again(instance, opened, fresh)
    return known


def _values(
    conditions: Mapping[tuple[str, str], Condition], rows: Sequence[Mapping[str, Any]]
) -> dict[tuple[str, str], float | None]:
    found = {row["id"]: row["expected_detection_time_s"] for row in rows}
    return {pair: found[condition.id] for pair, condition in conditions.items()}


def _told(
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
    """Return a line for each best plan whose value here is not the one that was written down."""
    return [
        f"{one.name}: the best plan known is worth {value:,.1f} s here, {one.value_s:,.1f} s were "
        "written down"
        for one in instances
        for value in [known[one.name].expected_detection_time_s]
        if abs(value - one.value_s) > 0.1
    ]
