"""Arguments that several commands take, their types, and the overrides they stand for."""

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from planner.clock import seconds
from planner.errors import InputError, PlannerError

if TYPE_CHECKING:
    from planner.futures.traffic import Permit


def add_scenario(parser: argparse.ArgumentParser, *, optional: bool = False) -> None:
    """Add the scenario and what may be changed of it."""
    parser.add_argument(
        "scenario",
        nargs="?" if optional else None,
        metavar="SCENARIO",
        help="a scenario.toml or its folder, the name of a shipped scenario (grid5x5, figure3, "
        "...), or the run.json of an earlier run",
    )
    parser.add_argument(
        "-n",
        "--net-file",
        type=path,
        metavar="FILE",
        help="use another network: a .net.xml, a .sumocfg or an OpenStreetMap file",
    )
    parser.add_argument(
        "-s", "--seed", type=seed, help="seed of all random draws (default: the scenario's)"
    )
    parser.add_argument("--preset", metavar="NAME", help="apply the scenario's [presets.NAME]")
    add_settings(parser)
    add_permit(parser)
    add_jobs(parser)


def scenario_overrides(arguments: argparse.Namespace) -> list[str]:
    """Return the scenario overrides that the options of `add_scenario` stand for."""
    overrides = list(arguments.set)
    if arguments.seed is not None:
        overrides.append(f"search.seed={arguments.seed}")
    if arguments.net_file is not None:
        from planner.scenario.sections import OF_SUMO

        net = str(arguments.net_file)
        if not net.startswith(OF_SUMO):
            net = str(arguments.net_file.resolve())
        overrides.append(f"network={{ net = {_toml_text(net)} }}")
    return overrides


def add_run(parser: argparse.ArgumentParser) -> None:
    """Add the folder of a run."""
    parser.add_argument(
        "directory", type=path, metavar="DIR", help="folder of a run that `plan` wrote"
    )
    add_permit(parser)


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Add keys of a scenario that are set."""
    parser.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="override a scenario key, e.g. uav.start.distance_m=120000; repeatable",
    )


def add_permit(parser: argparse.ArgumentParser) -> None:
    """Add what only a person, and no file, may say of a scenario's traffic."""
    parser.add_argument(
        "--allow",
        metavar="DIR",
        type=path,
        action="append",
        default=[],
        help="let the files of [traffic] lie below this folder too, not the scenario's alone; "
        "repeatable",
    )
    parser.add_argument(
        "--control",
        metavar="MODULE:FUNCTION",
        help="a function of yours (also FILE.py:FUNCTION) that steers the traffic: called with "
        "libsumo before each step",
    )


def permit_of(arguments: argparse.Namespace) -> "Permit":
    """Return what was said of the traffic of the scenario, or of the run, that was named."""
    from planner.futures.traffic import Permit

    return Permit(tuple(arguments.allow), arguments.control)


def add_jobs(parser: argparse.ArgumentParser) -> None:
    """Add the number of processes; they are this machine's, unless `add_backend` is called too."""
    parser.add_argument(
        "-j", "--jobs", type=count, metavar="N", help="SUMO processes (default: one per core)"
    )
    parser.set_defaults(backend="processes", address=None, insecure=False)


def add_backend(parser: argparse.ArgumentParser, *, what: str, needs: str) -> None:
    """Add where the work is done.

    Parameters
    ----------
    what
        Is done there.
    needs
        What the machines of a cluster have to share with this one.
    """
    parser.add_argument(
        "--backend",
        choices=("processes", "dask"),
        default="processes",
        help=f"{what} in local processes or on Dask (default: %(default)s)",
    )
    parser.add_argument(
        "--address",
        metavar="ADDR",
        help=f"address of a Dask scheduler, e.g. tls://host:8786, whose workers have this planner "
        f"and {needs} (default: start a local cluster)",
    )
    parser.add_argument(
        "--insecure",
        action="store_true",
        help="reach a scheduler on another machine without TLS, in a network that you trust",
    )


def add_targets(parser: argparse.ArgumentParser, *, default: int | None = None) -> None:
    """Add the number of fresh targets.

    Parameters
    ----------
    default
        If not given, what `planner.mission.sample_sizes` has for the scenario.
    """
    usual = "4000, fewer in towns" if default is None else "%(default)s"
    parser.add_argument(
        "--targets",
        type=count,
        default=default,
        metavar="N",
        help=f"number of fresh targets to fly against (default: {usual})",
    )


def add_methods(parser: argparse.ArgumentParser, *, what: str) -> None:
    """Add methods beside those that a command has anyway.

    Parameters
    ----------
    what
        Is done with them.
    """
    parser.add_argument(
        "--method",
        metavar="NAME",
        action="append",
        default=[],
        help=f"{what} with this method, such as a planner of your own, path.py:function; "
        "repeatable",
    )


def add_origin(parser: argparse.ArgumentParser) -> None:
    """Add where on the Earth a net lies that does not say so."""
    parser.add_argument(
        "--origin",
        type=lat_lon,
        metavar="LAT,LON",
        help="where x and y are 0, for a net without a projection (south: --origin=-33.9,18.4)",
    )


def add_objective(parser: argparse.ArgumentParser) -> None:
    """Add what the search optimizes."""
    parser.add_argument(
        "--objective",
        choices=("time", "probability"),
        help="minimize the expected detection time, or maximize the probability of detection by "
        "the deadline --by (default: the scenario's)",
    )
    parser.add_argument(
        "--by",
        type=moment,
        metavar="TIME",
        help="the deadline, in seconds or H:M:S after the target was last seen",
    )


def objective_overrides(arguments: argparse.Namespace) -> list[str]:
    """Return the scenario overrides that the options of `add_objective` stand for.

    Raises
    ------
    InputError
        If there is a deadline for an objective that has none.
    """
    objective, by_s = arguments.objective, arguments.by
    if by_s is not None and objective != "probability":
        raise InputError(
            f"--by {by_s:g}: goes with --objective probability; give both, or leave it out"
        )
    values = {"search.objective": objective and _toml_text(objective), "search.by_s": by_s}
    return [f"{key}={value}" for key, value in values.items() if value is not None]


def _toml_text(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def moment(text: str) -> float:
    """Return a time in seconds, written as seconds or as H:M:S."""
    try:
        return seconds(text)
    except PlannerError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def span(text: str) -> float:
    """Return a duration in seconds, written as seconds or as H:M:S."""
    lasts_s = moment(text)
    if not lasts_s >= 0.0:
        raise argparse.ArgumentTypeError(f"should be seconds, or H:M:S, from 0 on, not {text!r}")
    return lasts_s


def share(text: str) -> float:
    """Return a number from 0 to 1."""
    try:
        number = float(text)
    except ValueError:
        number = -1.0
    if not 0.0 <= number <= 1.0:
        percent = 1.0 < number <= 100.0
        remedy = f"give {number / 100:g} for {number:g} %" if percent else "such as 0.1 for 10 %"
        raise argparse.ArgumentTypeError(f"should be a share from 0 to 1, not {text!r}; {remedy}")
    return number


def count(text: str) -> int:
    """Return a whole number of at least 1."""
    return _whole_number(text, 1)


def seed(text: str) -> int:
    """Return a whole number of at least 0."""
    return _whole_number(text, 0)


def _whole_number(text: str, least: int) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) < 19 and int(text) >= least):
        raise argparse.ArgumentTypeError(f"should be a whole number from {least} on, not {text!r}")
    return int(text)


def path(text: str) -> Path:
    """Return the path of a file or a folder."""
    if not text:
        raise argparse.ArgumentTypeError("is empty; give the path of a file or a folder")
    return Path(text)


def metres(text: str) -> float:
    """Return a length in metres from 0 on."""
    try:
        length_m = float(text)
    except ValueError:
        length_m = math.nan
    if not 0.0 <= length_m < math.inf:
        raise argparse.ArgumentTypeError(f"should be metres from 0 on, not {text!r}")
    return length_m


def lat_lon(text: str) -> tuple[float, float]:
    """Return a latitude and a longitude in degrees."""
    try:
        lat_deg, lon_deg = (float(part) for part in text.split(","))
    except ValueError:
        lat_deg = lon_deg = math.nan
    if not (-90.0 < lat_deg < 90.0 and -180.0 <= lon_deg <= 180.0):
        raise argparse.ArgumentTypeError(
            f"should be a latitude and a longitude in degrees, as in 49.61,6.13, not {text!r}"
        )
    return lat_deg, lon_deg
