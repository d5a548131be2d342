"""The only door to the SUMO installation: its folders, its programs, its network reader."""

import importlib.metadata
import importlib.util
import logging
import os
import re
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from planner.errors import InputError, SumoError, is_short_of_memory
from planner.interrupts import undone_if_stopped
from planner.locks import temporary_folder
from planner.messages import as_written
from planner.xml_guard import elements_in

log = logging.getLogger(__name__)

CAR = "passenger"
WHOLE = "give a .net.xml that netconvert or netedit wrote, or an OpenStreetMap file, whole"
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


def sumo_file(name: str) -> Path:
    """Return a file that comes with SUMO, by its path below SUMO's folder.

    Raises
    ------
    InputError
        If there is none, or it lies elsewhere.
    SumoError
        If SUMO is missing.
    """
    path = sumo_home() / name
    if ".." in Path(name).parts or not path.resolve().is_relative_to(sumo_home().resolve()):
        raise InputError(f"{name}: is not below SUMO's folder, {sumo_home()}; correct the path")
    if not path.is_file():
        raise InputError(
            f"SUMO {sumo_version()} holds no file {name} here (below {sumo_home()}); correct the "
            "path, or install eclipse-sumo again if it should be there"
        )
    return path


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


INCLUDE = re.compile(rb"<include[\s/>]")


@contextmanager
def plain_names(files: Sequence[Path], folder: Path) -> Iterator[dict[Path, Path]]:
    """Give for each file a link that SUMO's programs can open, whatever its own path is.

    They part paths at commas and put variables of the environment into them. What a file includes
    is linked too; nothing else than that is read.

    Parameters
    ----------
    folder
        The scenario's; what a file includes has to lie below it, or beside the file.

    Raises
    ------
    InputError
        If a file is not what `planner.guard` lets in, or includes one from elsewhere.
    """
    with temporary_folder() as temporary:
        links: dict[Path, Path] = {}
        for number, file in enumerate(dict.fromkeys(files)):
            root = folder if file.resolve().is_relative_to(folder.resolve()) else file.parent
            place = Path(temporary, str(number))
            # As deep as the file lies below its root, so that what it includes from above fits.
            depth = len(file.parent.resolve().parts) - len(root.resolve().parts)
            suffix = "".join(s for s in file.suffixes[-2:] if re.fullmatch(r"\.\w+", s, re.A))
            links[file] = place.joinpath(*["d"] * max(depth, 0), f"file{suffix}")
            _link(file, links[file])
            for included, link in included_files(file, root, links[file]).items():
                if not link.is_relative_to(place):
                    raise InputError(f"{file}: includes {included} from elsewhere; copy it there")
                _link(included, link)
        yield links


def _link(file: Path, link: Path) -> None:
    link.parent.mkdir(parents=True, exist_ok=True)
    if not link.exists():
        link.symlink_to(file.resolve())


def included_files(file: Path, root: Path, link: Path) -> dict[Path, Path]:
    """Return what an XML file includes, and they in turn, with the links that SUMO would open.

    Raises
    ------
    InputError
        If one lies elsewhere than below ``root``, or is not what `planner.guard` lets in.
    """
    found: dict[Path, Path] = {}
    waiting = [(file, link)]
    while waiting:
        file, link = waiting.pop()
        for _, said in elements_in(file, INCLUDE):
            href = said.get("href", "")
            included = (file.parent / href).resolve()
            if Path(href).is_absolute() or not included.is_relative_to(root.resolve()):
                raise InputError(
                    f"{file}: includes {href}, which is not below {root}; copy it there"
                )
            if included not in found:
                found[included] = Path(os.path.normpath(link.parent / href))
                waiting.append((included, found[included]))
    return found


def ended(words: Sequence[str], folder: Path | None = None) -> tuple[int, str]:
    """Run one of SUMO's programs in a folder; return its exit code, and what it says on stderr.

    Raises
    ------
    SumoError
        If it cannot be run.
    """
    sumo_environment()
    try:
        running = subprocess.Popen(
            words,
            cwd=folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            errors="replace",
        )
        with undone_if_stopped(running.kill):
            said = running.communicate()[1]
    except OSError as error:
        program = Path(words[0]).name
        raise SumoError(f"{program} cannot be run: {error.strerror or error}") from error
    return running.returncode, said


def netconvert(
    options: Sequence[str], *, subject: str, links: Mapping[Path, Path] | None = None
) -> None:
    """Run netconvert on a user's sources.

    Parameters
    ----------
    subject
        The source's name, for the message.
    links
        By the user's files, the names by which netconvert is given them.

    Raises
    ------
    InputError
        If netconvert refuses the sources; the text is its own message.
    SumoError
        If netconvert cannot be run or dies.
    MemoryError
        If there is no room to run it.
    """
    code, said = ended([str(binary("netconvert")), *options])
    for file, link in (links or {}).items():
        said = said.replace(str(link), str(file))
    if code < 0:
        raise SumoError(f"netconvert died of signal {-code} on {subject}")
    if code > 0 and is_short_of_memory(said):
        raise MemoryError(_reason(said))
    if code > 0:
        raise InputError(f"{subject}: netconvert refuses it: {_reason(said)}")
    if said.strip():
        log.debug("netconvert on %s: %s", subject, said.strip())


def parse_net(path: Path, source: Path | None = None) -> Any:
    """Return sumolib's object for a ``.net.xml``, without the insides of junctions.

    Parameters
    ----------
    source
        The file that the user gave, if another one, for messages.

    Raises
    ------
    InputError
        If the file is not XML or not a SUMO net.
    """
    try:
        refuse_foreign_elements(path)
        refuse_named_outputs(path)
    except InputError as error:
        reason = str(error).removeprefix(f"{path}: ").partition("; ")[0]
        raise InputError(
            f"{source or path}: not a readable SUMO network ({reason}); {WHOLE}"
        ) from error
    sumo_environment()
    from xml.sax import SAXException

    import sumolib

    try:
        net = sumolib.net.readNet(str(path), lxml=False)
    except (SAXException, OSError, EOFError, *STUMBLES) as error:
        missing = isinstance(error, KeyError)
        reason = f"it lacks {error}" if missing else " ".join(str(error).split())
        raise InputError(
            f"{source or path}: not a readable SUMO network ({reason}); {WHOLE}"
        ) from error
    lost = [node.getID() for node in net.getNodes() if node.getType() is None]
    if lost:
        raise InputError(
            f"{source or path}: edges lead to {lost[0]!r}, which is no junction of the network"
        )
    return net


# The elements of SUMO's schema of nets. SUMO would heed others as well, some of which name files
# that it then reads or writes.
NET_ELEMENTS = (
    "net|location|type|restriction|param|edge|lane|neigh|stopOffset|junction|request|connection|"
    "prohibition|roundabout|tlLogic|phase|condition|assignment|function|conflict|taz|district|"
    "dsource|dsink|tazSource|tazSink|railSignalConstraints|predecessor|insertionPredecessor|"
    "foeInsertion|insertionOrder|bidiPredecessor|railSignalConditions|delay|expression"
)
HARMLESS = ("routes", "additional")  # by themselves: what they hold is looked at
FOREIGN = re.compile(rb"<(?!(?:" + NET_ELEMENTS.encode() + rb")[\s/>]|[/?!]|$)")


def refuse_foreign_elements(path: Path) -> None:
    """Raise InputError where a net holds more than nets consist of."""
    foreign = [name for name, _ in elements_in(path, FOREIGN) if name not in HARMLESS]
    if foreign:
        raise InputError(
            f"{path}: it holds <{foreign[0]}>, which is no part of a net and may name other files; "
            "take it out"
        )


PARAMETER = re.compile(rb"<param[\s/>]")


def refuse_named_outputs(path: Path) -> None:
    """Raise InputError where the signals of a net write files elsewhere than beside it.

    Their detectors write where a parameter of theirs says.
    """
    for _, said in elements_in(path, PARAMETER):
        key, value = said.get("key", ""), said.get("value", "")
        leaves = key == "file" and not re.fullmatch(r"\w[\w.-]*", value)
        if leaves or (key == "whetherOutputState" and value.lower() not in ("", "0", "false")):
            raise InputError(
                f"{path}: it holds <param key={as_written(key)}>, by which signals write files; "
                "take that out"
            )


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
