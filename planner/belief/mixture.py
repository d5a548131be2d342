"""Mixtures: what the target may be, each with its probability; and several targets at once."""

from dataclasses import dataclass, replace

import numpy as np

from planner.arrays import Floats, Frozen, Offsets, freeze
from planner.belief.distribution import chosen
from planner.belief.particles import Driving
from planner.belief.prior import Prior
from planner.checked import weights
from planner.errors import InputError

OF_ALL = ("driving", "signals_known", "probability_present", "window_s")


@dataclass(frozen=True, eq=False)
class Mixture(Frozen):
    """Several priors, of which one is the target's."""

    share: Floats  # (C,) sums to one
    parts: tuple[Prior, ...]  # C of them

    def __post_init__(self) -> None:
        freeze(self, share=np.float64)
        weights("share", self.share)
        if not self.parts or len(self.parts) != len(self.share):
            raise InputError("share, parts: give a prior for each share, and at least one")
        for name in OF_ALL:
            if len({getattr(part, name) for part in self.parts}) > 1:
                raise InputError(f"parts: differ in {name}, which is the same in all of a mixture")

    @property
    def driving(self) -> Driving:
        """How all of them drive."""
        return self.parts[0].driving

    @property
    def probability_present(self) -> float:
        """That the target exists at all."""
        return self.parts[0].probability_present

    def drawn(self, n: int, rng: np.random.Generator) -> Offsets:
        """Return independent draws of which part each of n particles is of, (N,)."""
        return chosen(self.share, rng.random(n))

    def apportioned(self, n: int) -> Offsets:
        """Return which part each of n particles is of, (N,), as even as can be.

        Of the first so many, each part has its share but for one particle at most or so.
        """
        count = np.zeros(len(self.share))
        part = np.empty(n, np.int64)
        for k in range(n):
            part[k] = np.argmax((k + 1) * self.share - count)
            count[part[k]] += 1
        return part


OneBelief = Prior | Mixture


@dataclass(frozen=True, eq=False)
class Several(Frozen):
    """Several targets, each with a belief of its own; where one is tells nothing of the others."""

    targets: tuple[OneBelief, ...]

    def __post_init__(self) -> None:
        if len(self.targets) < 2:
            raise InputError("targets: give two beliefs or more; one stands for itself")
        if len({target.driving for target in self.targets}) > 1:
            raise InputError("targets: differ in driving, which is the same for all")

    @property
    def driving(self) -> Driving:
        """How all of them drive."""
        return self.targets[0].driving


Belief = OneBelief | Several


def parts_of(belief: Belief) -> tuple[Prior, ...]:
    """Return the priors that a belief is made of: itself, or those of a mixture or all targets."""
    if isinstance(belief, Several):
        return tuple(part for target in belief.targets for part in parts_of(target))
    return belief.parts if isinstance(belief, Mixture) else (belief,)


def in_traffic(belief: Belief) -> Belief:
    """Return the same of targets that drive in traffic."""
    if isinstance(belief, Several):
        return Several(tuple(_in_traffic(target) for target in belief.targets))
    return _in_traffic(belief)


def _in_traffic(belief: OneBelief) -> OneBelief:
    if isinstance(belief, Prior):
        return replace(belief, driving="traffic")
    return replace(belief, parts=tuple(replace(part, driving="traffic") for part in belief.parts))
