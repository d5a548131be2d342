"""The files of a SUMO scenario by names of our own: read from where they may lie, writing nothing.

What might make SUMO write, connect or read elsewhere is taken out of copies; every other file is
given to it as a link to the user's own.
"""

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from planner.errors import InputError
from planner.network.sumo import NET_ELEMENTS
from planner.xml_guard import holds, rewritten_xml

NOWHERE = "NUL"  # SUMO's name, on every system, of a file that keeps nothing
LONGEST = 100  # characters of a name
DEEPEST = 100  # files that include each other

# What routes and additional files may consist of, as a regular expression; not among them are
# edgeData, laneData, timedEvent and vTypeProbe, which write and do nothing else.
ELEMENTS = (
    NET_ELEMENTS
    + "|routes|route-alternatives|additional|tazs|include|vType|vTypeDistribution|route|"
    "routeDistribution|vehicle|trip|flow|stop|person|personFlow|personTrip|walk|ride|tranship|transport|container|"
    "containerFlow|preference|busStop|trainStop|containerStop|chargingStation|parkingArea|space|"
    "access|e1Detector|inductionLoop|instantInductionLoop|e2Detector|laneAreaDetector|e3Detector|"
    "entryExitDetector|detEntry|detExit|rerouter|rerouterValue|interval|closingLaneReroute|"
    "closingReroute|destProbReroute|routeProbReroute|parkingAreaReroute|stationReroute|"
    "viaProbReroute|overtakingReroute|variableSpeedSign|step|calibrator|routeProbe|vaporizer|WAUT|"
    "wautJunction|wautSwitch|poly|poi|overheadWire|overheadWireSegment|overheadWireClamp|"
    r"tractionSubstation|deadlock|laneType|carFollowing-\w+"
)
ELEMENT = re.compile(ELEMENTS)
# These read a file (SUMO's NLTriggerBuilder); all others that have the attribute write it (its
# NLHandler and NLDetectorBuilder), and so does a calibrator's "output".
READERS = ("rerouter", "variableSpeedSign", "calibrator")
PICTURES = ("imgFile", "osgFile")
# Keys of parameters that name files (of signals: SUMO's MSActuatedTrafficLightLogic and
# NEMAController; of vehicles: MSDevice_SSM, which writes by a vehicle's name where none is given,
# and MSDevice_ToC), and devices that write and do nothing else.
WRITES = re.compile(
    r"file|output|^(has|device)\.(ssm|fcd|emissions|tripinfo|vehroute|bt\w+|example)\b",
    re.IGNORECASE,
)
# A tag that is cut off at the end of what is looked at is looked at again, whole.
SUSPECTS = re.compile(
    rb"<(?!(?:" + ELEMENTS.encode() + rb")[\s/>]|[/?!]|[\w.:-]{0,60}\Z)"
    rb"|<(?:param|include)\b|\b(?:file|output|imgFile|osgFile)\b"
)


class InputFiles:
    """The files that SUMO is given, and all that these name.

    Parameters
    ----------
    allowed
        Folders below which they have to lie.
    work
        An empty folder for the names by which SUMO is given them; None: they are looked at only.
    """

    def __init__(self, allowed: Sequence[Path], work: Path | None = None) -> None:
        self.read: list[Path] = []  # each once, in the order in which they are named
        self.left_out: list[str] = []  # of what they hold, each kind once
        self._allowed, self._work = allowed, work
        self._names: dict[Path, Path] = {}
        self._above: list[Path] = []  # those that lead to the one that is looked at

    def named(self, file: Path, named_in: object) -> Path:
        """Return the name by which SUMO is given a file.

        Parameters
        ----------
        named_in
            What names it, for messages.

        Raises
        ------
        InputError
            If it does not lie where it may, is no sound XML, or names what it may not.
        """
        refuse_outside(file, named_in, self._allowed)
        place = file.resolve()
        if place in self._above or len(self._above) > DEEPEST:
            raise InputError(f"{named_in}: leads to {file} again; take that out")
        if place not in self._names:
            self.read.append(file)
            # SUMO parts names at commas and puts variables of the environment into them.
            name = f"{len(self.read)}-{re.sub(r'[^A-Za-z0-9._-]', '_', place.name[-LONGEST:])}"
            self._names[place] = (self._work or Path()) / name
            with self._looked_at(place):
                self._give(file, self._names[place])
        return self._names[place]

    @contextmanager
    def _looked_at(self, place: Path) -> Iterator[None]:
        self._above.append(place)
        yield
        self._above.pop()

    def _give(self, file: Path, name: Path) -> None:
        """Make a name stand for a file as SUMO may have it: a link to it, or to a copy."""
        if not holds(file, SUSPECTS):
            if self._work is not None:
                name.symlink_to(file.resolve())
            return
        with (Path(os.devnull) if self._work is None else name).open("wb") as copy:
            rewritten_xml(file, copy, _Rules(self, file))


class _Rules:
    """What becomes of the elements of one file."""

    def __init__(self, files: InputFiles, file: Path) -> None:
        self._files, self._file = files, file
        self._in_root = False

    def __call__(self, name: str, said: dict[str, str]) -> dict[str, str] | None:
        """Return an element's attributes as SUMO may have them; None: it may not have it."""
        if not self._in_root:  # which may be called anything
            self._in_root = True
            return said
        if not ELEMENT.fullmatch(name):
            return self._without(name)
        if name == "param" and WRITES.search(said.get("key", "")):
            return self._without(said["key"])
        changed = {key: value for key, value in said.items() if key not in PICTURES}
        for key in {"href", "file", "output"} & said.keys():
            reads = key == "href" or (key == "file" and name in READERS)
            changed[key] = self._input(said[key]) if reads else self._nowhere(name, said[key])
        return changed

    def _without(self, what: str) -> dict[str, str] | None:
        if what not in self._files.left_out:
            self._files.left_out.append(what)
        return None

    def _input(self, name: str) -> str:
        return str(self._files.named(self._file.parent / name, self._file))

    def _nowhere(self, element: str, name: str) -> str:
        refuse_socket(name, f"{self._file}: {element}")
        return NOWHERE


def refuse_socket(name: str, named_in: str) -> None:
    """Raise InputError if SUMO would connect to a host when it is to write a file."""
    if name.find(":") > 1:  # not a drive
        raise InputError(f"{named_in} writes to {name}, over the network; take that out")


def refuse_outside(file: Path, named_in: object, allowed: Sequence[Path]) -> None:
    """Raise InputError unless a file lies, links followed, below one of some folders."""
    if "\0" in str(file):
        raise InputError(f"{named_in}: no file's name holds a NUL; correct the path")
    place = file.resolve()
    if not any(place.is_relative_to(folder.resolve()) for folder in allowed):
        raise InputError(
            f"{named_in}: {file} does not lie below {allowed[0]}; copy it there, or "
            f"--allow {place.parent}"
        )
