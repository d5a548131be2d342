"""What is known of the target before anything is seen: p(x0) and the transition model."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from planner.arrays import Flags, Floats, Frozen, Offsets, freeze
from planner.belief.distribution import Distribution, chosen, distribution
from planner.belief.habits import Flees, Stops
from planner.belief.known_routes import KnownRoutes
from planner.belief.particles import Driving
from planner.belief.stretches import Stretches
from planner.checked import choice, finite, number, set_fields, weights
from planner.errors import InputError
from planner.network.road_network import RoadNetwork

if TYPE_CHECKING:
    from planner.scenario.target import TargetSection

TurnTable = dict[str, dict[str, float]]  # from an edge to an edge, the probability


@dataclass(frozen=True, eq=False)
class Prior(Frozen):
    """The paper's p(x0) = [p(r0), p(d0), p(v0)] and how the target goes on from there.

    E edges and T turns as the network counts them.
    """

    edge_probability: Floats  # (E,) p(r0), sums to one
    distance_m: Distribution | None  # p(d0) along the first edge; None: anywhere on it
    speed_mps: Distribution  # p(v0)
    # (T,) as network.turn_edge; sums to one for each edge with turns, or to 0 at a sink
    turn_probability: Floats
    speed_per_road: bool  # True: a new speed is drawn on every road
    driving: Driving
    gone: bool  # True: vanishes at its route's end, False: rests there, unless that is an exit
    probability_present: float  # that the target exists at all
    signals_known: bool = False  # True: time 0 is second 0 of the signals' programs
    # In place of ``distance_m``: parts of the edges that ``edge_probability`` has
    stretches: Stretches | None = None
    window_s: int = 0  # it was there, and went on, at any second from 0 to this one
    # Where it drives to, in place of turns by chance; within reach of every start
    goals: Stretches | KnownRoutes | None = None
    stops: Stops | None = None  # None: it never parks
    flees: Flees | None = None  # None: it does not

    def __post_init__(self) -> None:
        freeze(self, edge_probability=np.float64, turn_probability=np.float64)
        weights("edge_probability", self.edge_probability)
        finite(turn_probability=self.turn_probability)
        choice("driving", self.driving, Driving)
        present = number("probability_present", self.probability_present, least=0.0)
        if present > 1.0:
            raise InputError(f"probability_present: {present:g} is no probability")
        set_fields(self, {"probability_present": present})

    def starts(self, which: Floats, where: Floats, edge_length_m: Floats) -> tuple[Offsets, Floats]:
        """Return the first edges at the shares ``which`` of p(r0), and metres along them, p(d0).

        Parameters
        ----------
        which, where
            Numbers from 0 up to but not including 1, (N,).
        edge_length_m
            Of all edges, (E,).
        """
        if self.stretches is not None:
            return self.stretches.places(which, where)
        edge = chosen(self.edge_probability, which)
        if self.distance_m is None:
            return edge, where * edge_length_m[edge]
        return edge, self.distance_m.quantile(where)


class Drives(Protocol):
    """A prior, or a mixture of some that drive alike."""

    @property
    def driving(self) -> Driving:
        """How targets drive."""


def in_town(prior: Drives, network: RoadNetwork) -> bool:
    """Return whether targets drive among limits, signals and turns: SUMO's driver on a real net.

    Particles drawn there, and their motion, do not depend on how many there are, nor on the
    horizon but for their end.
    """
    return prior.driving != "constant" and not network.is_abstract


class Known(NamedTuple):
    """What files and the network say of a target, beyond its section."""

    turns: TurnTable | None = None  # in place of ``target.turning``
    stretches: Stretches | None = None  # those of ``target.start``; None: whole edges
    goals: Stretches | KnownRoutes | None = None  # of ``target.goes``; None: turns by chance
    reach: Flags | None = None  # (E,) from where a goal can be reached; None: from everywhere


NOTHING = Known()


def prior_of(target: "TargetSection", network: RoadNetwork, known: Known = NOTHING) -> Prior:
    """Return the prior that a scenario's section describes on a network.

    Parameters
    ----------
    target
        Its edges are all in the network.
    known
        What has been looked up for it.
    """
    turns = known.turns
    if turns is None:
        turns = target.turning if isinstance(target.turning, dict) else {}
    distance = target.distance_m
    stretches, start = known.stretches, start_probability(target, network, known.stretches)
    if known.reach is not None:
        start = np.where(known.reach, start, 0.0)
        start = start / start.sum()
        stretches = stretches and stretches.take(known.reach[stretches.edge])
    return Prior(
        edge_probability=start,
        distance_m=None if isinstance(distance, str) else distribution(distance),
        speed_mps=distribution(target.speed_mps),
        turn_probability=turn_probability(network, turns),
        speed_per_road=target.speed_drawn == "per road",
        driving=target.driving,
        gone=target.at_sink == "gone",
        # Who is hidden is never found, as who is not there at all.
        probability_present=target.probability_present * (1.0 - (target.hidden or 0.0)),
        signals_known=target.signals == "known",
        stretches=stretches,
        window_s=int(target.last_seen_window_s or 0),
        goals=known.goals,
        stops=_stops(target),
        flees=Flees(target.flees.for_s, target.flees.factor) if target.flees else None,
    )


def _stops(target: "TargetSection") -> Stops | None:
    said = target.stops
    if said is None:
        return None
    # Who gives no time to drive until parking means those alone that are parked.
    return Stops(said.parked, 0.0 if said.mean_s is None else said.share, said.mean_s or 1.0)


def start_probability(
    target: "TargetSection", network: RoadNetwork, stretches: Stretches | None
) -> Floats:
    """Return the probability that a section gives to each edge as the first one, (E,).

    Parameters
    ----------
    stretches
        Those of its start; None: whole edges.
    """
    if stretches is not None:
        return stretches.by_edge(len(network.edge_ids))
    if not isinstance(target.start, dict):
        return np.asarray(network.edge_length_m / network.edge_length_m.sum())
    probability = np.zeros(len(network.edge_ids))
    for edge, share in target.start.items():
        probability[network.edge_index[edge]] = share
    return np.asarray(probability / probability.sum())


def turn_probability(network: RoadNetwork, turns: TurnTable) -> Floats:
    """Return the probability of each of the network's turns, (T,).

    Parameters
    ----------
    turns
        Probabilities by the names of the two edges; edges that are not in it turn equally, and
        never straight back where there is another way. One without any way on is a sink.
    """
    onward = ~network.turn_back
    left = np.repeat(np.arange(len(network.edge_ids)), np.diff(network.first_turn))
    count = np.bincount(left[onward], minlength=len(network.edge_ids))
    probability = np.where(onward, 1 / np.maximum(count, 1)[left], 0.0)
    for start, ways in turns.items():
        edge = network.edge_index[start]
        leaving = slice(network.first_turn[edge], network.first_turn[edge + 1])
        names = [network.edge_ids[end] for end in network.turns(edge, back=True)]
        shares = np.array([ways.get(name, 0.0) for name in names])
        probability[leaving] = shares / (shares.sum() or 1.0)
    return np.asarray(probability)
