"""Futures on disk: ``futures.parquet``, ``particles.parquet`` beside it, and the cache of both."""

import hashlib
import json
import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from planner.arrays import Ints
from planner.belief.particles import Particles
from planner.belief.recipe import Recipe
from planner.errors import InputError
from planner.files import cache_folder, results_written_whole
from planner.futures.fcd import read_samples
from planner.futures.futures import NO_EDGE, Futures
from planner.futures.knots import futures_of_samples
from planner.futures.record import record
from planner.network.road_network import RoadNetwork
from planner.network.sumo import sumo_version
from planner.parquet import column, dictionary, indices, numbers, read_table, write_table
from planner.progress import Progress
from planner.provenance import version_of

log = logging.getLogger(__name__)

SCHEMA = "planner.futures/1"
UNITS = "time in s on the target's clock, x (east) and y (north) in m of the SUMO net"
KNOTS, PARTICLES = "futures.parquet", "particles.parquet"
TOTAL = 1e-9  # by how much weights may exceed one in all
MOST_TARGETS = 2**31 - 1
PACKAGE = Path(__file__).parents[1]
MADE_BY = ("network", "belief", "futures")  # stages whose code decides what is in a recording
DRAWN_WITH = ("numpy", "scipy")  # random numbers and quantiles are theirs


@dataclass(frozen=True, eq=False)
class Recording:
    """Futures with what is known of each particle, and the file that holds them."""

    path: Path
    futures: Futures
    speed_mps: tuple[float, ...]  # (N,) on the first road; NaN where unknown
    route: tuple[str, ...]  # (N,) edge names with a space between; empty where unknown


def recorded(
    network: RoadNetwork,
    recipe: Recipe,
    *,
    scenario: Mapping[str, Any],
    workers: int | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Return the futures of particles from the cache; they are drawn and driven once only.

    Parameters
    ----------
    scenario
        What the particles are drawn from, in the scenario's words; written into the files.
    workers, progress
        As ``record`` takes them.
    """
    described = describe(network, scenario)
    folder = cache_folder("futures") / _key(recipe, described)
    if (folder / PARTICLES).is_file():
        try:
            return read_recording(folder / KNOTS, network)
        except InputError as error:
            log.info("the cache was damaged (%s)", error)
    particles = recipe.particles(network)
    futures = record(
        network, particles, horizon_s=recipe.horizon_s, workers=workers, progress=progress
    )
    with results_written_whole(folder, force=True) as new:
        write_recording(new, futures, particles, network, described)
    return read_recording(folder / KNOTS, network)


def describe(network: RoadNetwork, scenario: Mapping[str, Any]) -> dict[str, str]:
    """Return the key-value metadata of a recording's files."""
    return {
        "schema": SCHEMA,
        "units": UNITS,
        "sumo_version": sumo_version(),
        "net_sha256": network.sha256,
        "scenario": json.dumps(scenario, sort_keys=True),
    }


def _key(recipe: Recipe, described: Mapping[str, str]) -> str:
    """Return the name of a recording: a digest of everything that decides its content."""
    digest = hashlib.sha256(repr((sorted(described.items()), made_by(PACKAGE))).encode())
    for part in _parts(recipe):
        digest.update(part)
    return digest.hexdigest()[:32]


@cache
def made_by(package: Path) -> tuple[str, ...]:
    """Return what identifies the program that draws and records: its source and its libraries."""
    folders = [sorted((package / name).glob("*.py")) for name in MADE_BY]
    sources = [*(file for files in folders for file in files), package / "streams.py"]
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


def write_recording(
    folder: Path,
    futures: Futures,
    particles: Particles,
    network: RoadNetwork,
    described: Mapping[str, str],
) -> None:
    """Write ``futures.parquet`` and ``particles.parquet`` into a folder."""
    count = np.arange(len(futures), dtype=np.int32)
    knots = {
        "particle": np.repeat(count, np.diff(futures.first_knot)),
        "time_s": futures.time_s,
        "x_m": futures.x_m,
        "y_m": futures.y_m,
        "edge": dictionary(futures.edge, list(network.edge_ids), missing=NO_EDGE),
    }
    table = {
        "particle": count,
        "weight": particles.weight,
        "target": particles.target,
        "at_end": ["gone" if gone else "stays" for gone in particles.gone],
        "depart_s": particles.depart_s,
        "speed_mps": particles.speed_mps[particles.first_edge[:-1]],
        "route": [
            " ".join(network.edge_ids[edge] for edge in particles.route(k)) for k in count.tolist()
        ],
        "seed": particles.seed,
    }
    write_table(folder / KNOTS, knots, described)
    write_table(folder / PARTICLES, table, described)


def read_recording(path: Path, network: RoadNetwork) -> Recording:
    """Return the futures of a file: ``futures.parquet``, or SUMO's FCD as XML or Parquet.

    ``particles.parquet`` beside a ``futures.parquet`` holds weights, targets and ends; without it
    weights are equal, there is one target, and all particles stay where they end. In FCD each
    vehicle is a particle.

    Raises
    ------
    InputError
        If the file is missing, empty, broken, or does not belong to the network.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; `planner futures SCENARIO -o DIR` writes one")
    table = read_table(path) if path.suffix == ".parquet" else None
    if table is None or "timestep_time" in table.column_names:
        futures = futures_of_samples(read_samples(path, network), network)
        unknown = len(futures)
        return Recording(path, futures, (np.nan,) * unknown, ("",) * unknown)
    beside = path.with_name(PARTICLES)
    if not beside.is_file():
        futures = _futures(path, table, network, None)
        return Recording(path, futures, (np.nan,) * len(futures), ("",) * len(futures))
    particles = read_table(beside)
    futures = _with_particles(beside, _futures(path, table, network, len(particles)), particles)
    speed, route = (column(beside, particles, name) for name in ("speed_mps", "route"))
    return Recording(path, futures, tuple(speed.to_pylist()), tuple(route.to_pylist()))


def _futures(path: Path, table: Any, network: RoadNetwork, count: int | None) -> Futures:
    if table.num_rows == 0:
        raise InputError(f"{path}: holds no row; record at least one particle")
    recorded_on = (table.schema.metadata or {}).get(b"net_sha256", network.sha256.encode())
    if recorded_on.decode() != network.sha256:
        raise InputError(
            f"{path}: was recorded on another network than {network.path}; record it again"
        )
    particle = numbers(path, table, "particle").astype(np.int64)
    time_s, x_m, y_m = (numbers(path, table, name) for name in ("time_s", "x_m", "y_m"))
    step = np.diff(particle)
    if particle[0] < 0 or (step < 0).any() or (np.diff(time_s)[step == 0] <= 0).any():
        raise InputError(f"{path}: rows must be sorted by particle (from 0), then rising time_s")
    total = count if count is not None else int(particle[-1]) + 1
    if particle[-1] >= total:
        raise InputError(f"{path}: particle {particle[-1]} has no row in {PARTICLES}")
    knots = np.bincount(particle, minlength=total)
    return Futures(
        time_s=time_s,
        x_m=x_m,
        y_m=y_m,
        edge=_edges(path, table, network),
        first_knot=np.concatenate(([0], np.cumsum(knots))),
        weight=np.full(total, 1.0 / total),
        gone=np.zeros(total, dtype=bool),
    )


def _edges(path: Path, table: Any, network: RoadNetwork) -> Any:
    if "edge" not in table.column_names:
        return np.full(len(table), NO_EDGE)
    encoded = table["edge"].combine_chunks().dictionary_encode()
    names = encoded.dictionary.to_pylist()
    used = indices(encoded)
    unknown = [names[i] for i in np.unique(used[used >= 0]) if names[i] not in network.edge_index]
    if unknown:
        raise InputError(
            f"{path}: edge {unknown[0]!r} is not in {network.path.name}; "
            "give the scenario whose net the file was recorded on"
        )
    of_name = np.array([network.edge_index.get(name, NO_EDGE) for name in names] + [NO_EDGE])
    return of_name[used]


def _with_particles(path: Path, futures: Futures, particles: Any) -> Futures:
    weight = numbers(path, particles, "weight")
    if (weight < 0).any() or weight.sum() > 1 + TOTAL:
        raise InputError(
            f"{path}: weights must not be negative nor exceed 1 in all, "
            f"they sum to {weight.sum():g}"
        )
    at_end = np.array(column(path, particles, "at_end").to_pylist())
    if not np.isin(at_end, ("stays", "gone")).all():
        raise InputError(f"{path}: column 'at_end' must hold 'stays' or 'gone'")
    return replace(futures, weight=weight, gone=at_end == "gone", target=_targets(path, particles))


def _targets(path: Path, particles: Any) -> Ints:
    if "target" not in particles.column_names:
        return np.zeros(len(particles), dtype=np.int32)
    target = numbers(path, particles, "target")
    if (target % 1 > 0).any() or target.min() < 0 or target.max() > MOST_TARGETS:
        raise InputError(f"{path}: column 'target' must hold whole numbers from 0 on")
    return target.astype(np.int32)
