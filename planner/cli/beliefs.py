"""What `planner compare --beliefs` does: plans for each belief, judged under each."""

import argparse
import textwrap
from collections.abc import Iterator, Sequence
from typing import Any

from planner.cli.backends import recorder_of
from planner.cli.printing import print_result
from planner.cli.progress import progress_bar
from planner.cli.session import opened_scenario
from planner.messages import percent, plain
from planner.mission.regret import Regrets, regrets
from planner.mission.several import refuse_several
from planner.report.formats import Column, FittingTable
from planner.search.methods import method_named

WIDTH = 79  # characters of a line


def compare_beliefs(arguments: argparse.Namespace, overrides: Sequence[str]) -> int:
    """Print what a plan for each component of the mixture costs where another one is true."""
    opened = opened_scenario(arguments, overrides)
    refuse_several(opened, "compare --beliefs")
    with progress_bar("beliefs") as progress:
        found = regrets(
            recorder_of(arguments, opened),
            method_named("best"),
            progress,
            targets=arguments.targets,
        )
    summary = {
        "planned_for": list(found.planned_for),
        "truths": list(found.truths),
        "beliefs": list(found.beliefs),
        "figure": [list(row) for row in found.figure],
        "regret": [list(row) for row in found.regret],
    }
    print_result(arguments, summary, _blocks(found, opened.scenario.name))
    return 0


def _blocks(found: Regrets, name: str) -> Iterator[Any]:
    table = FittingTable(
        f"{name}: each belief's plan, under each",
        (
            Column("planned\nfor", left=True),
            *(Column(f"if {truth}\nis true") for truth in found.truths),
            Column("worst\nregret"),
        ),
    )
    for planned, figures, worst in zip(found.planned_for, found.figure, found.worst, strict=True):
        cells = [f"{one:,.0f} s" if found.is_time else percent(one) for one in figures]
        table.add_row(planned, *cells, percent(worst))
    yield table
    for truth, belief in zip(found.truths, found.beliefs, strict=True):
        yield textwrap.fill(plain(f"  {truth}: {belief}"), WIDTH, subsequent_indent=5 * " ")
    least = min(range(len(found.worst)), key=lambda k: found.worst[k])
    yield (
        f"least worst regret: the plan for {found.planned_for[least]}; "
        "target.caution widens a belief that may be wrong altogether"
    )
