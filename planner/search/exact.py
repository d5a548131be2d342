"""The best of all orders and directions of a small net's roads, and what each of them achieves."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner.arrays import Floats, Frozen, freeze
from planner.errors import NotApplicableError
from planner.flight.legs import Legs
from planner.futures.futures import Pieces
from planner.search.kernels.exact import TIE_S, Tree, branch, fly_orders, search
from planner.search.kernels.prefixes import Case, PrefixStates, value
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult
from planner.search.what_if import rows_of

MOST_ORDERS = 2**8 * math.factorial(8)  # 10,321,920: seconds by branch and bound, a minute flown
STEPS_AT_A_TIME = 100  # prefixes between two looks at the keyboard
TIE_SHARE = 1e-12  # probabilities this close are equal


def exact(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:  # noqa: ARG001
    """Return the plan that serves the objective best, of all orders and directions of the roads.

    Each road is flown at most once, straight from the end of one to the start of the next; by
    branch and bound over the prefixes of orders. Roads that earn nothing on these futures come
    last, the nearest first, for targets that the futures do not know; but a UAV that has to come
    home does so at once, as what it sees on that way counts.

    Raises
    ------
    NotApplicableError
        If there are more than ``MOST_ORDERS`` orders of as many roads as the budget allows, or the
        aircraft is a real one, which corners delay.
    """
    if problem.uav.aircraft is not None:
        raise NotApplicableError("exact is for the ideal aircraft, which turns at once; take best")
    roads = len(problem.network.road_ids)
    most_legs = min(roads, budget.roads)
    _refuse_too_many(roads, most_legs)
    order, _ = best_order(problem, most_legs)
    if problem.uav.return_to_m is None:
        order = (*order, *_nearest_next(problem, order))[:most_legs]
    return SearchResult(plan_of_legs(problem, "exact", order))


def number_of_orders(roads: int, flown: int | None = None) -> int:
    """Return in how many orders and directions some of R roads can be flown; by default all.

    For k of them that is 2^k R! / (R - k)!, for all of them 2^R R! (Section 4.1).
    """
    flown = roads if flown is None else flown
    return int(2**flown * math.perm(roads, flown))


def best_order(problem: Problem, most_legs: int) -> tuple[tuple[int, ...], float]:
    """Return the legs that are worth flying, ``most_legs`` at most, and the objective's value.

    No order of as many legs is better by more than a microsecond, or by 1e-12 where the value is
    a probability. How long this takes depends on the net and the futures, not on ``MOST_ORDERS``.
    """
    case = _case(problem)
    legs = len(case.from_node)
    states = _states(problem, case, 1 + most_legs * legs)
    tree = Tree(
        bound=np.full((most_legs, legs), np.inf),
        prefix=np.zeros(most_legs, np.int32),
        flown=np.zeros(len(problem.network.road_ids), np.bool_),
        best=np.full(most_legs, -1, np.int32),
    )
    if most_legs == 0:
        return (), float(_own_figure(problem, value(case, states, 0)))
    depth = 0
    best = branch(case, states, tree, 0, value(case, states, 0))
    while depth >= 0:
        depth, best = search(case, states, tree, depth, best, STEPS_AT_A_TIME)
    return tuple(int(leg) for leg in tree.best if leg >= 0), float(_own_figure(problem, best))


def _own_figure(problem: Problem, cost: Floats | float) -> Floats | float:
    """Return the objective's figure for costs: seconds as they are, or how probably it is found.

    Of several targets it is how many of them are.
    """
    return cost if problem.objective.by_s is None else problem.objective.sought - cost


@dataclass(frozen=True, eq=False)
class OrderValues(Frozen):
    """The value of every order and direction of R roads, in rising order of their legs."""

    roads: int
    value: Floats  # (2^R R!,) E[min(tau, horizon)] in seconds, or the probability by a deadline

    def __post_init__(self) -> None:
        freeze(self, value=np.float64)
        assert len(self) == number_of_orders(self.roads)

    def __len__(self) -> int:
        return len(self.value)

    def order(self, index: int) -> tuple[int, ...]:
        """Return the legs whose value stands at an index."""
        left = list(range(2 * self.roads))
        order: list[int] = []
        while left:
            place, index = divmod(index, number_of_orders(len(left) // 2 - 1))
            order.append(left[place])
            left = [leg for leg in left if Legs.road(leg) != Legs.road(order[-1])]
        return tuple(order)


def enumerate_orders(problem: Problem) -> OrderValues:
    """Return the value of every order and direction in which all roads can be flown.

    Orders that begin alike share the work. What would end after the UAV's landing is not flown,
    nor what follows it.

    Raises
    ------
    NotApplicableError
        If there are more than ``MOST_ORDERS`` orders.
    """
    roads = len(problem.network.road_ids)
    _refuse_too_many(roads, roads)
    case = _case(problem)
    states = _states(problem, case, roads + 1)
    alike = np.array([number_of_orders(roads - flown) for flown in range(roads + 1)])
    costs = np.empty((len(problem.legs), alike[1]))
    for first in range(len(problem.legs)):
        fly_orders(case, states, first, alike, costs[first])
    return OrderValues(roads, np.asarray(_own_figure(problem, costs.ravel())))


def _refuse_too_many(roads: int, flown: int) -> None:
    orders = number_of_orders(roads, flown)
    if orders > MOST_ORDERS:
        text = f"{orders:,}" if orders < 10**15 else f"10^{len(str(orders)) - 1}"
        raise NotApplicableError(
            f"the {roads} roads can be flown in {text} orders and directions of {flown}, "
            f"more than the {MOST_ORDERS:,} that are searched; take a smaller net"
        )


def _nearest_next(problem: Problem, order: tuple[int, ...]) -> Iterator[int]:
    """Yield the legs that an order leaves out, each road once, the nearest start first."""
    legs = problem.legs
    x_m, y_m = problem.first_state.x_m, problem.first_state.y_m
    if order:
        x_m, y_m = legs.node_xy_m[legs.to_node[order[-1]]]
    left = np.ones(len(legs), dtype=bool)
    for leg in order:
        left[[leg, Legs.reverse(leg)]] = False
    while left.any():
        leg = int(np.argmin(np.where(left, legs.transit_s(x_m, y_m), np.inf)))
        left[[leg, Legs.reverse(leg)]] = False
        x_m, y_m = legs.node_xy_m[legs.to_node[leg]]
        yield leg


def _case(problem: Problem) -> Case:
    legs, uav, futures = problem.legs, problem.uav_at_start, problem.futures
    place_xy_m = np.vstack([legs.node_xy_m, [[uav.x_m, uav.y_m]]])
    offset = place_xy_m[:, np.newaxis] - legs.node_xy_m
    points = Pieces.between(legs.after_s, legs.x_m, legs.y_m, legs.first_point)
    inner = np.delete(np.arange(len(legs.x_m)), legs.first_point[1:] - 1)
    objective = problem.objective
    until_s = np.where(futures.gone, futures.end_s, objective.ends_s)
    home_m = np.full(2, np.nan) if uav.return_to_m is None else np.array(uav.return_to_m)
    home_s = np.hypot(*(place_xy_m - home_m).T) / uav.speed_mps
    return Case(
        from_node=legs.from_node,
        to_node=legs.to_node,
        duration_s=legs.duration_s,
        first_leg_piece=legs.first_point - np.arange(len(legs) + 1),
        leg_pieces=rows_of(points)[inner],
        place_xy_m=place_xy_m,
        transit_s=np.hypot(offset[..., 0], offset[..., 1]) / uav.speed_mps,
        home_s=np.nan_to_num(home_s, nan=0.0),
        home_xy_m=home_m,
        first_piece=futures.first_knot,
        pieces=rows_of(futures.pieces),
        weight=problem.weight_at_start,
        until_s=np.minimum(until_s, objective.ends_s),
        speed_mps=float(uav.speed_mps),
        radius_m=float(problem.sensor.radius_m),
        ends_s=float(objective.ends_s),
        miss_cost=float(objective.most),
        timed=problem.objective.by_s is None,
        tie=TIE_S if problem.objective.by_s is None else TIE_SHARE,
        landing_s=float(uav.landing_s),
        in_transit=bool(problem.sensor.detects_in_transit),
        rate_per_s=float(problem.sensor.rate_per_s),
    )


def _states(problem: Problem, case: Case, slots: int) -> PrefixStates:
    """Return room for states; slot 0 is the take-off, all particles with knots open."""
    n = len(problem.futures)
    moving = np.flatnonzero(np.diff(problem.futures.first_knot))
    longest = int(np.diff(case.first_leg_piece).max())
    states = PrefixStates(
        place=np.zeros(slots, np.int32),
        time_s=np.zeros(slots),
        settled=np.zeros(slots),
        open=np.zeros((slots, n), np.int32),
        opens=np.zeros(slots, np.int32),
        miss=np.ones((slots, 0 if problem.sensor.is_perfect else n)),
        flight=np.zeros((longest + 1, 6)),
    )
    states.place[0] = len(case.place_xy_m) - 1
    states.time_s[0] = problem.first_state.time_s
    states.open[0, : len(moving)] = moving
    states.opens[0] = len(moving)
    never = problem.objective.sought - float(problem.weight_at_start[moving].sum())
    states.settled[0] = max(0.0, never) * case.miss_cost
    return states
