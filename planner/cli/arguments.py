"""Arguments that several commands take, and what their texts mean."""

import argparse
from pathlib import Path

from planner.clock import seconds
from planner.errors import PlannerError


def add_scenario(parser: argparse.ArgumentParser, *, optional: bool = False) -> None:
    """Have a scenario named, with what may be changed of it."""
    parser.add_argument(
        "scenario",
        nargs="?" if optional else None,
        metavar="SCENARIO",
        help="a scenario.toml, its folder, the name of a shipped one (grid5x5, figure3, ...), "
        "or the run.json of an earlier run",
    )
    parser.add_argument(
        "-n", "--net-file", type=path, metavar="FILE", help="on another SUMO net (.net.xml)"
    )
    parser.add_argument(
        "-s", "--seed", type=seed, help="seed of all random draws (default: the scenario's)"
    )
    parser.add_argument("--preset", metavar="NAME", help="apply the scenario's [presets.NAME]")
    parser.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="override a field of the scenario, such as uav.start.distance_m=120000; repeatable",
    )
    add_jobs(parser)


def add_run(parser: argparse.ArgumentParser) -> None:
    """Have the folder of a run named."""
    parser.add_argument(
        "directory", type=path, metavar="DIR", help="folder of a run that `plan` wrote"
    )


def add_jobs(parser: argparse.ArgumentParser) -> None:
    """Let the number of processes be chosen."""
    parser.add_argument(
        "-j", "--jobs", type=count, metavar="N", help="processes that run SUMO (default: cores)"
    )


def add_targets(parser: argparse.ArgumentParser, *, default: int) -> None:
    """Let the number of fresh targets be chosen."""
    parser.add_argument(
        "--targets",
        type=count,
        default=default,
        metavar="N",
        help="fresh targets to fly against (default: %(default)s)",
    )


def add_objective(parser: argparse.ArgumentParser) -> None:
    """Let what the search is for be chosen."""
    parser.add_argument(
        "--objective",
        choices=("time", "probability"),
        help="least expected detection time, or most probably found by --by (default: the "
        "scenario's)",
    )
    parser.add_argument(
        "--by",
        type=moment,
        metavar="TIME",
        help="the deadline, seconds or H:M:S since the target was last seen",
    )


def moment(text: str) -> float:
    """Return seconds, given so or as H:M:S."""
    try:
        return seconds(text)
    except PlannerError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def span(text: str) -> float:
    """Return how long something may take, in seconds, given so or as H:M:S."""
    lasts_s = moment(text)
    if not lasts_s >= 0.0:
        raise argparse.ArgumentTypeError(f"should be seconds, or H:M:S, from 0 on, not {text!r}")
    return lasts_s


def share(text: str) -> float:
    """Return a number from 0 on."""
    try:
        number = float(text)
    except ValueError:
        number = -1.0
    if not 0.0 <= number < float("inf"):
        raise argparse.ArgumentTypeError(f"should be a share from 0 on, such as 0.1, not {text!r}")
    return number


def count(text: str) -> int:
    """Return a whole number from 1 on."""
    return _whole_number(text, 1)


def seed(text: str) -> int:
    """Return a whole number from 0 on."""
    return _whole_number(text, 0)


def _whole_number(text: str, least: int) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) < 19 and int(text) >= least):
        raise argparse.ArgumentTypeError(f"should be a whole number from {least} on, not {text!r}")
    return int(text)


def path(text: str) -> Path:
    """Return the path of a file or a folder."""
    if not text:
        raise argparse.ArgumentTypeError("is empty; name a file or a folder")
    return Path(text)
