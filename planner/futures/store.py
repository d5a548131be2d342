"""Futures on disk: ``futures.parquet``, ``particles.parquet`` beside it, and the cache of both."""

import hashlib
import json
import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from planner.belief.particles import Particles
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

log = logging.getLogger(__name__)

SCHEMA = "planner.futures/1"
UNITS = "time in s on the target's clock, x (east) and y (north) in m of the SUMO net"
KNOTS, PARTICLES = "futures.parquet", "particles.parquet"
TOTAL = 1e-9  # by how much weights may exceed one in all


@dataclass(frozen=True, eq=False)
class Recording:
    """Futures with what is known of each particle, and the file that holds them."""

    path: Path
    futures: Futures
    speed_mps: tuple[float, ...]  # (N,) on the first road; NaN where unknown
    route: tuple[str, ...]  # (N,) edge names with a space between; empty where unknown


def recorded(
    network: RoadNetwork,
    particles: Particles,
    *,
    horizon_s: float,
    scenario: Mapping[str, Any],
    workers: int | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Return the futures of particles from the cache; SUMO drives them the first time only.

    Parameters
    ----------
    scenario
        What the particles were drawn from; written into the files.
    horizon_s, workers, progress
        As ``record`` takes them.
    """
    described = describe(network, scenario)
    folder = cache_folder("futures") / _key(particles, horizon_s, described)
    if (folder / PARTICLES).is_file():
        try:
            return read_recording(folder / KNOTS, network)
        except InputError as error:
            log.info("the cache was damaged (%s)", error)
    futures = record(network, particles, horizon_s=horizon_s, workers=workers, progress=progress)
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


def _key(particles: Particles, horizon_s: float, described: Mapping[str, str]) -> str:
    recipe = (sorted(described.items()), horizon_s, particles.driving)
    digest = hashlib.sha256(repr(recipe).encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):  # what made a recording
        digest.update(source.read_bytes())
    for values in vars(particles).values():
        if isinstance(values, np.ndarray):
            digest.update(values.tobytes())
    return digest.hexdigest()[:32]


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
        "target": np.zeros_like(count),
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

    ``particles.parquet`` beside a ``futures.parquet`` tells weights and ends; without it weights
    are equal and all particles stay where they end. In FCD each vehicle is a particle.

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
    return replace(futures, weight=weight, gone=at_end == "gone")
