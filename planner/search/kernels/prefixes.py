"""Prefixes of orders of legs, flown exactly; compiled.

A prefix is the beginning of an order of legs. Its state fills one slot of ``PrefixStates``: flying
one leg more makes the state in another slot, and all orders that begin alike share the work.

Motion comes in pieces, one row each, with the columns of ``kernels.motion``. Laid out once, they
spare the millions of flights to come all divisions but the last.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import Rows, Vector, first_within, while_within
from planner.detection.kernels.worth import mean_time
from planner.jit import compiled
from planner.search.kernels.motion import BEGIN, END, VX, VY, X, Y


class TimedPlace(NamedTuple):
    """A time and a place."""

    time_s: float
    x_m: float
    y_m: float


class Case(NamedTuple):
    """A problem's columns; place V is where the UAV takes off, the others are nodes."""

    from_node: Ints  # (L,)
    to_node: Ints  # (L,)
    duration_s: Floats  # (L,) seconds to fly the road
    first_leg_piece: Offsets  # (L + 1,)
    leg_pieces: Floats  # (Q, 6) seconds since the leg's start
    place_xy_m: Floats  # (V + 1, 2)
    transit_s: Floats  # (V + 1, V) seconds of straight flight from place to node
    home_s: Floats  # (V + 1,) seconds of straight flight from place to the landing
    first_piece: Offsets  # (N + 1,)
    pieces: Floats  # (K, 6) of the particles, seconds on the target's clock
    weight: Floats  # (N,)
    until_s: Floats  # (N,) last second at which seeing the particle earns something
    home_xy_m: Floats  # (2,) where the UAV has to land, NaN: anywhere
    speed_mps: float  # of the UAV
    radius_m: float
    ends_s: float  # last second at which seeing any particle earns something
    miss_cost: float  # what a particle costs that is not seen by then
    timed: bool  # one that is seen costs the second at which it is, else nothing
    tie: float  # values this close are equal
    landing_s: float
    in_transit: bool  # the sensor is on between roads too
    rate_per_s: float  # of detection within the radius; infinity: a perfect sensor


class PrefixStates(NamedTuple):
    """What has come of prefixes, one slot each; slot 0 is the take-off."""

    place: Ints  # (S,)
    time_s: Floats  # (S,)
    settled: Floats  # (S,) sum of weight * cost over all that is no longer open
    open: Ints  # (S, N) first the particles that are unseen and can still be seen
    opens: Ints  # (S,) how many these are
    miss: Floats  # (S, N) how probably each of these is unseen; (S, 0) if the sensor is perfect
    flight: Floats  # (F, 6) room for the pieces of one flight


@compiled
def fly(case: Case, states: PrefixStates, before: int, leg: int, after: int) -> bool:
    """Put the state after one leg more into slot ``after``; False if the UAV lands before."""
    transit_s = case.transit_s[states.place[before], case.from_node[leg]]
    end_s = states.time_s[before] + transit_s + case.duration_s[leg]
    if end_s + case.home_s[case.to_node[leg]] > case.landing_s:
        return False
    rows = lay_flight(case, states, before, leg)
    flight, pieces, first = states.flight, case.pieces, case.first_piece
    settled = states.settled[before]
    opens = 0
    for i in range(states.opens[before]):
        k = states.open[before, i]
        particle = Rows(first[k], first[k + 1])
        if case.rate_per_s < np.inf:
            costs, miss = contacts_in_flight(case, flight, rows, particle, states.miss[before, i])
            settled += case.weight[k] * costs
            if case.until_s[k] <= end_s:
                settled += case.weight[k] * miss * case.miss_cost
            else:
                states.open[after, opens], states.miss[after, opens] = k, miss
                opens += 1
            continue
        seen_s = meeting_in_flight(flight, rows, pieces, particle, case.radius_m)
        if seen_s <= case.ends_s:
            settled += case.weight[k] * cost(case, seen_s)
        elif case.until_s[k] <= end_s:
            settled += case.weight[k] * case.miss_cost
        else:
            states.open[after, opens] = k
            opens += 1
    states.place[after] = case.to_node[leg]
    states.time_s[after] = end_s
    states.settled[after] = settled
    states.opens[after] = opens
    return True


@compiled
def cost(case: Case, seen_s: float) -> float:
    """Return what a particle costs that is seen in time."""
    return seen_s if case.timed else 0.0


@compiled
def lay_flight(case: Case, states: PrefixStates, before: int, leg: int) -> int:
    """Lay out the flight to a leg and along it, where the sensor is on; return its pieces."""
    flight, place, depart_s = states.flight, states.place[before], states.time_s[before]
    start_s = depart_s + case.transit_s[place, case.from_node[leg]]
    rows = 0
    if case.in_transit and start_s > depart_s:
        x, y = case.place_xy_m[place]
        to_x, to_y = case.place_xy_m[case.from_node[leg]]
        lay_straight(flight, TimedPlace(depart_s, x, y), TimedPlace(start_s, to_x, to_y))
        rows = 1
    for piece in range(case.first_leg_piece[leg], case.first_leg_piece[leg + 1]):
        flight[rows] = case.leg_pieces[piece]
        flight[rows, BEGIN] += start_s
        flight[rows, END] += start_s
        rows += 1
    return rows


@compiled
def lay_straight(flight: Floats, start: TimedPlace, end: TimedPlace) -> None:
    """Lay out the straight flight from one time and place to another as the first piece."""
    lasts_s = end.time_s - start.time_s
    flight[0, X], flight[0, Y] = start.x_m, start.y_m
    flight[0, VX] = (end.x_m - start.x_m) / lasts_s
    flight[0, VY] = (end.y_m - start.y_m) / lasts_s
    flight[0, BEGIN], flight[0, END] = start.time_s, end.time_s


@compiled
def meeting_in_flight(
    flight: Floats, rows: int, pieces: Floats, particle: Rows, radius_m: float
) -> float:
    """Return the first second at which a flight has a particle within the radius, or infinity.

    Parameters
    ----------
    rows
        The pieces of the flight, from row 0 on.
    particle
        Its pieces.
    """
    i, (k, end) = 0, particle
    while k < end and pieces[k, END] < flight[0, BEGIN]:
        k += 1
    while i < rows and k < end:
        beside = together(flight, i, pieces, k)
        if beside.lasts_s >= 0.0:
            after_s = first_within(beside.offset, beside.drift, beside.lasts_s, radius_m)
            if after_s < np.inf:
                return float(beside.from_s + after_s)
        if flight[i, END] < pieces[k, END]:
            i += 1
        else:
            k += 1
    return np.inf


class Beside(NamedTuple):
    """Two straight motions while both go on."""

    from_s: float  # seconds on the target's clock
    lasts_s: float  # negative: they never are
    offset: Vector  # of the particle from the UAV, metres
    drift: Vector  # metres per second


@compiled
def together(flight: Floats, i: int, pieces: Floats, k: int) -> Beside:
    """Return how a particle moves as seen from the UAV, in a piece of either motion."""
    from_s = max(flight[i, BEGIN], pieces[k, BEGIN])
    lasts_s = min(flight[i, END], pieces[k, END]) - from_s
    flown_s, driven_s = from_s - flight[i, BEGIN], from_s - pieces[k, BEGIN]
    vx, vy = pieces[k, VX] - flight[i, VX], pieces[k, VY] - flight[i, VY]
    x = pieces[k, X] + pieces[k, VX] * driven_s - flight[i, X] - flight[i, VX] * flown_s
    y = pieces[k, Y] + pieces[k, VY] * driven_s - flight[i, Y] - flight[i, VY] * flown_s
    return Beside(from_s, lasts_s, (x, y), (vx, vy))


@compiled
def contacts_in_flight(
    case: Case, flight: Floats, rows: int, particle: Rows, miss: float
) -> tuple[float, float]:
    """Return what a particle costs that a flight may see, times how probably, and what is left.

    As `meeting_in_flight`, for a sensor that misses; exposures add up over the pieces.

    Parameters
    ----------
    miss
        How probably it is unseen before.
    """
    costs, (k, end), i = 0.0, particle, 0
    while k < end and case.pieces[k, END] < flight[0, BEGIN]:
        k += 1
    while i < rows and k < end:
        beside = together(flight, i, case.pieces, k)
        if beside.lasts_s >= 0.0:
            within = while_within(beside.offset, beside.drift, beside.lasts_s, case.radius_m)
            from_s, to_s = beside.from_s + within.from_s, beside.from_s + within.to_s
            if from_s < min(to_s, case.ends_s):
                seen, passes = cost_of_contact(case, from_s, min(to_s, case.ends_s))
                costs += miss * seen
                miss *= passes
        if flight[i, END] < case.pieces[k, END]:
            i += 1
        else:
            k += 1
    return costs, miss


@compiled
def cost_of_contact(case: Case, from_s: float, to_s: float) -> tuple[float, float]:
    """Return what a particle costs that a contact may see, times how probably, and what is left."""
    passes = np.exp(-case.rate_per_s * (to_s - from_s))
    return (1.0 - passes) * cost(case, mean_time(from_s, to_s, case.rate_per_s)), passes


@compiled
def value(case: Case, states: PrefixStates, slot: int) -> float:
    """Return the mean cost if the UAV flies no further, but home if it has to."""
    place, time_s = states.place[slot], states.time_s[slot]
    home_s = case.home_s[place]
    looks = case.in_transit and home_s > 0.0 and time_s + home_s <= case.landing_s
    if looks:
        x, y = case.place_xy_m[place]
        end = TimedPlace(time_s + home_s, case.home_xy_m[0], case.home_xy_m[1])
        lay_straight(states.flight, TimedPlace(time_s, x, y), end)
    settled, rest = states.settled[slot], 0.0
    for i in range(states.opens[slot]):
        k = states.open[slot, i]
        particle, seen_s = Rows(case.first_piece[k], case.first_piece[k + 1]), np.inf
        if case.rate_per_s < np.inf:
            miss = states.miss[slot, i]
            if looks:
                costs, miss = contacts_in_flight(case, states.flight, 1, particle, miss)
                settled += case.weight[k] * costs
            rest += case.weight[k] * miss
            continue
        if looks:
            seen_s = meeting_in_flight(states.flight, 1, case.pieces, particle, case.radius_m)
        if seen_s <= case.ends_s:
            settled += case.weight[k] * cost(case, seen_s)
        else:
            rest += case.weight[k]
    return float(settled + rest * case.miss_cost)
