"""Traffic in which particles ride: what of it SUMO is told, and how its sessions start.

A SUMO scenario is read, not obeyed: SUMO never sees its configuration, only options that were
taken from it, and its input files by names of our own. What it writes falls into a folder that is
removed.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path

from planner.network.sumo import sumo_environment

LARGEST_SEED = 2**31 - 1  # that SUMO takes


@dataclass(frozen=True)
class Traffic:
    """The traffic of a scenario, in as many runs as may be asked for.

    Picklable, and of plain values: a process that runs SUMO takes it as it is.
    """

    at_s: float  # its own time that is the target's time 0
    realisations: int  # R: particles ride in 0 to R - 1, fresh targets in R to 2R - 1
    seed: int  # of all realisations
    depart_offset_s: float = 0.0  # each vehicle sets out later by so much at most
    config: Path | None = None  # whose options these are
    options: tuple[tuple[str, str], ...] = ()  # name and value, as SUMO is given them
    routes: tuple[Path, ...] = ()
    additional: tuple[Path, ...] = ()
    allowed: tuple[Path, ...] = ()  # folders below which inputs lie
    control: str | None = None  # module:function that steers it
    files: tuple[tuple[Path, str], ...] = ()  # all that are read, each with its sha256

    @property
    def digest(self) -> str:
        """What tells it from other traffic: its options, and the bytes of all that is read."""
        said = (
            self.at_s,
            self.realisations,
            self.seed,
            self.depart_offset_s,
            self.options,
            self.control,
            [sha256 for _, sha256 in self.files],
        )
        return hashlib.sha256(repr(said).encode()).hexdigest()


def realisation_seed(traffic: Traffic, realisation: int) -> int:
    """Return SUMO's seed in one realisation."""
    said = hashlib.sha256(f"traffic {traffic.seed} {realisation}".encode()).digest()
    return int.from_bytes(said[:8], "little") % LARGEST_SEED + 1


def traffic_options(traffic: Traffic, net: Path, realisation: int, work: Path) -> list[str]:
    """Return the words that start SUMO on the traffic of one realisation.

    Parameters
    ----------
    net
        The file of the network that particles drive on.
    work
        An empty folder, which lives as long as SUMO runs: links to the inputs are made there, and
        what SUMO writes falls there.
    """
    sumo_environment()
    given = {
        **dict(traffic.options),
        "net-file": _linked(net, work, "net"),
        "route-files": ",".join(
            str(_linked(file, work, f"routes{i}")) for i, file in enumerate(traffic.routes)
        ),
        "additional-files": ",".join(
            str(_linked(file, work, f"additional{i}")) for i, file in enumerate(traffic.additional)
        ),
        "seed": realisation_seed(traffic, realisation),
        "random-depart-offset": traffic.depart_offset_s,
        "xml-validation": "never",
        "xml-validation.net": "never",
        "xml-validation.routes": "never",
        "no-step-log": "true",
        "no-warnings": "true",
        "duration-log.disable": "true",
    }
    return ["sumo"] + [f"--{key}={value}" for key, value in given.items() if value != ""]


def _linked(file: Path, work: Path, name: str) -> Path:
    """Return a link to a file without what SUMO takes for more: it parts paths at commas."""
    link = work / f"{name}.xml{'.gz' if file.suffix == '.gz' else ''}"
    link.symlink_to(file.resolve())
    return link
