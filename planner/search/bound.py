"""Particle prices: no road plan is worth more than the prices and what a flight earns above them.

Let r_ka be what hop a, begun at a certain time, earns with particle k when it sees it. A plan
earns the greatest r_ka of its hops with each particle, and for any prices p_k >= 0

    sum_k max_a r_ka  <=  sum_k p_k  +  sum over the plan's hops of sum_k max(0, r_ka - p_k),

where the last sum may leave out particles that an earlier hop has surely seen: the earlier
sighting is worth more. The right side is greatest along one flight, which a dynamic programme over
nodes and times finds. It remembers the last few legs flown, so that flying to and fro over the
same particles does not sell them twice. Straight flights forget.

Times are bins. Whoever starts a hop within half a bin of its middle is at every moment within
v * bin / 2 of whoever starts at the middle, who rests half a bin at both ends; so what a hop may
see is what that flight sees with a radius larger by as much, and what it surely sees with one that
is smaller. A hop ends in the bins that all its starts end in.

A landing by a certain time is left out: a bound for plans that need not land holds for all. What is
seen on a flight to a certain place to land is no hop's, so such problems have no bound yet.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.first_detection import first_detection
from planner.detection.track import Track
from planner.errors import NotApplicableError
from planner.futures.futures import Futures
from planner.search.hops import Hops, hops_of
from planner.search.problem import Problem
from planner.search.walks import Walks, bins_of

MOST_CELLS = 4_000_000  # hops times bins, of which a table is made


@dataclass(frozen=True)
class Grain:
    """How finely a bound looks."""

    bin_s: float = 5.0
    memory: int = 2  # legs that a flight remembers

    @classmethod
    def fitting(cls, problem: Problem, *, memory: int = 2) -> "Grain":
        """Return bins short enough for the sensor to be sure and for every hop to last one."""
        sure_s = problem.sensor.radius_m / problem.legs.speed_mps
        return cls(min(5.0, sure_s, float(hops_of(problem).duration_s.min())), memory)


@dataclass(frozen=True, eq=False)
class Table:
    """All that hops may see, and what the bound needs beside prices."""

    weight: Floats  # (N,)
    floor: Floats  # (N,) reward; prices stay above, and sightings that earn less are left out
    world: tuple[Any, ...]  # sightings, hops and contexts as ``kernels_prices`` takes them
    flights: tuple[tuple[int, int, Floats], ...]  # first ones: node, bin, reward of what they see
    worth: Floats  # (walks, bins), room for the dynamic programme

    def bound(self, prices: Floats) -> tuple[float, Floats]:
        """Return the greatest expected reward that prices allow, and how often each is sold.

        Parameters
        ----------
        prices
            One per particle, (N,) in units of reward, none below the floor.
        """
        from planner.search.kernels_prices import dearest, worths

        asked = prices * self.weight
        worths(asked, self.world, self.worth)
        bins = self.worth.shape[1]
        above = [
            float(self.weight @ np.maximum(0.0, reward - prices))
            + (self.worth[node, i] if i < bins else 0.0)
            for node, i, reward in self.flights
        ]
        most = int(np.argmax(above))
        node, i, reward = self.flights[most]
        counts = (reward > prices).astype(np.float64)
        dearest(asked, self.world, self.worth, (node, i), counts)
        return float(asked.sum()) + above[most], counts


def table_of(problem: Problem, grain: Grain, floor: Floats) -> Table:
    """Return the table of a problem's bound.

    Parameters
    ----------
    floor
        Rewards, (N,), below which no price will be asked; the higher, the smaller the table.

    Raises
    ------
    NotApplicableError
        If the net is too large, or a bin too long for the sensor to be sure of anything.
    """
    if problem.uavs[0].return_to_m is not None:
        raise NotApplicableError(
            "no bound is known for road plans that have to come home; leave out uav.return_to"
        )
    hops, nodes = hops_of(problem), len(problem.network.node_ids)
    flights, first_s = first_flights(problem)
    ends_s = min(problem.objective.ends_s, problem.uavs[0].landing_s)
    count = max(1, int(np.ceil((ends_s - first_s) / grain.bin_s)) + 1)
    if float(hops.duration_s.min()) < grain.bin_s:
        raise NotApplicableError(
            f"the bound for road plans needs bins no longer than the shortest flight between "
            f"nodes, {hops.duration_s.min():.3g} s; {grain.bin_s:g} s is longer"
        )
    if len(hops) * count > MOST_CELLS:
        raise NotApplicableError(
            f"the bound for road plans takes {len(hops) * count:,} flights here, more than "
            f"{MOST_CELLS:,}; take a smaller net or longer bins"
        )
    bins = (first_s, grain.bin_s, count)
    walks = Walks.of(hops, nodes, grain.memory)
    weight = problem.futures.weight
    first, particle, reward, sure = _sightings(problem, hops, bins, floor)
    known = _known(walks, first[: hops.legs * count + 1], particle, sure, grain.bin_s)
    lasts = bins_of(hops.duration_s, grain.bin_s)
    return Table(
        weight=weight,
        floor=floor,
        world=(
            (first, particle, reward * weight[particle], known),
            (hops.from_node, hops.to_node, lasts, hops.legs),
            (walks.first, walks.before, walks.then, walks.ends_at),
        ),
        flights=tuple(
            (node, round((at_s - first_s) / grain.bin_s), seen) for node, at_s, seen in flights
        ),
        worth=np.zeros((len(walks.ends_at), count)),
    )


def first_flights(problem: Problem) -> tuple[list[tuple[int, float, Floats]], float]:
    """Return node, arrival and rewards of each flight from take-off, and the first arrival."""
    uav, xy = problem.uavs[0], problem.network.node_xy_m
    flights = []
    for node in range(len(xy)):
        away = xy[node] - (uav.x_m, uav.y_m)
        at_s = uav.take_off_s + float(np.hypot(*away)) / uav.speed_mps
        on = [(uav.take_off_s, at_s)] if problem.sensor.detects_in_transit else []
        path = np.array([(uav.x_m, uav.y_m), xy[node]])
        track = Track(
            np.array([uav.take_off_s, at_s]), path[:, 0], path[:, 1], np.array(on).reshape(-1, 2)
        )
        seen_at = first_detection(problem.futures, track, problem.sensor.radius_m)
        flights.append((node, at_s, problem.objective.reward(seen_at)))
    return flights, min(at_s for _, at_s, _ in flights)


def pieces_of(futures: Futures) -> tuple[Floats, Ints]:
    """Return all straight motions: from, to, place at from, velocity, (P, 6); and whose (P,)."""
    who = np.repeat(np.arange(len(futures)), np.diff(futures.first_knot))
    at = np.stack([futures.time_s, futures.x_m, futures.y_m], axis=1)
    last = np.zeros(len(who), dtype=bool)
    last[futures.first_knot[1:][np.diff(futures.first_knot) > 0] - 1] = True
    moves = np.flatnonzero(~last & (np.diff(at[:, 0], append=np.inf) > 0.0))
    step = at[moves + 1] - at[moves]
    rests = np.flatnonzero(last & ~futures.gone[who])
    moving = np.column_stack(
        [at[moves, 0], at[moves + 1, 0], at[moves, 1:], step[:, 1:] / step[:, :1]]
    )
    resting = np.column_stack(
        [at[rests, 0], np.full(len(rests), np.inf), at[rests, 1:], np.zeros((len(rests), 2))]
    )
    whose = np.concatenate([who[moves], who[rests]]).astype(np.int64)
    return np.ascontiguousarray(np.concatenate([moving, resting])), whose


def _sightings(
    problem: Problem, hops: Hops, bins: tuple[float, float, int], floor: Floats
) -> tuple[Ints, Ints, Floats, Ints]:
    """Return first, particle and reward of what hops may see, and what legs surely see."""
    from planner.search.kernels_hops import listed, sweep

    pieces, who = pieces_of(problem.futures)
    half_s, radius_m = bins[1] / 2, problem.sensor.radius_m
    slack_m = half_s * problem.legs.speed_mps
    objective = problem.objective
    until_s = objective.ends_s - floor if objective.by_s is None else _by(objective.by_s, floor)
    many = len(hops) if problem.sensor.detects_in_transit else hops.legs
    counts, whose, rewards = [], [], []
    sure = np.zeros((hops.legs, bins[2], (len(floor) + 7) // 8), dtype=np.uint8)
    seen_at = np.empty((bins[2], len(floor)))
    for hop in range(many):
        seen_at[:] = np.inf
        sweep(hops.wide(hop, half_s), pieces, who, bins, radius_m + slack_m, seen_at)
        count, particle, when = listed(seen_at, until_s)
        counts.append(count)
        whose.append(particle)
        rewards.append(objective.reward(when))
        if hop < hops.legs and radius_m > slack_m:
            seen_at[:] = np.inf
            sweep(hops.core(hop, half_s), pieces, who, bins, radius_m - slack_m, seen_at)
            sure[hop] = np.packbits(seen_at < np.inf, axis=1)
    counts.append(np.zeros((len(hops) - many) * bins[2], dtype=np.int64))
    first = np.concatenate(([0], np.cumsum(np.concatenate(counts))))
    return first, np.concatenate(whose), np.concatenate(rewards), sure


def _by(by_s: float, floor: Floats) -> Floats:
    """Return until when a sighting earns more than the floor, with a deadline, (N,) seconds."""
    return np.where(floor < 1.0, np.nextafter(by_s, np.inf), -np.inf)


def _known(walks: Walks, first: Ints, particle: Ints, sure: Ints, bin_s: float) -> Ints:
    """Return for each of the legs' sightings after which walks its particle is surely seen."""
    from planner.search.kernels_hops import known_after

    bins = sure.shape[1]
    words = max(1, max((len(legs) + 63) // 64 for legs in walks.legs))
    known = np.zeros((first[-1], words), dtype=np.uint64)
    for leg in range(len(sure)):
        here = first[leg * bins : (leg + 1) * bins + 1]
        before = (walks.legs[leg], walks.shorter[leg], bins_of(walks.lasts_s[leg], bin_s))
        among = slice(here[0], here[-1])
        known[among] = known_after(here - here[0], particle[among], sure, before, words)
    return known
