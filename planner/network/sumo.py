"""The only door to the SUMO installation: its folders, its programs, its network reader."""

import importlib.metadata
import importlib.util
import logging
import os
import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from planner.errors import InputError, SumoError
from planner.interrupts import undone_if_stopped

log = logging.getLogger(__name__)

CAR = "passenger"
MESSAGES = 3  # of SUMO's that are shown at most
# What sumolib lets out where a net is broken.
STUMBLES = (ValueError, TypeError, LookupError, AttributeError, AssertionError)


@cache
def sumo_home() -> Path:
    """Return the folder of the SUMO that was installed with this package.

    Raises
    ------
    SumoError
        If the Python package ``eclipse-sumo`` is missing.
    """
    spec = importlib.util.find_spec("sumo")
    home = Path(spec.origin).parent if spec and spec.origin else None
    if home is None or not (home / "bin").is_dir():
        raise SumoError("SUMO is not installed here; run: pip install eclipse-sumo==1.28.*")
    return home


@cache
def sumo_version() -> str:
    """Return SUMO's version, such as ``1.28.0``, without loading anything of it."""
    try:
        return importlib.metadata.version("eclipse-sumo")
    except importlib.metadata.PackageNotFoundError:
        raise SumoError(
            "SUMO is not installed here; run: pip install eclipse-sumo==1.28.*"
        ) from None


def sumo_environment() -> None:
    """Point this process and its children to SUMO's own data, whatever the user has set.

    Another SUMO's schemas and projections would not fit the programs that are run here.
    """
    os.environ["SUMO_HOME"] = str(sumo_home())
    os.environ["PROJ_DATA"] = os.environ["PROJ_LIB"] = str(sumo_home() / "data" / "proj")


def binary(name: str) -> Path:
    """Return the path of one of SUMO's programs, such as ``netconvert`` or ``sumo``.

    Raises
    ------
    SumoError
        If SUMO or that program is missing.
    """
    program = sumo_home() / "bin" / (f"{name}.exe" if os.name == "nt" else name)
    if not program.is_file():
        raise SumoError(f"{program} is missing; install eclipse-sumo again")
    return program


def netconvert(options: Sequence[str], *, subject: str) -> None:
    """Run netconvert on a user's sources.

    Parameters
    ----------
    subject
        The source's name, for the message.

    Raises
    ------
    InputError
        If netconvert refuses the sources; the text is its own message.
    SumoError
        If netconvert cannot be run or dies.
    """
    sumo_environment()
    try:
        running = subprocess.Popen(
            [str(binary("netconvert")), *options],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
        )
        with undone_if_stopped(running.kill):
            said = running.communicate()[1]
    except OSError as error:
        raise SumoError(f"netconvert cannot be run: {error.strerror or error}") from error
    if running.returncode < 0:
        raise SumoError(f"netconvert died of signal {-running.returncode} on {subject}")
    if running.returncode > 0:
        raise InputError(f"{subject}: netconvert refuses it: {_reason(said)}")
    if said.strip():
        log.debug("netconvert on %s: %s", subject, said.strip())


def parse_net(path: Path) -> Any:
    """Return sumolib's object for a ``.net.xml``, without the insides of junctions.

    Raises
    ------
    InputError
        If the file is not XML or not a SUMO net.
    """
    sumo_environment()
    from xml.sax import SAXException

    import sumolib

    try:
        net = sumolib.net.readNet(str(path), lxml=False)
    except (SAXException, OSError, EOFError, *STUMBLES) as error:
        missing = isinstance(error, KeyError)
        reason = f"it lacks {error}" if missing else " ".join(str(error).split())
        raise InputError(
            f"{path}: not a readable SUMO network ({reason}); "
            "give a .net.xml that netconvert or netedit wrote"
        ) from error
    lost = [node.getID() for node in net.getNodes() if node.getType() is None]
    if lost:
        raise InputError(f"{path}: edges lead to {lost[0]!r}, which is no junction of the network")
    return net


def edges_not_for_cars(path: Path) -> frozenset[str]:
    """Return the names of the edges in a ``.net.xml`` that passenger cars may not use.

    Raises
    ------
    InputError
        As `parse_net`.
    """
    edges = parse_net(path).getEdges(False)
    return frozenset(str(edge.getID()) for edge in edges if not edge.allows(CAR))


def _reason(stderr: str) -> str:
    """Return SUMO's error messages in one line, without its warnings and its farewell."""
    said: list[str] = []
    for line in stderr.splitlines():
        # A line that does not start a message of its own continues the one before.
        if line.startswith("Error:") or (said and line.startswith(" ")):
            said.append(line.removeprefix("Error:").strip())
    if len(said) > MESSAGES:
        said[MESSAGES:] = [f"(and {len(said) - MESSAGES} more)"]
    return " ".join(said) or " ".join(stderr.split()) or "it gives no reason"
