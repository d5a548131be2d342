"""A SUMO configuration, read and not obeyed: which of its options are taken, and which dropped."""

from dataclasses import dataclass
from pathlib import Path

from planner.guard import xml_elements

LARGEST = 16 << 20  # bytes
TAKEN = ("begin", "step-length", "lateral-resolution", "time-to-teleport", "scale")


@dataclass(frozen=True)
class Config:
    """What is taken of a configuration."""

    options: tuple[tuple[str, str], ...]
    routes: tuple[Path, ...]
    additional: tuple[Path, ...]
    dropped: tuple[str, ...]


def read_config(path: Path) -> Config:
    """Return what is taken of a configuration.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    said = {
        str(element.tag): element.get("value", element.get("v", ""))
        for element in xml_elements(path, LARGEST)
        if len(element) == 0
    }
    routes, additional = (
        tuple(path.parent / name.strip() for name in said.pop(key, "").split(",") if name.strip())
        for key in ("route-files", "additional-files")
    )
    options = tuple((name, said.pop(name)) for name in TAKEN if name in said)
    return Config(options, routes, additional, tuple(said))
