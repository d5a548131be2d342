"""`planner instances`: the frozen instances for those who work without this program."""

import argparse
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from planner.cli.arguments import add_jobs, count, path
from planner.cli.printing import print_result
from planner.errors import InputError, OutputError

if TYPE_CHECKING:
    from planner.detection.evaluation import Evaluation
    from planner.experiments.instances import Instance
    from planner.mission.recorder import Recorder

SUMMARY = "export the frozen instances as plain files, or score submitted plans"
DETAILS = """\
`export` writes a folder that needs neither SUMO nor this program: roads, UAV
and sensor as JSON, futures as NumPy files, and a scorer. `results` flies the
plans in DIR/NAME/*.json and makes a page of what they are worth."""
EXAMPLES = (
    ("instances export runs/instances", "all of them; takes minutes"),
    ("instances export runs/one --only bs3d", "one of them"),
    ("instances results docs/instances/results", "what are plans worth?"),
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner instances`."""
    parser.add_argument("action", choices=("export", "results"), help="what to do")
    parser.add_argument(
        "directory", type=path, metavar="DIR", help="folder to write, or that of submitted plans"
    )
    parser.add_argument(
        "--only",
        metavar="NAME",
        action="append",
        default=[],
        help="this instance alone; repeatable",
    )
    parser.add_argument(
        "--targets", type=count, metavar="N", help="futures to judge plans on (default: 8000)"
    )
    parser.add_argument(
        "--seed-file",
        type=path,
        metavar="FILE",
        help="results: the seed of the third set of futures, once it has been opened",
    )
    parser.add_argument("-o", "--output", type=path, metavar="FILE", help="results: write the page")
    parser.add_argument("--force", action="store_true", help="overwrite FILE, or what is in DIR")
    add_jobs(parser)


def run(arguments: argparse.Namespace) -> int:
    """Export the instances, or make the page of results."""
    if arguments.action == "export":
        for option in ("seed_file", "output"):
            if getattr(arguments, option) is not None:
                name = option.replace("_", "-")
                raise InputError(f"--{name}: goes with `instances results` only; leave it out")
        return _export(arguments)
    return _results(arguments)


def _export(arguments: argparse.Namespace) -> int:
    from planner.cli.session import new_files
    from planner.experiments import portable
    from planner.experiments.submissions import SEED_SHA256
    from planner.report.experiment_tables import exported_table

    folder, force, done = arguments.directory, arguments.force, []
    if folder.is_dir() and any(folder.iterdir()) and not force:
        raise OutputError(
            f"{folder}: is not empty; choose a new folder, or --force to write beside what is there"
        )
    with ExitStack() as rest:
        beside = new_files(rest, folder, portable.OF_ALL, force=force)
        for one in _chosen(arguments):
            with ExitStack() as stack:
                place = folder / portable.folder_of(one.name)
                here = new_files(stack, place, portable.OF_AN_INSTANCE, force=force)
                recorder = stack.enter_context(_recorder(arguments, one))
                done.append(portable.export(here, one, recorder, _judged(arguments)))
        with ExitStack() as stack:
            place = folder / portable.TESTS
            portable.export_tests(new_files(stack, place, portable.OF_TESTS, force=force))
        portable.export_rest(beside, folder, done, SEED_SHA256)
    summary = {"directory": str(folder), "instances": [vars(one) for one in done]}
    print_result(arguments, summary, [exported_table(done), f"written to {folder}"])
    return 0


def _results(arguments: argparse.Namespace) -> int:
    from planner.cli.session import output_file
    from planner.experiments import submissions

    with ExitStack() as stack:
        new = output_file(stack, arguments)
        chosen = _chosen(arguments)
        submitted = submissions.read_submissions(arguments.directory, chosen)
        file = arguments.seed_file
        seed = None if file is None else submissions.read_seed(file)
        scores: dict[tuple[str, str], Evaluation] = {}
        for one in chosen:
            mine = [plan for plan in submitted if plan.instance == one.name]
            if mine:
                with _recorder(arguments, one) as recorder:
                    targets = submissions.targets_of(recorder, seed, _judged(arguments))
                scores |= submissions.scores_on(one, mine, recorder, targets)
        opened = "" if file is None else file.read_text(encoding="utf-8").strip()
        page = submissions.results_page(scores, seed=opened)
        if new is not None:
            new.write_text(page, encoding="utf-8", newline="\n")
    summary = {
        "seed": opened or None,
        "scores": [
            {
                "instance": name,
                "whose": whose,
                "expected_detection_time_s": found.expected_detection_time_s,
                "ci95_s": list(found.ci95_s),
                "detection_probability": found.detection_probability,
            }
            for (name, whose), found in scores.items()
        ],
    }
    print_result(arguments, summary, [page] if new is None else [f"written to {arguments.output}"])
    return 0


def _chosen(arguments: argparse.Namespace) -> "list[Instance]":
    from planner.experiments.instances import instances_path, read_instances
    from planner.experiments.portable import chosen

    return chosen(read_instances(instances_path()), arguments.only)


def _judged(arguments: argparse.Namespace) -> int:
    from planner.experiments.portable import JUDGED

    return arguments.targets or JUDGED


@contextmanager
def _recorder(arguments: argparse.Namespace, one: "Instance") -> "Iterator[Recorder]":
    """Give an instance's recorder, which shows how far it is."""
    from planner.cli.backends import recorder_of
    from planner.cli.progress import progress_bar

    with progress_bar(f"recording {one.name}") as progress:
        yield recorder_of(arguments, one.opened(), progress)
