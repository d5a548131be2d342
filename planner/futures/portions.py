"""Recordings that tell of their first particles while the others are still driven."""

from collections.abc import Callable, Iterator
from dataclasses import replace

from planner.belief.particles import Particles
from planner.futures.futures import Futures
from planner.futures.record import joined, record
from planner.network.road_network import RoadNetwork
from planner.progress import Progress, silent

FIRST = 250  # particles in the first portion; each later one doubles what there is

Note = Callable[[Futures], str]


def record_in_portions(
    network: RoadNetwork,
    particles: Particles,
    note: Note,
    *,
    horizon_s: float,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Futures:
    """Return what `record` returns, byte for byte.

    Where particles share runs, all of them are one portion.

    Parameters
    ----------
    note
        Called with the first particles of all as soon as they are recorded, as futures that stand
        for all; what it returns goes with the progress from then on.
    horizon_s, workers, progress
        As ``record`` takes them.
    """
    parts: list[Futures] = []
    said, tell, many = "", progress or silent, len(particles)
    for first, last in _portions(particles):

        def on_progress(done: int, _: int, __: str = "", /, *, said: str = said) -> None:
            tell(sum(map(len, parts)) + done, many, said)

        part = particles.part(first, last)
        parts.append(
            record(network, part, horizon_s=horizon_s, workers=workers, progress=on_progress)
        )
        if last < many:
            some = joined(parts, particles.part(0, last))
            said = note(replace(some, weight=some.weight * (many / last)))
            tell(last, many, said)
    return joined(parts, particles)


def _portions(particles: Particles) -> Iterator[tuple[int, int]]:
    """Yield where each portion begins and ends."""
    first, last, many = 0, FIRST, len(particles)
    while particles.driving == "free" and last < many:
        yield first, last
        first, last = last, 2 * last
    yield first, many
