"""Particles: possible targets, each with a route, a start on it and its speeds."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Literal

import numpy as np

from planner.arrays import Flags, Floats, Frozen, Ints, Offsets, first_rows, freeze, rows_taken
from planner.checked import choice, finite, offsets, same_length, weights
from planner.errors import InputError

Driving = Literal["constant", "free", "traffic"]


# What columns hold that are left out.
LEFT_OUT: dict[str, float] = {
    "target": 0,
    "phase_s": 0,
    "stop_s": np.inf,
    "end_m": np.inf,
    "flees_s": 0.0,
    "flees": 1.0,
    "realisation": 0,
}


@dataclass(frozen=True)
class Realisations:
    """Realisations of the traffic: those from one number on."""

    first: int
    number: int


@dataclass(frozen=True, eq=False)
class Particles(Frozen):
    """Possible targets before they move; SUMO makes their futures.

    Weights sum to the probability that the target is there at all.
    """

    weight: Floats  # (N,) probability
    start_m: Floats  # (N,) metres along the first edge
    depart_s: Floats  # (N,) seconds on the target's clock
    first_edge: Offsets  # (N + 1,) where a particle's route starts in route_edge
    route_edge: Ints  # (M,) edge indices, one route after the other
    speed_mps: Floats  # (M,) drawn speed on that edge of that route
    seed: Offsets  # (N,) from which SUMO's seeds come; see `planner.futures.record`
    gone: Flags  # (N,) True: vanishes at its route's end, False: rests there
    # "constant": the drawn speed and nothing else; "free": SUMO's driver, alone; or among others
    driving: Driving
    # (N,) which target the particle may be, 0 for the first; left out: there is one target
    target: Ints = field(default_factory=lambda: np.zeros(0, np.int32))
    # (N,) second on SUMO's clock, which its signals follow, at the target's time 0; left out: 0
    phase_s: Ints = field(default_factory=lambda: np.zeros(0, np.int32))
    # (N,) second on the target's clock from which it rests, wherever it is; left out: never
    stop_s: Floats = field(default_factory=lambda: np.zeros(0))
    # (N,) metres along the last edge where the route ends; left out: at the edge's end, infinity
    end_m: Floats = field(default_factory=lambda: np.zeros(0))
    # (N,) for how many seconds since setting out it flees, and by which factor it drives faster
    # then than limits and its own speed allow; left out: it does not
    flees_s: Floats = field(default_factory=lambda: np.zeros(0))
    flees: Floats = field(default_factory=lambda: np.zeros(0))
    # (N,) of the traffic, in which it rides; left out: the first one. Without traffic it is nothing
    realisation: Ints = field(default_factory=lambda: np.zeros(0, np.int32))

    def __post_init__(self) -> None:
        for name, value in LEFT_OUT.items():
            if len(getattr(self, name)) == 0:
                object.__setattr__(self, name, np.full(np.size(self.weight), value))
        freeze(
            self,
            weight=np.float64,
            start_m=np.float64,
            depart_s=np.float64,
            first_edge=np.int64,
            route_edge=np.int32,
            speed_mps=np.float64,
            seed=np.int64,
            gone=np.bool_,
            target=np.int32,
            phase_s=np.int32,
            stop_s=np.float64,
            end_m=np.float64,
            flees_s=np.float64,
            flees=np.float64,
            realisation=np.int32,
        )
        columns = {"start_m": self.start_m, "depart_s": self.depart_s, "seed": self.seed}
        kinds = {"gone": self.gone, "target": self.target, "phase_s": self.phase_s}
        kinds |= {"realisation": self.realisation}
        ends = {"stop_s": self.stop_s, "end_m": self.end_m}
        ends |= {"flees_s": self.flees_s, "flees": self.flees}
        count = same_length(weight=self.weight, **kinds, **columns, **ends)
        edges = same_length(route_edge=self.route_edge, speed_mps=self.speed_mps)
        offsets("first_edge", self.first_edge, count, edges)
        finite(start_m=self.start_m, depart_s=self.depart_s, speed_mps=self.speed_mps)
        weights("weight", self.weight)
        choice("driving", self.driving, Driving)

    def __len__(self) -> int:
        return len(self.weight)

    def take(self, particles: Offsets | Flags) -> "Particles":
        """Return some particles only, in the order given, weights as they are."""
        index = np.arange(len(self))[particles]
        rows, first = rows_taken(self.first_edge, index)
        return Particles(
            weight=self.weight[index],
            start_m=self.start_m[index],
            depart_s=self.depart_s[index],
            first_edge=first,
            route_edge=self.route_edge[rows],
            speed_mps=self.speed_mps[rows],
            seed=self.seed[index],
            gone=self.gone[index],
            driving=self.driving,
            target=self.target[index],
            phase_s=self.phase_s[index],
            stop_s=self.stop_s[index],
            end_m=self.end_m[index],
            flees_s=self.flees_s[index],
            flees=self.flees[index],
            realisation=self.realisation[index],
        )

    def in_realisations(self, some: "Realisations") -> "Particles":
        """Return them spread evenly over realisations of the traffic, one after the other.

        The first one's is as random as its seed, so that single targets do not all ride in one.
        """
        shift = int(self.seed[0]) if len(self) else 0
        return replace(self, realisation=some.first + (shift + np.arange(len(self))) % some.number)

    def gone_after(self, end_s: Floats) -> Flags:
        """Return which particles vanish whose motion ends at times, (N,) seconds.

        Who stops on the way stays there.
        """
        return np.asarray(self.gone & (end_s < self.stop_s))

    def route(self, particle: int) -> Ints:
        """Return one particle's edges in driving order, (k,)."""
        return self.route_edge[self.first_edge[particle] : self.first_edge[particle + 1]]

    def speeds(self, particle: int) -> Floats:
        """Return one particle's drawn speed on each edge of its route, (k,) m/s."""
        return self.speed_mps[self.first_edge[particle] : self.first_edge[particle + 1]]


def together(parts: Sequence[Particles]) -> Particles:
    """Return the particles of all parts, one part after the other, weights as they are.

    Raises
    ------
    InputError
        If they do not all drive alike.
    """
    if len({part.driving for part in parts}) != 1:
        raise InputError("driving: differs between particles that should stand together")
    columns = [
        field.name for field in fields(Particles) if field.name not in ("driving", "first_edge")
    ]
    joined = {
        name: np.concatenate([getattr(part, name) for part in parts]) for name in sorted(columns)
    }
    edges = np.concatenate([np.diff(part.first_edge) for part in parts])
    return Particles(**joined, first_edge=first_rows(edges), driving=parts[0].driving)
