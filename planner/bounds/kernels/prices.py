"""The best flight at given prices, compiled: one dynamic programme over time and memory.

A state is a node, or a leg just flown; states ``0 .. V - 1`` are the nodes, ``V + leg`` the legs.
A cell is a hop begun in a bin; cells are numbered by bin, then hop.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.bounds.kernels.hops import Lasting
from planner.jit import compiled

REMEMBERED = 8  # legs into a node, at most
NOTHING = -1  # no leg is remembered


class SightingColumns(NamedTuple):
    """What hops may see, sorted by cell."""

    first: Offsets  # (cells + 1,) where a cell's sightings start
    particle: Ints  # (M,)
    reward: Floats  # (M,) times the particle's weight
    # (M,) bit b is set where the sighting is worth less after the b-th leg into the hop's first
    # node, flown just before
    known: Ints
    # (M, 2) what share of it counts, and what share after such a leg; (1, 2) if all are alike, as
    # where nobody is missed
    odds: Floats


class HopColumns(NamedTuple):
    """Where hops lead and how long they last."""

    from_node: Ints  # (h,)
    to_node: Ints  # (h,)
    lasts: Lasting  # (h,) bins
    legs: int  # the first so many hops are legs


class ArrivalColumns(NamedTuple):
    """The legs by the node that they lead to; of each node's, ``REMEMBERED`` are remembered."""

    first: Offsets  # (V + 1,) where a node's legs start
    leg: Ints  # (legs,)


class PriceTable(NamedTuple):
    """All that the dynamic programme needs beside prices."""

    sightings: SightingColumns
    hops: HopColumns
    arrivals: ArrivalColumns


class Start(NamedTuple):
    """Where and when flights begin, and what was earned before."""

    node: int
    bin: int
    reward: Floats  # (N,) of what is seen until there, at most
    missed: Floats  # (N,) how probably each is unseen there


class Choice(NamedTuple):
    """The hop that the best flight goes on with, and the bin in which it then arrives."""

    hop: int
    bin: int


@compiled
def odds_of(sightings: SightingColumns, e: int) -> tuple[float, float]:
    """Return what share of a sighting counts, and what share after a leg that knows it."""
    row = min(e, len(sightings.odds) - 1)
    return float(sightings.odds[row, 0]), float(sightings.odds[row, 1])


@compiled
def counted(sightings: SightingColumns, e: int, bit: int) -> float:
    """Return what share of a sighting counts after the leg that ``bit`` names."""
    share, again = odds_of(sightings, e)
    return again if bit != NOTHING and (sightings.known[e] >> bit) & 1 else share


@compiled
def surplus(prices: Floats, sightings: SightingColumns, cell: int, bit: int) -> float:
    """Return what a hop's sightings earn above prices, less of those known after a leg.

    ``bit`` names the leg.
    """
    total = 0.0
    for e in range(sightings.first[cell], sightings.first[cell + 1]):
        gain = sightings.reward[e] - prices[sightings.particle[e]]
        if gain > 0.0:
            total += gain * counted(sightings, e, bit)
    return total


@compiled
def known_surplus(prices: Floats, sightings: SightingColumns, cell: int, known: Floats) -> float:
    """Return what a leg's sightings earn above prices; fill ``known`` with the known part of it.

    ``known`` (``REMEMBERED``,) holds for each leg before what its sightings know already.
    """
    total = 0.0
    known[:] = 0.0
    for e in range(sightings.first[cell], sightings.first[cell + 1]):
        gain = sightings.reward[e] - prices[sightings.particle[e]]
        if gain > 0.0:
            share, again = odds_of(sightings, e)
            total += gain * share
            bits, b = sightings.known[e], 0
            while bits:
                if bits & 1:
                    known[b] += gain * (share - again)
                bits >>= 1
                b += 1
    return total


@compiled
def fill_values(prices: Floats, table: PriceTable, value_to_go: Floats, since: int) -> None:
    """Fill from a bin on: the most that flights on from a state can earn above prices.

    ``value_to_go`` (bins and as many as the longest hop lasts, states) is zero where nothing is
    seen any more.
    """
    sightings, hops, arrivals = table.sightings, table.hops, table.arrivals
    from_node, to_node = hops.from_node, hops.to_node
    least, most = hops.lasts.least, hops.lasts.most
    first_into, into = arrivals.first, arrivals.leg
    nodes = len(first_into) - 1
    bins = (len(sightings.first) - 1) // len(from_node)
    known, last = np.empty(REMEMBERED), bins
    while (
        last > since
        and sightings.first[last * len(from_node)] == (sightings.first[(last - 1) * len(from_node)])
    ):
        last -= 1  # from here on nothing is seen, and the values stay zero
    for i in range(last - 1, since - 1, -1):
        here, cell = value_to_go[i], i * len(from_node)
        here[:nodes] = 0.0
        for hop in range(hops.legs, len(from_node)):
            node, to = from_node[hop], to_node[hop]
            value = max(value_to_go[i + least[hop], to], value_to_go[i + most[hop], to])
            here[node] = max(here[node], value + surplus(prices, sightings, cell + hop, NOTHING))
        for node in range(nodes):
            for at in range(first_into[node], first_into[node + 1]):
                here[nodes + into[at]] = here[node]
        for leg in range(hops.legs):
            node, to = from_node[leg], nodes + leg
            value = max(value_to_go[i + least[leg], to], value_to_go[i + most[leg], to])
            value += known_surplus(prices, sightings, cell + leg, known)
            here[node] = max(here[node], value)
            begin, end = first_into[node], first_into[node + 1]
            for at in range(begin, end):
                less = known[at - begin] if at - begin < REMEMBERED else 0.0
                state = nodes + into[at]
                here[state] = max(here[state], value - less)


@compiled
def best_path(
    prices: Floats, table: PriceTable, value_to_go: Floats, start: Start, counts: Floats
) -> None:
    """Add to ``counts`` (N,) how often the best flight from a start earns more than each price."""
    sightings, hops = table.sightings, table.hops
    nodes, hop_count = len(table.arrivals.first) - 1, len(hops.from_node)
    bins = (len(sightings.first) - 1) // hop_count
    node, i, last = start.node, start.bin, NOTHING
    while i < bins and value_to_go[i, node if last == NOTHING else nodes + last] > 0.0:
        bit = bit_of(table.arrivals, node, last)
        choice = best_hop(prices, table, value_to_go, (node, i), bit)
        cell = i * hop_count + choice.hop
        bit = bit if choice.hop < hops.legs else NOTHING
        for e in range(sightings.first[cell], sightings.first[cell + 1]):
            particle = sightings.particle[e]
            if sightings.reward[e] > prices[particle]:
                counts[particle] += counted(sightings, e, bit)
        node, i = hops.to_node[choice.hop], choice.bin
        last = choice.hop if choice.hop < hops.legs else NOTHING


@compiled
def bit_of(arrivals: ArrivalColumns, node: int, leg: int) -> int:
    """Return the bit of a leg into a node; ``NOTHING`` if it is not remembered there."""
    begin, bit = arrivals.first[node], NOTHING
    for at in range(begin, min(begin + REMEMBERED, arrivals.first[node + 1])):
        if arrivals.leg[at] == leg:
            bit = at - begin
    return bit


@compiled
def best_hop(
    prices: Floats, table: PriceTable, value_to_go: Floats, at: tuple[int, int], bit: int
) -> Choice:
    """Return with which hop the best flight goes on from a node and bin.

    ``bit`` names the leg flown just before.
    """
    (node, i), hops = at, table.hops
    nodes, hop_count = len(table.arrivals.first) - 1, len(hops.from_node)
    most, hop, then = -1.0, -1, i
    for h in range(hop_count):
        if hops.from_node[h] == node:
            is_leg = h < hops.legs
            state = nodes + h if is_leg else hops.to_node[h]
            soon, late = i + hops.lasts.least[h], i + hops.lasts.most[h]
            value = max(value_to_go[soon, state], value_to_go[late, state])
            known = bit if is_leg else NOTHING
            value += surplus(prices, table.sightings, i * hop_count + h, known)
            if value > most:
                most, hop = value, h
                then = soon if value_to_go[soon, state] >= value_to_go[late, state] else late
    return Choice(hop, then)


@compiled
def most_onward(
    prices: Floats,
    table: PriceTable,
    value_to_go: Floats,
    at: tuple[int, int],
    left: Floats,
) -> float:
    """Return the most that flights on from a node and bin earn above prices, some being seen.

    ``left`` (N,) is what share of each particle's sightings by the first hop still counts.
    """
    (node, i), hops, sightings = at, table.hops, table.sightings
    nodes, hop_count = len(table.arrivals.first) - 1, len(hops.from_node)
    most = 0.0
    for hop in range(hop_count):
        if hops.from_node[hop] == node:
            state = nodes + hop if hop < hops.legs else hops.to_node[hop]
            soon, late = i + hops.lasts.least[hop], i + hops.lasts.most[hop]
            value = max(value_to_go[soon, state], value_to_go[late, state])
            cell = i * hop_count + hop
            for e in range(sightings.first[cell], sightings.first[cell + 1]):
                particle = sightings.particle[e]
                gain = sightings.reward[e] - prices[particle]
                if gain > 0.0:
                    value += gain * left[particle] * counted(sightings, e, NOTHING)
            most = max(most, value)
    return most


@compiled
def narrowed(
    sightings: SightingColumns, least: Floats, left: Floats, since: int
) -> SightingColumns:
    """Return the sightings from a cell on that earn more than the ``least`` of their particle.

    Their rewards are those of what is ``left`` (N,) of it, rounded up.
    """
    first = np.zeros(len(sightings.first), dtype=np.int64)
    # One more than can be left: each is written, and then kept or overwritten.
    most = sightings.first[-1] - sightings.first[since] + 1
    particle = np.empty(most, sightings.particle.dtype)
    reward = np.empty(most, sightings.reward.dtype)
    known, alike = np.empty(most, sightings.known.dtype), len(sightings.odds) == 1
    odds = sightings.odds if alike else np.empty((most, 2), sightings.odds.dtype)
    n = 0
    for cell in range(since, len(first) - 1):
        for e in range(sightings.first[cell], sightings.first[cell + 1]):
            particle[n], known[n] = sightings.particle[e], sightings.known[e]
            exact = sightings.reward[e] * left[particle[n]]
            reward[n] = exact
            if reward[n] < exact:
                reward[n] = np.nextafter(reward[n], np.float32(np.inf))
            if not alike:
                odds[n] = sightings.odds[e]
            n += sightings.reward[e] > least[particle[n]]
        first[cell + 1] = n
    odds = odds if alike else odds[:n]
    return SightingColumns(first, particle[:n], reward[:n], known[:n], odds)


@compiled
def best_sightings(sightings: SightingColumns, since: int, best: Floats) -> None:
    """Raise ``best`` (N,) to the most that a sighting from a cell on earns with each particle."""
    for e in range(sightings.first[since], sightings.first[-1]):
        particle = sightings.particle[e]
        best[particle] = max(best[particle], sightings.reward[e])


@compiled
def by_bin(sightings: SightingColumns, hops: int) -> SightingColumns:
    """Return sightings by cell that are sorted by hop and bin."""
    bins = (len(sightings.first) - 1) // hops
    first = np.zeros(len(sightings.first), dtype=np.int64)
    for i in range(bins):
        for hop in range(hops):
            cell, source = i * hops + hop, hop * bins + i
            count = sightings.first[source + 1] - sightings.first[source]
            first[cell + 1] = first[cell] + count
    particle, reward = np.empty_like(sightings.particle), np.empty_like(sightings.reward)
    known, alike = np.empty_like(sightings.known), len(sightings.odds) == 1
    odds = sightings.odds if alike else np.empty_like(sightings.odds)
    for i in range(bins):
        for hop in range(hops):
            n, source = first[i * hops + hop], hop * bins + i
            for e in range(sightings.first[source], sightings.first[source + 1]):
                particle[n], reward[n] = sightings.particle[e], sightings.reward[e]
                known[n] = sightings.known[e]
                if not alike:
                    odds[n] = sightings.odds[e]
                n += 1
    return SightingColumns(first, particle, reward, known, odds)
