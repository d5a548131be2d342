"""The assessed state of the target at a time: x_k = [r_k, d_k, v_k] of every particle."""

from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Frozen, Ints, freeze
from planner.checked import number
from planner.futures.edges_driven import NO_EDGE
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork

QUANTILES = (0.05, 0.5, 0.95)
MEDIAN = QUANTILES.index(0.5)
UNKNOWN = "unknown"  # the road of particles whose edges no file names


@dataclass(frozen=True, eq=False)
class State(Frozen):
    """Where particles are at one time; S of them are somewhere."""

    time_s: float
    particle: Ints  # (S,) which particles are there: not gone, not still to come
    weight: Floats  # (S,) probability
    xy_m: Floats  # (S, 2) metres
    edge: Ints  # (S,) edge index, NO_EDGE where unknown
    distance_m: Floats  # (S,) metres along the edge, NaN where the edge is unknown
    speed_mps: Floats  # (S,) m/s, zero for a particle at rest at its end

    def __post_init__(self) -> None:
        freeze(
            self,
            particle=np.int32,
            weight=np.float64,
            xy_m=np.float64,
            edge=np.int32,
            distance_m=np.float64,
            speed_mps=np.float64,
        )

    @property
    def elsewhere_probability(self) -> float:
        """Probability that the target is gone, never was there, or has not set out yet."""
        return max(0.0, 1.0 - float(self.weight.sum()))


@dataclass(frozen=True)
class RoadState:
    """What is believed of the target on one road; quantiles as ``QUANTILES`` names them."""

    road: str  # UNKNOWN where no edge is
    edge: str  # that of the road on which it is likeliest
    probability: float
    distance_m: tuple[float, ...]  # along the road from its start; NaN where that is unknown
    speed_mps: tuple[float, ...]
    xy_m: tuple[float, float]  # the place that has the median distance
    target: str = ""  # which of several targets it is of; empty: there is one


def state_at(futures: Futures, network: RoadNetwork, time_s: float) -> State:
    """Return the state of all particles at a time, seconds on the target's clock."""
    time_s = number("time_s", time_s)
    everyone_m = futures.positions(time_s)
    there = np.flatnonzero(~np.isnan(everyone_m[:, 0]))
    passed = np.bincount(futures.particle[futures.time_s <= time_s], minlength=len(futures))
    knot = (futures.first_knot[:-1] + passed - 1)[there]
    xy_m, edge = everyone_m[there], futures.edges.at(time_s)[there]
    return State(
        time_s=time_s,
        particle=there,
        weight=futures.weight[there],
        xy_m=xy_m,
        edge=edge,
        distance_m=_along_edges(network, edge, xy_m),
        speed_mps=_speeds(futures, there, knot, time_s),
    )


def by_road(state: State, network: RoadNetwork) -> list[RoadState]:
    """Return the state road by road, the most probable first."""
    rows = []
    roads = np.where(state.edge == NO_EDGE, NO_EDGE, network.edge_road[state.edge])
    along_m = _along_roads(state, network, roads)
    for road in np.unique(roads):
        on = np.flatnonzero(roads == road)
        weight, edges = state.weight[on], state.edge[on]
        likeliest = int(np.bincount(edges - NO_EDGE, weight).argmax()) + NO_EDGE
        middle = on[_at_quantiles(along_m[on], weight)[MEDIAN]]
        x_m, y_m = map(float, state.xy_m[middle])
        rows.append(
            RoadState(
                road=UNKNOWN if road == NO_EDGE else network.road_ids[road],
                edge=UNKNOWN if road == NO_EDGE else network.edge_ids[likeliest],
                probability=float(weight.sum()),
                distance_m=_quantiles(along_m[on], weight),
                speed_mps=_quantiles(state.speed_mps[on], weight),
                xy_m=(x_m, y_m),
            )
        )
    return sorted(rows, key=lambda row: -row.probability)


def _along_roads(state: State, network: RoadNetwork, roads: Ints) -> Floats:
    """Return how far along its road each particle is, (S,) metres; NaN where it is on none."""
    if not network.is_merged:
        return state.distance_m
    found = [
        np.nan if road == NO_EDGE else _along(network.shape(road), network.road_length_m[road], xy)
        for road, xy in zip(roads, state.xy_m, strict=True)
    ]
    return np.array(found, dtype=float)


def _speeds(futures: Futures, particle: Ints, knot: Ints, time_s: float) -> Floats:
    resting = futures.end_s[particle] <= time_s
    onward = np.where(resting, knot, knot + 1)
    step_m = np.hypot(
        futures.x_m[onward] - futures.x_m[knot], futures.y_m[onward] - futures.y_m[knot]
    )
    step_s = np.where(resting, 1.0, futures.time_s[onward] - futures.time_s[knot])
    return np.asarray(step_m / step_s)


def _along_edges(network: RoadNetwork, edges: Ints, xy_m: Floats) -> Floats:
    """Return how far along its edge each place is, (S,) metres; NaN where the edge is unknown."""
    found = [
        np.nan if e == NO_EDGE else _along(network.edge_shape(e), network.edge_length_m[e], point)
        for e, point in zip(edges, xy_m, strict=True)
    ]
    return np.array(found, dtype=float)


def _along(shape: Floats, length_m: float, point: Floats) -> float:
    """Distance along a line of the point on it that is nearest to a given one, metres.

    Parameters
    ----------
    length_m
        What the whole line measures, which may differ from what is drawn.
    """
    step = np.diff(shape, axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    share = np.einsum("ij,ij->i", point - shape[:-1], step) / np.maximum(length**2, 1e-12)
    share = np.clip(share, 0.0, 1.0)
    off = np.linalg.norm(shape[:-1] + step * share[:, None] - point, axis=1)
    nearest = int(np.argmin(off))
    drawn_m = length[:nearest].sum() + length[nearest] * share[nearest]
    return float(drawn_m * length_m / length.sum())


def _quantiles(values: Floats, weight: Floats) -> tuple[float, ...]:
    return tuple(float(value) for value in values[_at_quantiles(values, weight)])


def _at_quantiles(values: Floats, weight: Floats) -> Ints:
    """Return where the quantiles of weighted values stand among them, one for each."""
    order = np.argsort(values, kind="stable")
    reached = np.cumsum(weight[order])
    at = np.searchsorted(reached, np.array(QUANTILES) * reached[-1] * (1 - 1e-12))
    return np.asarray(order[np.minimum(at, len(values) - 1)])
