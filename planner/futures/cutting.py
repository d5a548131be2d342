"""Recordings in towns, cut from larger ones of the same belief: fewer particles, a shorter time.

A cut recording is the same, byte for byte, as one that is made anew: particles do not depend on how
many there are or on the horizon, their motion up to a time not on what comes after it, and neither
do their knots up to a multiple of `KNOT_EVERY_S`. What cannot be cut exactly is recorded anew. For
the same reason a recording may begin with the particles of a smaller one.
"""

import logging
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, TypeGuard

import numpy as np

from planner.belief.mixture import parts_of
from planner.belief.particles import Particles
from planner.belief.prior import Prior, in_town
from planner.belief.recipe import Drawn, Recipe
from planner.cache import is_whole
from planner.errors import InputError
from planner.futures.answers import KNOT_EVERY_S
from planner.futures.futures import Futures
from planner.futures.truncate import recorded_until
from planner.messages import as_written
from planner.network.road_network import RoadNetwork

log = logging.getLogger(__name__)

STOPS_MPS = 150.0  # who can stop on the way by which routes go on beyond the horizon


class Sibling(NamedTuple):
    """A recording in the cache that differs from another one in its size only."""

    folder: Path
    particles: int
    horizon_s: float

    def __str__(self) -> str:
        return f"{self.particles:,} particles up to {as_written(self.horizon_s)} s"


def may_be_cut(recipe: Recipe, network: RoadNetwork) -> TypeGuard[Drawn]:
    """Return whether a recording, or one with more particles or a later horizon, can be cut."""
    if not isinstance(recipe, Drawn) or recipe.sampling == "all":
        return False
    # In traffic particles meet: whom each meets depends on how many there are.
    return recipe.prior.driving != "traffic" and in_town(recipe.prior, network)


def sized_name(family: str, recipe: Drawn, key: str) -> str:
    """Return the name of a recording's folder, from which its siblings know it."""
    return f"{family}-{recipe.count}-{float(recipe.horizon_s)!r}-{key}"


def siblings_of(folder: Path) -> list[Sibling]:
    """Return the recordings beside one that differ from it in size only, the smallest first."""
    family = folder.name.split("-")[0]
    found = []
    for other in folder.parent.glob(f"{family}-*-*-*"):
        _, count, horizon_s, _ = other.name.split("-", 3)
        if other.name != folder.name and count.isdecimal() and _is_number(horizon_s):
            found.append(Sibling(other, int(count), float(horizon_s)))
    return sorted(found, key=lambda one: (one.particles * one.horizon_s, one.folder.name))


def _is_number(text: str) -> bool:
    return text.replace(".", "", 1).isdecimal()


def cut_from_sibling(
    folder: Path, recipe: Drawn, particles: Particles, read: Callable[[Path], Futures]
) -> Futures | None:
    """Return the futures of a recording that is to be, cut from one that is there.

    What is done, and why, is said in the log.

    Parameters
    ----------
    folder
        Where the recording will be; `sized_name` is its name.
    particles
        Those of the recipe.
    read
        Returns the futures that are in a folder.

    Returns
    -------
    Futures or None
        None where none is there that can be cut.
    """
    why = ""
    for sibling in siblings_of(folder):
        why = _obstacle(sibling, recipe)
        if not why:
            futures = _cut(sibling, recipe, particles, read)
            if futures is not None:
                log.info("cut from a recording of %s", sibling)
                return futures
            why = "is damaged"
        why = f"the one of {sibling} {why}"
    if why:
        log.info("recorded anew, as none that is there can be cut: %s", why)
    return None


def begun_by_sibling(
    folder: Path, recipe: Drawn, read: Callable[[Path], Futures]
) -> Futures | None:
    """Return the first particles of a recording that is to be, from the largest that has only them.

    Parameters
    ----------
    folder, read
        As `cut_from_sibling` takes them.
    """
    smaller = (one for one in siblings_of(folder) if one.horizon_s == recipe.horizon_s)
    for sibling in reversed([one for one in smaller if one.particles < recipe.count]):
        found = _whole(sibling, read)
        if found is not None:
            log.info("begins with a recording of %s", sibling)
            return found
    return None


def _obstacle(sibling: Sibling, recipe: Drawn) -> str:
    """Return why a recording cannot be cut to what a recipe makes; empty where it can."""
    if sibling.particles < recipe.count:
        return "has fewer particles"
    if sibling.horizon_s == recipe.horizon_s:
        return ""
    if sibling.horizon_s < recipe.horizon_s:
        return "ends earlier"
    if recipe.horizon_s % KNOT_EVERY_S != 0.0:
        return f"can be cut at multiples of {as_written(KNOT_EVERY_S)} s only"
    parts = parts_of(recipe.prior)
    if max(_fastest_mps(part) for part in parts) > STOPS_MPS:
        return f"has targets above {as_written(STOPS_MPS)} m/s, whose drivers look too far ahead"
    if any(
        part.speed_per_road for part in parts
    ):  # the fastest on the whole route is SUMO's limit at the start
        return "has speeds by road, whose drivers depend on the horizon"
    return ""


def _fastest_mps(prior: Prior) -> float:
    return prior.speed_mps.high * (prior.flees.factor if prior.flees else 1.0)


def _cut(
    sibling: Sibling, recipe: Drawn, particles: Particles, read: Callable[[Path], Futures]
) -> Futures | None:
    """Return the part of a recording that a recipe makes; None if it is damaged."""
    whole = _whole(sibling, read)
    if whole is None:
        return None
    part = whole.take(np.arange(recipe.count))
    if recipe.horizon_s < sibling.horizon_s:
        part = recorded_until(part, recipe.horizon_s)
        ends_s = np.minimum(whole.end_s[: recipe.count], recipe.horizon_s)
        if not np.array_equal(part.end_s, ends_s):
            return None
    return replace(
        part,
        weight=particles.weight,
        gone=particles.gone_after(part.end_s),
        target=particles.target,
    )


def _whole(sibling: Sibling, read: Callable[[Path], Futures]) -> Futures | None:
    """Return the futures of a recording; None if it is damaged."""
    if not is_whole(sibling.folder):
        return None
    try:
        found = read(sibling.folder)
    except (InputError, OSError):  # another command may have removed it meanwhile
        return None
    return found if len(found) == sibling.particles else None
