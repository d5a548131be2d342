"""The name of a recording in the cache: a digest of everything that decides what is in it."""

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from planner.belief.recipe import Recipe
from planner.futures.cutting import may_be_cut, sized_name
from planner.network.road_network import RoadNetwork
from planner.provenance import version_of

PACKAGE = Path(__file__).parents[1]
MADE_BY = ("network", "belief", "futures")  # stages whose code decides what is in a recording
DRAWN_WITH = ("numpy", "scipy")  # random numbers and quantiles are theirs


def recording_name(recipe: Recipe, network: RoadNetwork, described: Mapping[str, str]) -> str:
    """Return the name of a recording's folder, from its recipe and its files' metadata.

    Where recordings may be cut from larger ones it begins with what these have in common.
    """
    key = recording_key(recipe, described)
    if not may_be_cut(recipe, network):
        return key
    others = {name: text for name, text in described.items() if name != "scenario"}
    family = recording_key(replace(recipe, count=0, horizon_s=0.0), others)
    return sized_name(family[:16], recipe, key)


def recording_key(recipe: Recipe, described: Mapping[str, str]) -> str:
    """Return the name of a recording: a digest of everything that decides its content."""
    digest = hashlib.sha256(repr((sorted(described.items()), made_by(PACKAGE))).encode())
    for part in _parts(recipe):
        digest.update(part)
    return digest.hexdigest()[:32]


@cache
def made_by(package: Path) -> tuple[str, ...]:
    """Return what identifies the program that draws and records: its source and its libraries."""
    folders = [sorted((package / name).rglob("*.py")) for name in MADE_BY]
    loose = (package / name for name in ("arrays.py", "streams.py"))
    sources = [*(file for files in folders for file in files), *loose]
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in sources))
    return digest.hexdigest(), *(f"{name} {version_of(name)}" for name in DRAWN_WITH)


def _parts(value: Any) -> Iterator[bytes]:
    """Yield bytes that differ wherever two recipes do, field by field.

    Raises
    ------
    TypeError
        If a field holds anything else: two such recipes could not be distinguished.
    """
    if isinstance(value, np.ndarray):
        yield repr((value.dtype.str, value.shape)).encode()
        yield value.tobytes()
    elif is_dataclass(value):
        yield type(value).__qualname__.encode()
        for field in fields(value):
            yield field.name.encode()
            yield from _parts(getattr(value, field.name))
    elif isinstance(value, tuple | list):
        yield f"{len(value)} items".encode()
        for item in value:
            yield from _parts(item)
    elif value is None or isinstance(value, str | int | float | np.generic):
        yield repr(value).encode()
    else:
        raise TypeError(f"{value!r} has no place in a recipe")
