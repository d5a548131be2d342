"""Files that are whole or not there: atomic writes, and the folder of the cache."""

import json
import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from planner.errors import OutputError
from planner.interrupts import undone_if_stopped
from planner.locks import (
    is_at,
    locked,
    sole_writer,
    swept,
    temporary_file,
    temporary_folder,
)

RECORD = "run.json"  # of a run's making; without it no folder is taken for a run


@contextmanager
def written_whole(path: Path, *, replace: bool = True) -> Iterator[Path]:
    """Give a temporary name beside ``path`` that becomes ``path`` when the block ends well.

    Parameters
    ----------
    replace
        False: what another command has written there meanwhile is not replaced.

    Raises
    ------
    OutputError
        If the folder cannot be written, the disk is full, ``path`` is a folder or a device,
        or is there and may not be replaced.
    """
    with _output_errors(path):
        _refuse_device(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        swept(path.parent)
        with temporary_file(path.parent, path.name) as temporary:
            yield temporary
            temporary.chmod(0o666 & ~_umask())
            _flush(temporary)
            if replace:
                temporary.replace(path)
            else:
                _move_new(temporary, path)


@contextmanager
def alone_at(path: Path) -> Iterator[None]:
    """Keep other commands from writing a file, as `alone_in` does for a folder.

    Raises
    ------
    OutputError
        If another command is about to write it, or its folder cannot be written.
    """
    with _output_errors(path):
        _refuse_device(path)
        with _made(path.parent), sole_writer(path) as is_alone:
            if not is_alone:
                raise OutputError(
                    f"{path}: another command is writing it; wait for its end, or name another file"
                )
            yield


def _refuse_device(path: Path) -> None:
    if path.exists() and not path.is_file():
        raise OutputError(f"{path}: is not a file that can be replaced; choose another name")


def _move_new(temporary: Path, path: Path) -> None:
    """Move a file to where there is none."""
    try:
        path.hardlink_to(temporary)
    except FileExistsError as error:
        raise OutputError(
            f"{path}: another command has written it; name another file, or --force to replace it"
        ) from error
    except OSError:  # a file system without links
        temporary.replace(path)


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write plain data as JSON, whole or not at all; numbers in it have to be finite."""
    with written_whole(path) as new:
        new.write_text(json_text(content), encoding="utf-8")


def json_text(content: Mapping[str, Any]) -> str:
    """Return plain data as `write_json` writes it."""
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


@contextmanager
def results_written_whole(
    folder: Path, names: Collection[str] = (), *, force: bool
) -> Iterator[Path]:
    """Give an empty folder whose files move into ``folder`` together when the block ends well.

    Parameters
    ----------
    names
        Of the files that a run of this kind leaves; others in the folder are left alone.
    force
        True: files of an earlier run are replaced, and those not written anew removed.

    Raises
    ------
    OutputError
        If the folder holds another run, cannot be written, or the disk is full. The first two
        are raised before the block begins; after it, if another command has written there since.
    """
    with _output_errors(folder):
        earlier = {name for name in names if (folder / name).exists()}
        if earlier and not force:
            raise OutputError(
                f"{folder}: holds {min(earlier)} already; --force overwrites it, "
                "or choose another folder"
            )
        swept(folder)
        with _made(folder), temporary_folder(folder) as new:
            yield new
            meanwhile = {name for name in names if (folder / name).exists()} - earlier
            if meanwhile and not force:
                raise OutputError(
                    f"{folder}: another command has written {min(meanwhile)} there; "
                    "choose another folder"
                )
            _move_all(new, folder, earlier)


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Keep other commands from writing into a folder, which is made if there is none.

    Raises
    ------
    OutputError
        If another command writes there, or the folder cannot be made.
    """
    while True:
        with _output_errors(folder), ExitStack() as stack:
            missing = _missing(folder)
            folder.mkdir(parents=True, exist_ok=True)
            descriptor = stack.enter_context(_opened(folder))
            if descriptor is not None and locked(descriptor) is False:
                raise OutputError(
                    f"{folder}: another command is writing there; wait for its end, or choose "
                    "another folder"
                )
            if descriptor is None or is_at(folder, descriptor):
                stack.enter_context(_removed_if_empty(missing))
                yield
                return
            # The other command has removed its folder meanwhile.


@contextmanager
def _opened(folder: Path) -> Iterator[int | None]:
    """Give a folder's descriptor, None where the system opens no folders."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except PermissionError:
        yield None
        return
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def _move_all(new: Path, folder: Path, earlier: set[str]) -> None:
    """Move all files of a folder into another one, and remove what an earlier run left there.

    The record goes first and comes last: a folder with a record holds all that it tells of.
    """
    files = sorted(new.iterdir(), key=lambda file: (file.name == RECORD, file.name))
    for file in files:
        _flush(file)
    if RECORD in earlier and any(file.name == RECORD for file in files):
        (folder / RECORD).unlink()
    for file in files:
        file.replace(folder / file.name)
    for name in earlier - {file.name for file in files}:
        (folder / name).unlink()


def _flush(path: Path) -> None:
    """Have the system write a file to disk, so that its name never outlives its content."""
    with path.open("rb") as file:
        os.fsync(file.fileno())


@contextmanager
def _made(folder: Path) -> Iterator[None]:
    """Make a folder, which goes again if it is still empty when the block fails."""
    missing = _missing(folder)
    folder.mkdir(parents=True, exist_ok=True)
    with _removed_if_empty(missing):
        yield


def _missing(folder: Path) -> list[Path]:
    """Return what has to be made for a folder, itself first."""
    return [path for path in (folder, *folder.parents) if not path.exists()]


@contextmanager
def _removed_if_empty(made: Sequence[Path]) -> Iterator[None]:
    """Remove folders that are still empty when the block fails."""

    def undo() -> None:
        with suppress(OSError):
            for path in made:
                path.rmdir()

    with undone_if_stopped(undo):
        try:
            yield
        except BaseException:
            undo()
            raise


@contextmanager
def _output_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        ours = path.is_relative_to(cache_root())
        remedy = "set PLANNER_CACHE to another folder" if ours else "choose another folder"
        raise OutputError(
            f"{path}: cannot be written ({error.strerror or error}); {remedy} or make room"
        ) from error


def cache_root() -> Path:
    """Return the folder of the cache: ``$PLANNER_CACHE``, or the user's own cache folder."""
    chosen = os.environ.get("PLANNER_CACHE")
    if chosen:
        return Path(chosen).expanduser()
    from platformdirs import user_cache_path

    return user_cache_path("planner", appauthor=False)


def shipped(name: str) -> Path | None:
    """Return the folder of a scenario that comes with the package, None if there is no such."""
    return _shipped().get(name)


def shipped_names() -> tuple[str, ...]:
    """Return the names of the scenarios that come with the package, sorted."""
    return tuple(sorted(_shipped()))


def kit(name: str) -> Path:
    """Return a file, or a folder, that goes into an export of the instances as it is."""
    package = Path(__file__).resolve().parent
    roots = (package / "kit", package.parent / "tools", package.parent / "docs")
    files = (root / part / name for root in roots for part in ("", "instances"))
    return next(file for file in files if file.exists())


def _shipped() -> dict[str, Path]:
    # Inside the package when installed, beside it in a checkout.
    package = Path(__file__).resolve().parent
    for nets in (package / "sumo_nets", package.parent / "sumo_nets"):
        if nets.is_dir():
            return {file.parent.name: file.parent for file in nets.glob("*/scenario.toml")}
    return {}


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
