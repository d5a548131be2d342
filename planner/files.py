"""Files that are whole or not there: atomic writes, and the folder of things made once."""

import os
import shutil
import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from planner.errors import OutputError


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Give a temporary name beside ``path`` that becomes ``path`` when the block ends well.

    Raises
    ------
    OutputError
        If the folder cannot be written or the disk is full.
    """
    temporary: str | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=path.name)
        os.close(handle)
        yield Path(temporary)
        Path(temporary).chmod(0o666 & ~_umask())
        Path(temporary).replace(path)
    except OSError as error:
        raise OutputError(
            f"{path}: cannot be written ({error.strerror or error}); choose another folder "
            "or make room"
        ) from error
    finally:
        if temporary is not None:
            Path(temporary).unlink(missing_ok=True)


@contextmanager
def folder_written_whole(path: Path) -> Iterator[Path]:
    """Give a temporary folder that takes the place of ``path`` when the block ends well.

    A folder already at ``path`` is replaced; two processes making the same one do no harm, the
    first one's stays.

    Raises
    ------
    OutputError
        If the folder cannot be written or the disk is full.
    """
    temporary: str | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = tempfile.mkdtemp(dir=path.parent, prefix=".")
        Path(temporary).chmod(0o777 & ~_umask())
        yield Path(temporary)
        if path.exists():
            shutil.rmtree(path)
        try:
            Path(temporary).rename(path)
        except OSError:
            if not path.is_dir():
                raise
    except OSError as error:
        raise OutputError(
            f"{path}: cannot be written ({error.strerror or error}); choose another folder "
            "or make room"
        ) from error
    finally:
        if temporary is not None:
            shutil.rmtree(temporary, ignore_errors=True)


@contextmanager
def results_written_whole(folder: Path, names: Collection[str], *, force: bool) -> Iterator[Path]:
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
        are told before the block begins.
    """
    earlier = [name for name in sorted(names) if (folder / name).exists()]
    if earlier and not force:
        raise OutputError(
            f"{folder}: holds another run ({earlier[0]}); choose another folder, "
            "or --force to overwrite it"
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".") as temporary:
            yield Path(temporary)
            for name in earlier:
                (folder / name).unlink()
            for file in sorted(Path(temporary).iterdir()):
                file.replace(folder / file.name)
    except OSError as error:
        raise OutputError(
            f"{folder}: cannot be written ({error.strerror or error}); choose another folder "
            "or make room"
        ) from error


def cache_folder(*parts: str) -> Path:
    """Return a folder of the cache: ``$PLANNER_CACHE``, or the user's own cache folder."""
    chosen = os.environ.get("PLANNER_CACHE")
    if chosen:
        return Path(chosen).expanduser().joinpath(*parts)
    from platformdirs import user_cache_path

    return user_cache_path("planner", appauthor=False).joinpath(*parts)


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
