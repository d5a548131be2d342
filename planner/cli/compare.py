"""`planner compare`: its options; `comparison` and `on_instances` do the work."""

import argparse

from planner.cli.arguments import (
    add_methods,
    add_objective,
    add_scenario,
    add_targets,
    objective_overrides,
    path,
    span,
)
from planner.errors import InputError

SUMMARY = "compare all methods on the same futures and fresh targets"
DETAILS = ""
EXAMPLES = (
    ("compare grid5x5 -o methods.csv", "all methods, also as CSV"),
    ("compare grid5x5 --bound", "how far from the best plan?"),
    ("compare grid5x5 --method mine.py:mine", "a planner of your own as well"),
    ("compare --instances -o runs/instances", "the frozen problems"),
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner compare`."""
    add_scenario(parser, optional=True)
    parser.add_argument(
        "--instances",
        action="store_true",
        help="use the frozen benchmark instances instead, and compare with their best known "
        "plans; -o is then a folder, and an interrupted comparison resumes",
    )
    parser.add_argument(
        "--beliefs",
        action="store_true",
        help="plan for each belief of target.mix instead, and judge each plan under each",
    )
    parser.add_argument(
        "--bound",
        action="store_true",
        help="also bound the best possible plan, for a column of gaps; takes about a minute",
    )
    parser.add_argument(
        "--time-limit", type=span, metavar="S", help="with --bound: stop bounding after S seconds"
    )
    parser.add_argument("-o", "--output", type=path, metavar="FILE", help="write the table as CSV")
    parser.add_argument("--force", action="store_true", help="overwrite FILE")
    add_methods(parser, what="also compare")
    add_objective(parser)
    add_targets(parser)


def run(arguments: argparse.Namespace) -> int:
    """Compare all methods on one scenario, or on the frozen instances."""
    if arguments.instances:
        if arguments.bound:
            raise InputError("--bound: goes with one scenario, not with --instances")
        from planner.cli.on_instances import compare_on_instances

        return compare_on_instances(arguments)
    if arguments.scenario is None:
        raise InputError("compare: names no scenario; give one, or --instances")
    if arguments.time_limit is not None and not arguments.bound:
        raise InputError(f"--time-limit {arguments.time_limit:g}: goes with --bound")
    overrides = objective_overrides(arguments)
    if arguments.beliefs:
        if arguments.bound or arguments.output is not None or arguments.method:
            raise InputError("--beliefs: goes without --bound, --method and -o; leave them out")
        from planner.cli.beliefs import compare_beliefs

        return compare_beliefs(arguments, overrides)
    from planner.cli.comparison import compare_on_scenario

    return compare_on_scenario(arguments, overrides)
