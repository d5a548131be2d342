"""Traffic in which particles ride: what SUMO is told of it, and how its runs differ.

A SUMO scenario is read, not obeyed. SUMO never sees its configuration: it is given options that
were taken from it, and its input files by names of our own (`InputFiles`).
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from planner.futures.demand import Demand, demand_routes
from planner.futures.simulation import plain_link
from planner.futures.traffic_files import InputFiles
from planner.network.sumo import sumo_environment
from planner.user_code import UserFunction

LARGEST_SEED = 2**31 - 1  # that SUMO takes
# What is SUMO's own doing in all scenarios. Route files are read to their end at the start: forks
# of one session would share, and so lose, the place up to which they are read.
ALWAYS = {
    "route-steps": "0",
    "xml-validation": "never",
    "xml-validation.net": "never",
    "xml-validation.routes": "never",
    "no-step-log": "true",
    "no-warnings": "true",
    "duration-log.disable": "true",
}


class Permit(NamedTuple):
    """What a person says at the command line of a scenario's traffic, and no file may say."""

    folders: tuple[Path, ...] = ()  # where its files may lie, beside the scenario's own folder
    control: str | None = None  # the function that steers it, as `UserFunction.named` takes it


NO_PERMIT = Permit()


@dataclass(frozen=True)
class Traffic:
    """The traffic of a scenario, in as many runs as may be asked for.

    Picklable, and of plain values: a process that runs SUMO takes it as it is.
    """

    given_as: Path  # the file that messages name
    at_s: float  # its own time that is the target's time 0
    realisations: int  # R: particles ride in 0 to R - 1, fresh targets in R to 2R - 1
    seed: int  # of all realisations
    depart_offset_s: float = 0.0  # each vehicle sets out later by so much at most
    options: tuple[tuple[str, str], ...] = ()  # name and value, as SUMO is given them
    routes: tuple[Path, ...] = ()
    additional: tuple[Path, ...] = ()
    weights: tuple[Path, ...] = ()
    demand: Demand | None = None  # in place of routes
    allowed: tuple[Path, ...] = ()  # folders below which files lie
    control: UserFunction | None = None  # that steers it
    files: tuple[tuple[Path, str], ...] = ()  # all that are read, each with its SHA-256
    left_out: tuple[str, ...] = ()  # of its configuration and files, what SUMO is not told

    @property
    def digest(self) -> str:
        """What tells it from other traffic: all that is said of it, and the bytes of its files."""
        said = (
            self.at_s,
            self.realisations,
            self.seed,
            self.depart_offset_s,
            sorted(self.options),
            (len(self.routes), len(self.additional), len(self.weights)),
            self.demand,
            self.control and self.control.name,
            tuple(sha256 for _, sha256 in self.files),
        )
        return hashlib.sha256(repr(said).encode()).hexdigest()

    def as_dict(self) -> dict[str, Any]:
        """Return what it is, and what of it SUMO is told and not told, as plain values."""
        return {
            "source": str(self.given_as),
            "at_s": self.at_s,
            "realisations": self.realisations,
            "depart_offset_s": self.depart_offset_s,
            "vehicles_per_hour": self.demand and self.demand.vehicles_per_hour,
            "taken": dict(self.options),
            "files": [str(file) for file, _ in self.files],
            "left_out": list(self.left_out),
            "sha256": self.digest,
        }


def input_options(traffic: Traffic, files: InputFiles) -> dict[str, str]:
    """Return the options by which SUMO is given a scenario's files.

    Raises
    ------
    InputError
        If there is one that it may not be given.
    """
    by_option = {
        "route-files": traffic.routes,
        "additional-files": traffic.additional,
        "weight-files": traffic.weights,
    }
    return {
        option: ",".join(str(files.named(file, traffic.given_as)) for file in named)
        for option, named in by_option.items()
        if named
    }


def traffic_options(traffic: Traffic, net: Path, realisation: int, work: Path) -> list[str]:
    """Return the words that start SUMO on the traffic of one realisation.

    Parameters
    ----------
    net
        The file of the network that particles drive on.
    work
        An empty folder that lives as long as SUMO runs, for the names of the input files.

    Raises
    ------
    InputError
        If a file is not what can be read any more.
    """
    sumo_environment()
    seed = realisation_seed(traffic, realisation)
    given = {
        **dict(traffic.options),
        **input_options(traffic, InputFiles(traffic.allowed, work)),
        **ALWAYS,
        "net-file": str(plain_link(net, work)),
        "seed": str(seed),
    }
    if traffic.demand is not None:
        routes = work / "demand.rou.xml"
        routes.symlink_to(demand_routes(traffic.demand, net, seed).resolve())
        given["route-files"] = str(routes)
    if traffic.depart_offset_s > 0.0:
        given["random-depart-offset"] = repr(traffic.depart_offset_s)
    return ["sumo", *(f"--{name}={value}" for name, value in given.items())]


def realisation_seed(traffic: Traffic, realisation: int) -> int:
    """Return SUMO's seed in one realisation."""
    said = hashlib.sha256(f"traffic {traffic.seed} {realisation}".encode()).digest()
    return int.from_bytes(said[:8], "little") % LARGEST_SEED + 1
