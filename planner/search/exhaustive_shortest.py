"""The shortest exhaustive search: every road once, in either direction, precedence kept."""

import logging
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planner.arrays import Ints
from planner.flight.legs import Legs
from planner.search.exhaustive import topological_search
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult

log = logging.getLogger(__name__)

Sets = npt.NDArray[np.uint64]
Costs = npt.NDArray[np.int64]

# A cost is one whole number that orders first by time, then by movements: microseconds of extra
# flight times MOVEMENTS plus the number of movements. Whole numbers make ties exact.
MOVEMENTS = 1 << 12
NEVER = 1 << 62
# A layer's work is its sets times nodes squared. Within this much over all layers the search is
# exact (the paper's grid of 60 roads is); beyond it a layer keeps only its best sets.
WORK = 1_000_000_000
LEAST_WIDTH = 64


@dataclass(frozen=True, eq=False)
class Ground:
    """What the search stands on: R roads, V nodes and, as the last place, the UAV's start."""

    road_from: Ints  # (R,) node
    road_to: Ints  # (R,) node
    hop: Costs  # (V + 1, V) cost of flying straight from a place to a node
    bit: Sets  # (R, words) the set of that road alone
    before: Sets  # (R, words) the roads that must be flown earlier: all into the road's start


@dataclass(frozen=True, eq=False)
class Layer:
    """All sets of k roads that can be flown first, and the least cost of having done so."""

    sets: Sets  # (m, words)
    cost: Costs  # (m, V + 1) by the place where the UAV is; NEVER where it cannot be


def exhaustive_shortest(
    problem: Problem,
    *,
    budget: Budget,  # noqa: ARG001
    rng: np.random.Generator,  # noqa: ARG001
) -> SearchResult:
    """Return the plan that flies every road once with the least extra flight time.

    Extra is the straight flight to the first road and between the end of a road and the start of
    the next where these differ; among equal times the plan has the fewest such movements. A road
    is flown in either direction, but only after all roads into its start, so that it finds every
    target that only follows the roads or stops (Section 3 of the paper, whose own optimised
    order on Figure 1 has two movements where one is enough). Neither futures nor budget change
    it.

    Raises
    ------
    NotApplicableError
        If the network has a cycle, which is named.
    """
    order, proven = shortest_order(problem)
    if not proven:
        log.info("exhaustive-shortest: the network is large, a shorter order may exist")
    return SearchResult(plan_of_legs(problem, "exhaustive-shortest", order))


def shortest_order(problem: Problem, *, width: int | None = None) -> tuple[list[int], bool]:
    """Return the legs of the shortest exhaustive search, and whether that is proven.

    Dynamic programming over the sets of roads that can be flown first (those closed under
    precedence), by their number of roads, and the node where the UAV then is. It is exact unless
    a layer has more than ``width`` sets. Then it is a beam: the sets go on that promise most by
    their cost and the least number of flights without a gap that the roads left over need. Grids
    of up to 60 roads are exact, with at most 6,071 sets in a layer. On one of 112 roads the beam
    finds an order as short as the optima of smaller ones let expect; on one of 480, at the least
    width, its extra flight is 1.7 times that.

    Parameters
    ----------
    width
        Sets kept in a layer; by default as many as keep the work within a few seconds.
    """
    topological_search(problem.network)  # tells the cycle, if there is one
    ground = _ground(problem)
    roads, nodes = len(ground.road_from), ground.hop.shape[1]
    if width is None:
        width = max(LEAST_WIDTH, WORK // (roads * nodes**2))
    cost = np.full((1, nodes + 1), NEVER, dtype=np.int64)
    cost[0, nodes] = 0
    layers = [Layer(np.zeros((1, ground.bit.shape[1]), dtype=np.uint64), cost)]
    proven = True
    for _ in range(roads):
        layer = _grown(layers[-1], ground)
        proven = proven and len(layer.sets) <= width
        layers.append(_best(layer, ground, width))
    return _traced(layers, ground), proven


def _ground(problem: Problem) -> Ground:
    network, uav = problem.network, problem.uav_at_start
    places = np.vstack([network.node_xy_m, [uav.x_m, uav.y_m]])
    offset = places[:, None] - network.node_xy_m
    seconds = np.hypot(offset[..., 0], offset[..., 1]) / uav.speed_mps
    hop = np.rint(seconds * 1e6).astype(np.int64) * MOVEMENTS
    hop[:-1] += seconds[:-1] > 0  # the flight to the first road is no movement between roads
    bit = _bits(len(network.road_ids))
    into_start = network.road_to == network.road_from[:, None]
    before = np.bitwise_or.reduce(np.where(into_start[..., None], bit, np.uint64(0)), axis=1)
    return Ground(network.road_from, network.road_to, hop, bit, before)


def _bits(roads: int) -> Sets:
    """Return one set per road with that road alone, (R, words)."""
    road = np.arange(roads)
    bit = np.zeros((roads, -(-roads // 64)), dtype=np.uint64)
    bit[road, road // 64] = np.uint64(1) << (road % 64).astype(np.uint64)
    return bit


def _grown(layer: Layer, ground: Ground) -> Layer:
    """Return the next layer: every set with one more road, flown in either direction."""
    ready = _ready(layer.cost, ground.hop)
    grows = [_may_grow(layer.sets, ground, road) for road in range(len(ground.bit))]
    larger = [layer.sets[rows] | ground.bit[road] for road, rows in enumerate(grows)]
    sets, index = np.unique(np.concatenate(larger), axis=0, return_inverse=True)
    target = np.split(index.reshape(-1), np.cumsum([len(rows) for rows in grows])[:-1])
    cost = np.full((len(sets), layer.cost.shape[1]), NEVER, dtype=np.int64)
    for rows, to, first, last in zip(grows, target, ground.road_from, ground.road_to, strict=True):
        cost[to, last] = np.minimum(cost[to, last], ready[rows, first])
        cost[to, first] = np.minimum(cost[to, first], ready[rows, last])
    return Layer(sets, cost)


def _ready(cost: Costs, hop: Costs) -> Costs:
    """Return the least cost of being at each node after a hop from anywhere, (m, V)."""
    ready = np.full((len(cost), hop.shape[1]), NEVER, dtype=np.int64)
    for place, hops in enumerate(hop):
        rows = np.flatnonzero(cost[:, place] < NEVER)
        ready[rows] = np.minimum(ready[rows], cost[rows, place, None] + hops)
    return ready


def _may_grow(sets: Sets, ground: Ground, road: int) -> npt.NDArray[np.int64]:
    """Return the rows whose set lacks a road and holds all that precede it."""
    lacks = ((sets & ground.bit[road]) == 0).all(axis=1)
    holds = ((ground.before[road] & ~sets) == 0).all(axis=1)
    return np.flatnonzero(lacks & holds)


def _best(layer: Layer, ground: Ground, width: int) -> Layer:
    """Return the most promising sets of a layer, ranked by cost plus what they still need."""
    if len(layer.sets) <= width:
        return layer
    road = np.arange(len(ground.bit))
    word, place = road // 64, (road % 64).astype(np.uint64)
    left = ((layer.sets[:, word] >> place) & np.uint64(1)) == 0
    ends = np.zeros((len(road), ground.hop.shape[1]), dtype=np.float32)
    ends[road, ground.road_from] += 1
    ends[road, ground.road_to] += 1
    # Roads with 2 k nodes of odd degree take k flights without a gap.
    flights = ((left.astype(np.float32) @ ends) % 2).sum(axis=1) / 2
    hops = ground.hop[:-1][ground.hop[:-1] > 0]
    least = hops.min() if len(hops) else 0
    rank = layer.cost.min(axis=1) + flights.astype(np.int64) * least
    rows = np.sort(np.argsort(rank, kind="stable")[:width])
    return Layer(layer.sets[rows], layer.cost[rows])


def _traced(layers: list[Layer], ground: Ground) -> list[int]:
    """Return the legs that lead to the last layer's least cost, found from the end."""
    row, place = 0, int(layers[-1].cost[0].argmin())
    legs: list[int] = []
    for layer, earlier in zip(layers[:0:-1], layers[-2::-1], strict=True):
        leg, row, place = _last_leg(layer, row, place, earlier, ground)
        legs.append(leg)
    return legs[::-1]


def _last_leg(
    layer: Layer, row: int, place: int, earlier: Layer, ground: Ground
) -> tuple[int, int, int]:
    """Return a leg that ends at a place at its set's cost, and the row and place before it."""
    flown = layer.sets[row]
    for road in np.flatnonzero(((flown & ground.bit) != 0).any(axis=1)).tolist():
        ends = (int(ground.road_from[road]), int(ground.road_to[road]))
        for leg, (start, end) in zip(Legs.both(road), (ends, ends[::-1]), strict=True):
            if end != place:
                continue
            for less in np.flatnonzero((earlier.sets == flown ^ ground.bit[road]).all(axis=1)):
                paid = earlier.cost[less] + ground.hop[:, start]
                if paid.min() == layer.cost[row, place]:
                    return leg, int(less), int(paid.argmin())
    raise AssertionError("a cost without a leg that made it")
