"""Files that are whole or not there: atomic writes, and the folder of the cache."""

import json
import os
import shutil
import tempfile
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

from planner.errors import OutputError
from planner.interrupts import undone_if_stopped

RECORD = "run.json"  # of a run's making; without it no folder is taken for a run


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Give a temporary name beside ``path`` that becomes ``path`` when the block ends well.

    Raises
    ------
    OutputError
        If the folder cannot be written, the disk is full, or ``path`` is a folder or a device.
    """
    with _output_errors(path):
        if path.exists() and not path.is_file():
            raise OutputError(f"{path}: is not a file that can be replaced; choose another name")
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=path.name)
        os.close(handle)
        temporary = Path(name)
        with undone_if_stopped(temporary.unlink):
            try:
                yield temporary
                temporary.chmod(0o666 & ~_umask())
                _flush(temporary)
                temporary.replace(path)
            finally:
                temporary.unlink(missing_ok=True)


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
                f"{folder}: holds {min(earlier)} already; choose another folder, "
                "or --force to overwrite it"
            )
        with _made(folder), tempfile.TemporaryDirectory(dir=folder, prefix=".") as temporary:
            new = Path(temporary)
            with undone_if_stopped(partial(shutil.rmtree, new)):
                yield new
                meanwhile = {name for name in names if (folder / name).exists()} - earlier
                if meanwhile and not force:
                    raise OutputError(
                        f"{folder}: another command has written {min(meanwhile)} there; "
                        "choose another folder"
                    )
                _move_all(new, folder, earlier)


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
    missing = [path for path in (folder, *folder.parents) if not path.exists()]

    def undo() -> None:
        with suppress(OSError):
            for path in missing:
                path.rmdir()

    folder.mkdir(parents=True, exist_ok=True)
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
