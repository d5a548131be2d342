"""The assessed state of the target at a time: x_k = [r_k, d_k, v_k] of every particle."""

from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Frozen, Ints, freeze
from planner.checked import number
from planner.futures.edges_driven import NO_EDGE
from planner.futures.futures import Futures
from planner.network.road_network import RoadNetwork

QUANTILES = (0.05, 0.5, 0.95)


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
    """What is believed of the target on one edge; quantiles as ``QUANTILES`` names them."""

    edge: str
    probability: float
    distance_m: tuple[float, ...]
    speed_mps: tuple[float, ...]


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
        distance_m=np.array(
            [_along(network, e, point) for e, point in zip(edge, xy_m, strict=True)], dtype=float
        ),
        speed_mps=_speeds(futures, there, knot, time_s),
    )


def by_road(state: State, network: RoadNetwork) -> list[RoadState]:
    """Return the state road by road, the most probable first."""
    rows = []
    for edge in np.unique(state.edge):
        on = state.edge == edge
        rows.append(
            RoadState(
                edge="unknown" if edge == NO_EDGE else network.edge_ids[edge],
                probability=float(state.weight[on].sum()),
                distance_m=_quantiles(state.distance_m[on], state.weight[on]),
                speed_mps=_quantiles(state.speed_mps[on], state.weight[on]),
            )
        )
    return sorted(rows, key=lambda row: -row.probability)


def _speeds(futures: Futures, particle: Ints, knot: Ints, time_s: float) -> Floats:
    resting = futures.end_s[particle] <= time_s
    onward = np.where(resting, knot, knot + 1)
    step_m = np.hypot(
        futures.x_m[onward] - futures.x_m[knot], futures.y_m[onward] - futures.y_m[knot]
    )
    step_s = np.where(resting, 1.0, futures.time_s[onward] - futures.time_s[knot])
    return np.asarray(step_m / step_s)


def _along(network: RoadNetwork, edge: int, point: Floats) -> float:
    """Distance along an edge of the point on it that is nearest to a given one, metres."""
    if edge == NO_EDGE:
        return np.nan
    shape = network.edge_shape(edge)
    step = np.diff(shape, axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    share = np.einsum("ij,ij->i", point - shape[:-1], step) / np.maximum(length**2, 1e-12)
    share = np.clip(share, 0.0, 1.0)
    off = np.linalg.norm(shape[:-1] + step * share[:, None] - point, axis=1)
    nearest = int(np.argmin(off))
    drawn_m = length[:nearest].sum() + length[nearest] * share[nearest]
    return float(drawn_m * network.edge_length_m[edge] / length.sum())


def _quantiles(values: Floats, weight: Floats) -> tuple[float, ...]:
    order = np.argsort(values, kind="stable")
    reached = np.cumsum(weight[order])
    at = np.searchsorted(reached, np.array(QUANTILES) * reached[-1] * (1 - 1e-12))
    return tuple(float(value) for value in values[order][np.minimum(at, len(values) - 1)])
