"""Routes through the network: drawn turn by turn, or all that there are."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Frozen, Ints, Offsets, first_kept, first_rows, freeze
from planner.belief.prior import Prior, in_town
from planner.belief.uniforms import Columns
from planner.errors import InputError
from planner.network.road_network import RoadNetwork

MOST_ROUTES = 1_000_000
MOST_EDGES = 50_000_000  # over all routes
# How far routes in towns go on beyond the edge at the horizon, so that nobody is nearer to the end
# of a route than SUMO's driver looks ahead for the lanes to take: beyond 8 edges and 200 m, or the
# way to stop, or beyond 4 edges and 3 km.
AHEAD_EDGES = 10
AHEAD_M = 3000.0


@dataclass(frozen=True, eq=False)
class Starts:
    """Where targets begin and how fast."""

    edge: Offsets  # (N,) edge index
    distance_m: Floats  # (N,) metres along it
    speed_mps: Floats  # (N,) on it

    def __len__(self) -> int:
        return len(self.edge)

    def take(self, index: Offsets) -> "Starts":
        """Return some of the starts, in the order given."""
        return Starts(self.edge[index], self.distance_m[index], self.speed_mps[index])


@dataclass(frozen=True, eq=False)
class Routes:
    """Edges in driving order, one route after the other, with the speed on each."""

    first_edge: Offsets  # (N + 1,) where a route starts
    edge: Ints  # (M,) edge index
    speed_mps: Floats  # (M,)
    # (N,) metres along the last edge at which each ends; None: at the edge's end
    end_m: Floats | None = None


@dataclass(frozen=True, eq=False)
class PossibleTurns(Frozen):
    """The turns that a target takes with some probability, by the edge they leave."""

    first: Offsets  # (E + 1,) where an edge's turns start
    edge: Ints  # (T,) the edge that a turn leads to
    probability: Floats  # (T,)
    cumulative: Floats  # (T,) index of the edge left, plus the turns' probabilities up to this one

    def __post_init__(self) -> None:
        freeze(self, first=np.int64, edge=np.int32, probability=np.float64, cumulative=np.float64)

    @classmethod
    def of(cls, prior: Prior, network: RoadNetwork) -> "PossibleTurns":
        """Return the turns of a prior without those of probability zero."""
        some = prior.turn_probability > 0
        first = first_kept(network.first_turn, some)
        probability = prior.turn_probability[some]
        total = np.concatenate(([0.0], np.cumsum(probability)))
        left = np.repeat(np.arange(len(network.edge_ids)), np.diff(first))
        cumulative = np.asarray(left + total[1:] - total[first[left]], dtype=np.float64)
        return cls(first, network.turn_edge[some], probability, cumulative)

    @property
    def count(self) -> Offsets:
        """How many turns each edge has, (E,)."""
        return np.diff(self.first)

    def after(self, edge: Offsets | Ints, u: Floats) -> Ints:
        """Return the edges that the shares ``u`` of each edge's turns lead to."""
        turn = np.searchsorted(self.cumulative, edge + u, side="right")
        return self.edge[np.clip(turn, self.first[edge], self.first[edge + 1] - 1)]


def drawn_starts(prior: Prior, network: RoadNetwork, columns: Columns) -> Starts:
    """Return starts drawn as in lines 2 to 5 of Figure 5; takes three columns."""
    which, where = next(columns), next(columns)
    edge, distance_m = prior.starts(which, where, network.edge_length_m)
    speed_mps = prior.speed_mps.quantile(next(columns))
    return Starts(edge, np.minimum(distance_m, network.edge_length_m[edge]), speed_mps)


def drawn_routes(
    prior: Prior, network: RoadNetwork, starts: Starts, columns: Columns, horizon_s: float
) -> Routes:
    """Return one route for each start, drawn turn by turn.

    A route goes on to a sink, or to the edge on which its target is at the horizon; in towns at
    least `AHEAD_EDGES` and `AHEAD_M` further.

    Parameters
    ----------
    columns
        One is used for every turn, and one for every speed where it is drawn anew per road.
    """
    turns = PossibleTurns.of(prior, network)
    who, edge, speed = np.arange(len(starts)), starts.edge, starts.speed_mps
    time_s = (network.edge_length_m[edge] - starts.distance_m) / speed
    least_edges, least_m = (AHEAD_EDGES, AHEAD_M) if in_town(prior, network) else (0, 0.0)
    ahead_edges, ahead_m = np.zeros(len(who), np.int64), np.zeros(len(who))
    steps = [(who, edge, speed)]
    while True:
        too_short = (time_s < horizon_s) | (ahead_edges < least_edges) | (ahead_m < least_m)
        onward = (turns.count[edge] > 0) & too_short
        if not onward.any():
            return _one_after_the_other(steps)
        who, edge, speed, time_s = who[onward], edge[onward], speed[onward], time_s[onward]
        ahead_edges, ahead_m = ahead_edges[onward], ahead_m[onward]
        beyond = time_s >= horizon_s
        edge = turns.after(edge, next(columns)[who]).astype(np.int64)
        if prior.speed_per_road:
            speed = prior.speed_mps.quantile(next(columns)[who])
        time_s = time_s + network.edge_length_m[edge] / speed
        ahead_edges = ahead_edges + beyond
        ahead_m = ahead_m + beyond * network.edge_length_m[edge]
        steps.append((who, edge, speed))


def _one_after_the_other(steps: Sequence[tuple[Offsets, Offsets, Floats]]) -> Routes:
    """Return routes from what each particle does at each step; all take the first one."""
    length = np.zeros(len(steps[0][0]), dtype=np.int64)
    for who, _, _ in steps:
        length[who] += 1
    first = first_rows(length)
    edges = np.empty(first[-1], dtype=np.int32)
    speeds = np.empty(first[-1])
    for step, (who, edge, speed) in enumerate(steps):
        edges[first[who] + step] = edge
        speeds[first[who] + step] = speed
    return Routes(first, edges, speeds)


def most_turns(prior: Prior, network: RoadNetwork, horizon_s: float, *, limit: int) -> int:
    """Return how many turns any target can take before the horizon, at most ``limit``."""
    turns = PossibleTurns.of(prior, network)
    leaves = np.repeat(np.arange(len(network.edge_ids)), turns.count)
    reach_m = prior.speed_mps.high * horizon_s
    # The least a target has driven at the end of each edge, by the number of turns taken.
    driven_m = np.where(prior.edge_probability > 0, 0.0, np.inf)
    for taken in range(limit):
        possible = driven_m[leaves] < reach_m
        if not possible.any():
            return taken
        further_m = np.full(len(driven_m), np.inf)
        ends = turns.edge[possible]
        arrival_m = driven_m[leaves[possible]] + network.edge_length_m[ends]
        np.minimum.at(further_m, ends, arrival_m)
        driven_m = further_m
    return limit


def all_routes(
    prior: Prior, network: RoadNetwork, starts: Starts, horizon_s: float
) -> tuple[Offsets, Floats, Routes]:
    """Return every route from every start.

    Returns
    -------
    start
        (N,) which start each route belongs to, in the order of the starts and then of the turns.
    probability
        (N,) the product of the probabilities of the route's turns.
    routes
        N routes, each to a sink or to the edge on which its target is at the horizon.

    Raises
    ------
    InputError
        If there are more than `MOST_ROUTES`.
    """
    turns = PossibleTurns.of(prior, network)
    edge = starts.edge
    time_s = (network.edge_length_m[edge] - starts.distance_m) / starts.speed_mps
    start, probability = np.arange(len(starts)), np.ones(len(starts))
    # Each level holds, for each branch, the edge driven (-1: the route has ended) and the branch
    # of the level before from which it comes.
    levels = [(start, edge)]
    while True:
        onward = (edge >= 0) & (turns.count[edge] > 0) & (time_s < horizon_s)
        if not onward.any():
            break
        ways = np.where(onward, turns.count[edge], 1)
        refuse_too_many(int(ways.sum()), len(levels))
        parent = np.repeat(np.arange(len(edge)), ways)
        nth = np.arange(len(parent)) - np.repeat(np.cumsum(ways) - ways, ways)
        goes_on = onward[parent]
        turn = np.where(goes_on, turns.first[edge[parent]] + nth, 0)
        edge = np.where(goes_on, turns.edge[turn], -1)
        probability = probability[parent] * np.where(goes_on, turns.probability[turn], 1.0)
        start = start[parent]
        time_s = time_s[parent] + network.edge_length_m[edge] / starts.speed_mps[start]
        levels.append((parent, edge))
    return start, probability, _traced_back(levels, starts.speed_mps[start])


def refuse_too_many(routes: int, longest: int = 1) -> None:
    """Raise InputError where there are more routes, or longer ones, than memory should hold."""
    if routes > MOST_ROUTES or routes * longest > MOST_EDGES:
        raise InputError(
            f'search.sampling: "all" would make more than {MOST_ROUTES:,} routes; list fewer '
            'values, shorten search.horizon_s, or write "sobol"'
        )


def _traced_back(levels: Sequence[tuple[Offsets, Offsets]], speed_mps: Floats) -> Routes:
    branch: Offsets = np.arange(len(levels[-1][1]), dtype=np.int64)
    backwards: list[Ints] = []
    for parent, edge in reversed(levels):
        backwards.append(edge[branch].astype(np.int32))
        branch = parent[branch]
    edges = np.stack(backwards[::-1], axis=1)  # (N, levels), -1 after a route's end
    driven = edges >= 0
    length = driven.sum(axis=1)
    first = first_rows(length)
    return Routes(first, edges[driven], np.repeat(speed_mps, length))
