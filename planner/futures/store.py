"""Futures on disk: ``futures.parquet``, two tables beside it, and the cache of all three."""

import json
import logging
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from planner.arrays import Offsets
from planner.belief.particles import Particles
from planner.belief.recipe import Recipe
from planner.cache import cache_folder, is_whole, seal
from planner.errors import InputError
from planner.files import results_written_whole
from planner.futures.cutting import begun_by_sibling, cut_from_sibling, may_be_cut
from planner.futures.edges_driven import NO_EDGE
from planner.futures.fcd import Samples, samples_of_rows, tell_of
from planner.futures.fcd_formats import TEXTS, read_rows, rows_of_table
from planner.futures.futures import Futures
from planner.futures.kept import Kept, recorded_of
from planner.futures.knots import futures_of_samples
from planner.futures.plausible import SearchTime, check_motion, motion_of_futures, motion_of_samples
from planner.futures.pooled import pooled
from planner.futures.record import NO_MATTER, How, Wanted, record_in_turn, tolerance_of
from planner.futures.recording_name import recording_name
from planner.futures.speed_units import in_mps
from planner.futures.tables import NamedFutures, futures_of_table
from planner.futures.truncate import begun_at
from planner.interrupts import undone_if_stopped
from planner.locks import held
from planner.network.road_network import RoadNetwork
from planner.network.sumo import sumo_version
from planner.parquet import dictionary, read_table, write_table
from planner.provenance import sha256_of_file, sha256_of_json

log = logging.getLogger(__name__)

SCHEMA = "planner.futures/2"
UNITS = "time in s on the target's clock, x (east) and y (north) in m of the SUMO net"
KNOTS, EDGES, PARTICLES = "futures.parquet", "edges.parquet", "particles.parquet"
FILES = (KNOTS, EDGES, PARTICLES)


@dataclass(frozen=True, eq=False)
class Recording:
    """Futures with what is known of each particle, and the files that hold them."""

    path: Path
    futures: Futures
    speed_mps: tuple[float, ...]  # (N,) on the first road; NaN where unknown
    route: tuple[str, ...]  # (N,) edge names with a space between; empty where unknown
    others: tuple[Path, ...] = ()  # further files, one after the other

    @property
    def sha256(self) -> str:
        """The digest of the file's bytes; of several files that of their digests."""
        if not self.others:
            return sha256_of_file(self.path)
        return sha256_of_json({"": [sha256_of_file(path) for path in (self.path, *self.others)]})

    def take(self, particles: Offsets) -> "Recording":
        """Return some of the particles only, by their indices, weights as they are."""
        chosen = particles.tolist()
        return replace(
            self,
            futures=self.futures.take(particles),
            speed_mps=tuple(self.speed_mps[k] for k in chosen),
            route=tuple(self.route[k] for k in chosen),
        )

    @classmethod
    def pooled(cls, parts: Sequence["Recording"]) -> "Recording":
        """Return several as one at the first one's path, each with its share of the weight."""
        return cls(
            parts[0].path,
            pooled([part.futures for part in parts]),
            tuple(speed for part in parts for speed in part.speed_mps),
            tuple(route for part in parts for route in part.route),
        )


class Request(NamedTuple):
    """What is to be recorded."""

    recipe: Recipe
    scenario: Mapping[str, Any]  # what it draws from, in the scenario's words; kept in the files


def recorded(
    network: RoadNetwork, recipe: Recipe, *, scenario: Mapping[str, Any], how: How = NO_MATTER
) -> Recording:
    """Return the futures of particles from the cache; they are drawn and driven once only.

    In towns they are cut from a larger recording where one is there that holds them, or begin with
    those of a smaller one.

    Parameters
    ----------
    scenario
        As `Request` has it.
    how
        Its progress is called before the first particle is driven as well; neither that nor its
        note is called if the cache has all.
    """
    (found,) = recorded_in_turn(network, [Request(recipe, scenario)], how)
    return found


def recorded_in_turn(
    network: RoadNetwork, requests: Sequence[Request], how: How = NO_MATTER
) -> Iterator[Recording]:
    """Yield several recordings in their order, each as soon as it is in the cache.

    Meanwhile processes go on with those that follow.

    Parameters
    ----------
    requests
        No two of them the same.
    how
        As `recorded` takes it, of all of them together.
    """
    with ExitStack() as locks:
        sets = [_there_or_new(network, request, how, locks) for request in requests]
        new = [one.wanted for one in sets if isinstance(one, _New)]
        driven = _driven(new, network, how)
        for one in sets:
            yield one if isinstance(one, Recording) else one.written(next(driven), network)


@dataclass(frozen=True, eq=False)
class _New:
    """A recording that is to be."""

    wanted: Wanted
    folder: Path
    unfinished: Path
    described: Mapping[str, str]
    lock: ExitStack  # that keeps other commands from making it too

    def written(self, futures: Futures, network: RoadNetwork) -> Recording:
        """Return it, once it is in the cache."""
        with results_written_whole(self.folder, force=True) as new:
            write_recording(new, futures, self.wanted.particles, network, self.described)
        seal(self.folder)
        shutil.rmtree(self.unfinished, ignore_errors=True)
        self.lock.close()
        return _read_kept(self.folder / KNOTS, network)


def _there_or_new(
    network: RoadNetwork, request: Request, how: How, locks: ExitStack
) -> Recording | _New:
    """Return a recording that is in the cache, or one that is ours to make, locked."""
    recipe = request.recipe
    described = describe(network, request.scenario, tolerance_of(network, how.tolerance_m))
    folder = cache_folder("futures") / recording_name(recipe, network, described)
    unfinished = cache_folder("unfinished") / folder.name
    there = _there(folder, network)
    if there is not None and not unfinished.exists():
        return there
    particles = recipe.particles(network)
    with ExitStack() as lock:
        lock.enter_context(held(unfinished))
        there = _there(folder, network)  # another command may have recorded the same meanwhile
        if there is not None:
            shutil.rmtree(unfinished, ignore_errors=True)
            return there
        kept = Kept(len(particles), unfinished, _begun(folder, recipe, particles, network))
        wanted = Wanted(kept, particles, recipe.horizon_s)
        ours = locks.enter_context(lock.pop_all())
    return _New(wanted, folder, unfinished, described, ours)


def _there(folder: Path, network: RoadNetwork) -> Recording | None:
    """Return a recording that is in the cache, None if it is not, or damaged."""
    try:
        return _read_kept(folder / KNOTS, network) if is_whole(folder) else None
    except InputError as error:
        log.info("the cache was damaged (%s)", error)
        return None


def _begun(
    folder: Path, recipe: Recipe, particles: Particles, network: RoadNetwork
) -> Futures | None:
    """Return the first particles of a recording that is to be, or all, from others in the cache."""
    if not may_be_cut(recipe, network):
        return None
    read = partial(_futures_in, network)
    cut = cut_from_sibling(folder, recipe, particles, read)
    return begun_by_sibling(folder, recipe, read) if cut is None else cut


def _driven(wanted: Sequence[Wanted], network: RoadNetwork, how: How) -> Iterator[Futures]:
    """Yield the futures of some sets, of which parts may be kept from interrupted recordings."""
    done, total = recorded_of([one.kept for one in wanted])
    if how.progress is not None and done < total:
        how.progress(done, total)
    with undone_if_stopped(partial(_say_kept, wanted)):
        yield from record_in_turn(wanted, network, how)


def _say_kept(wanted: Sequence[Wanted]) -> None:
    """Say, where a recording is stopped, that it goes on later."""
    done, total = recorded_of([one.kept for one in wanted])
    if done:
        text = f"planner: {done:,} of {total:,} particles are recorded and kept\n"
        os.write(2, text.encode())  # not by way of sys.stderr, which the main thread may hold


def describe(
    network: RoadNetwork, scenario: Mapping[str, Any], tolerance_m: float
) -> dict[str, str]:
    """Return the key-value metadata of a recording's files."""
    return {
        "schema": SCHEMA,
        "units": UNITS,
        "sumo_version": sumo_version(),
        "net_sha256": network.sha256,
        "tolerance_m": repr(tolerance_m),
        "scenario": json.dumps(scenario, sort_keys=True),
        **network.credit,
    }


def write_recording(
    folder: Path,
    futures: Futures,
    particles: Particles,
    network: RoadNetwork,
    described: Mapping[str, str],
) -> None:
    """Write ``futures.parquet``, ``edges.parquet`` and ``particles.parquet`` into a folder."""
    count, edges = np.arange(len(futures), dtype=np.int32), futures.edges
    knots = {
        "particle": count[futures.particle],
        "time_s": futures.time_s,
        "x_m": futures.x_m,
        "y_m": futures.y_m,
    }
    changes = {
        "particle": count[edges.particle],
        "time_s": edges.time_s,
        "edge": dictionary(edges.edge, list(network.edge_ids), missing=NO_EDGE),
    }
    table = {
        "particle": count,
        "weight": particles.weight,
        "target": particles.target,
        "at_end": ["gone" if gone else "stays" for gone in futures.gone],
        "depart_s": particles.depart_s,
        "speed_mps": particles.speed_mps[particles.first_edge[:-1]],
        "route": [
            " ".join(network.edge_ids[edge] for edge in particles.route(k)) for k in count.tolist()
        ],
        "seed": particles.seed,
        **({} if futures.fates is None else futures.fates.columns),
    }
    write_table(folder / KNOTS, knots, described)
    write_table(folder / EDGES, changes, described)
    write_table(folder / PARTICLES, table, described)


def read_recording(
    path: Path,
    network: RoadNetwork,
    *,
    begin_s: float | None = None,
    horizon_s: float | None = None,
) -> Recording:
    """Return the futures of a file: ``futures.parquet``, or SUMO's FCD as XML, CSV or Parquet.

    ``particles.parquet`` beside a ``futures.parquet`` holds weights, targets and ends; without it
    weights are equal, there is one target, and all particles stay where they end. The edges driven
    are those of a column ``edge``, or else of ``edges.parquet`` beside it, or else unknown. In FCD
    each vehicle is a particle. What is left out, or looks odd, is said in the log.

    Parameters
    ----------
    begin_s
        Time 0 of the futures, in seconds on the file's clock; None: that of the file.
    horizon_s
        When the search is given up, in seconds from time 0; None: not known.

    Raises
    ------
    InputError
        If the file is missing, empty, broken, does not belong to the network, or holds motion
        that cannot be.
    """
    _refuse_none(path)
    search = SearchTime(begin_s, horizon_s)
    table = read_table(path, texts=TEXTS) if path.suffix == ".parquet" else None
    if table is not None and "timestep_time" not in table.column_names:
        named = _named(path, table, network)
        check_motion(path, motion_of_futures(named.futures, named.names), network, search)
    else:
        rows = read_rows(path) if table is None else rows_of_table(path, table)
        samples = in_mps(path, samples_of_rows(path, rows, network))
        check_motion(path, motion_of_samples(samples), network, search)
        named = _of_samples(path, samples, network, begin_s)
    futures = named.futures if begin_s is None else begun_at(named.futures, begin_s)
    return Recording(path, futures, named.speed_mps, named.route)


WHENCE = (
    "correct the path, or write one with `sumo --fcd-output FILE`, or with "
    "`planner futures SCENARIO -o DIR`"
)


def _refuse_none(path: Path) -> None:
    if not path.is_file():
        raise InputError(f"{path}: no such file; {WHENCE}")


def _named(path: Path, table: Any, network: RoadNetwork) -> NamedFutures:
    edges, particles = (
        beside if (beside := path.with_name(name)).is_file() else None
        for name in (EDGES, PARTICLES)
    )
    return futures_of_table(path, table, network, edges=edges, particles=particles)


def _of_samples(
    path: Path, samples: Samples, network: RoadNetwork, begin_s: float | None
) -> NamedFutures:
    """Return the futures of the vehicles that are still there at a time."""
    futures, names = futures_of_samples(samples, network), samples.names
    over = futures.end_s < (-np.inf if begin_s is None else begin_s)
    if over.any():
        tell_of(f"{path}: left out: vehicles that end before --begin", over, names)
        names = tuple(name for name, left in zip(names, over, strict=True) if not left)
        futures = replace(futures.take(~over), weight=np.full(len(names), 1.0 / len(names)))
    return NamedFutures(futures, names, (np.nan,) * len(names), ("",) * len(names))


def _futures_in(network: RoadNetwork, folder: Path) -> Futures:
    return _read_kept(folder / KNOTS, network).futures


def _read_kept(path: Path, network: RoadNetwork) -> Recording:
    """Return a recording of our own, which needs no check of its motion."""
    _refuse_none(path)
    named = _named(path, read_table(path), network)
    return Recording(path, named.futures, named.speed_mps, named.route)
