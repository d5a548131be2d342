"""Recipes: all that decides which particles come out, known before any is drawn.

Two equal recipes give equal particles on the same network, so that a recording can be looked up
without drawing them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from planner.belief.mixture import Belief
from planner.belief.particles import Particles, Realisations
from planner.belief.predefined import predefined
from planner.belief.sampling import Sampling, sample
from planner.network.road_network import RoadNetwork
from planner.streams import stream


class Recipe(Protocol):
    """A dataclass whose fields, and those of the dataclasses in them, decide what is made."""

    @property
    def horizon_s(self) -> float:
        """Up to when particles move, seconds on the target's clock."""

    def particles(self, network: RoadNetwork) -> Particles:
        """Return the particles, the same ones each time."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """Particles drawn from a prior."""

    prior: Belief
    count: int
    horizon_s: float
    seed: int
    stream: tuple[str | int, ...]  # the name of the random stream under the seed
    sampling: Sampling = "iid"
    realisations: Realisations | None = None  # of the traffic, in which they ride

    def particles(self, network: RoadNetwork) -> Particles:
        """Return the particles as `planner.belief.sampling.sample` draws them."""
        rng = stream(self.seed, *self.stream)
        drawn = sample(
            self.prior,
            network,
            self.count,
            rng,
            sampling=self.sampling,
            horizon_s=self.horizon_s,
        )
        return _placed(drawn, self.realisations)


@dataclass(frozen=True, eq=False)
class OneTarget:
    """One target on a given route at a given speed."""

    prior: Belief  # how it drives, and what happens at its end
    route: Sequence[str]  # names of edges
    speed_mps: float
    offset_m: float
    horizon_s: float
    seed: int  # of SUMO's driver
    stream: tuple[str | int, ...]
    realisations: Realisations | None = None  # of the traffic; it rides in one of them

    def particles(self, network: RoadNetwork) -> Particles:
        """Return the target as `planner.belief.predefined.predefined` places it."""
        target = predefined(
            network,
            self.prior,
            self.route,
            stream(self.seed, *self.stream),
            speed_mps=self.speed_mps,
            offset_m=self.offset_m,
        )
        return _placed(target, self.realisations)


def _placed(particles: Particles, realisations: Realisations | None) -> Particles:
    return particles if realisations is None else particles.in_realisations(realisations)


@dataclass(frozen=True, eq=False)
class Given:
    """Particles that are at hand."""

    made: Particles
    horizon_s: float

    def particles(self, network: RoadNetwork) -> Particles:  # noqa: ARG002
        """Return them."""
        return self.made
