"""The planners by name."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from planner.errors import InputError

if TYPE_CHECKING:
    import numpy as np

    from planner.search.problem import Budget, Problem
    from planner.search.result import SearchResult
    from planner.user_code import UserFunction


class Planner(Protocol):
    """A function from a problem to a plan; the same random stream gives the same plan."""

    def __call__(
        self, problem: "Problem", *, budget: "Budget", rng: "np.random.Generator"
    ) -> "SearchResult":
        """Return the plan and what it took; each planner documents which limits apply."""


@dataclass(frozen=True)
class Method:
    """A planner and what is to be known of it before it is loaded."""

    name: str
    summary: str  # one line of --help
    simulates: bool  # it plans by simulation, for which the UAV's take-off has to wait
    load: Callable[[], Planner]
    chooses: bool = False  # between plans, on particles that had no part in making them
    moves_freely: bool = False  # off the roads, if the budget allows it
    proposes: bool = False  # searches on particles that SUMO has not driven, where there are any
    takes_options: bool = False  # of the scenario's [greedy], and particles drawn anew
    is_sized: bool = True  # how long it takes follows from what the scenario says
    stops: bool = False  # when asked, with the best plan so far
    is_pattern: bool = False  # what a pilot flies without a planner
    for_misses: bool = False  # plans for a sensor that may miss; else as if it were perfect
    teams: bool = False  # plans a fleet's flights together as well as one after the other
    own: "UserFunction | None" = None  # whose file it comes from; None: the program's own


def _exhaustive() -> Planner:
    from planner.search.exhaustive import exhaustive

    return exhaustive


def _breadth_first() -> Planner:
    from planner.search.exhaustive import breadth_first

    return breadth_first


def _exhaustive_shortest() -> Planner:
    from planner.search.exhaustive_shortest import exhaustive_shortest

    return exhaustive_shortest


def _greedy() -> Planner:
    from planner.search.greedy import greedy

    return greedy


def _rate() -> Planner:
    from planner.search.rate import rate

    return rate


def _lookahead() -> Planner:
    from planner.search.lookahead import lookahead

    return lookahead


def _best() -> Planner:
    from planner.search.best import best

    return best


def _beam() -> Planner:
    from planner.search.beam import beam

    return beam


def _anneal_waypoints() -> Planner:
    from planner.search.anneal_waypoints import anneal_waypoints

    return anneal_waypoints


def _cells() -> Planner:
    from planner.search.cell_beam import cells

    return cells


def _lns() -> Planner:
    from planner.search.lns import lns

    return lns


def _orienteering() -> Planner:
    from planner.search.orienteering import orienteering

    return orienteering


def _hover() -> Planner:
    from planner.search.pattern_methods import hover

    return hover


def _spiral() -> Planner:
    from planner.search.pattern_methods import spiral

    return spiral


def _expanding_square() -> Planner:
    from planner.search.pattern_methods import expanding_square

    return expanding_square


def _sector() -> Planner:
    from planner.search.pattern_methods import sector

    return sector


def _lawnmower() -> Planner:
    from planner.search.pattern_methods import lawnmower

    return lawnmower


def _main_streets() -> Planner:
    from planner.search.street_patterns import main_streets

    return main_streets


def _best_crossing() -> Planner:
    from planner.search.street_patterns import best_crossing

    return best_crossing


def _wait() -> Planner:
    from planner.search.wait import wait

    return wait


def _random() -> Planner:
    from planner.search.random_order import random

    return random


def _exact() -> Planner:
    from planner.search.exact import exact

    return exact


def _pattern(name: str, summary: str, load: Callable[[], Planner]) -> Method:
    return Method(name, summary, True, load, stops=True, is_pattern=True)


METHODS = (
    Method(
        "best",
        "exact on up to seven roads, else ever wider beams, polished",
        True,
        _best,
        for_misses=True,
        chooses=True,
        moves_freely=True,
        stops=True,
        teams=True,
    ),
    Method(
        "beam",
        "grows many road orders in parallel",
        True,
        _beam,
        chooses=True,
        stops=True,
        for_misses=True,
    ),
    Method(
        "lns",
        "repeatedly cuts and repairs the order of rate",
        True,
        _lns,
        stops=True,
        for_misses=True,
    ),
    Method(
        "cells",
        "a beam of free flights over a space-time cell index",
        True,
        _cells,
        for_misses=True,
        chooses=True,
        proposes=True,
        stops=True,
    ),
    Method(
        "anneal-waypoints",
        "starts from the beam's plan and leaves the roads",
        True,
        _anneal_waypoints,
        chooses=True,
        stops=True,
    ),
    Method(
        "greedy",
        "the paper's what-if simulations, one road after the other",
        True,
        _greedy,
        takes_options=True,
        for_misses=True,
    ),
    Method(
        "rate",
        "the leg that earns most per second of flight, then the next",
        True,
        _rate,
        for_misses=True,
    ),
    Method(
        "lookahead",
        "the pair of legs that earns most per second",
        True,
        _lookahead,
        for_misses=True,
    ),
    Method(
        "exact",
        "the best of all orders and directions of a small net",
        True,
        _exact,
        for_misses=True,
        is_sized=False,
    ),
    Method("exhaustive", "every road once, in topological order", False, _exhaustive),
    Method(
        "exhaustive-shortest",
        "every road once, precedence kept, the least extra flight",
        False,
        _exhaustive_shortest,
    ),
    Method("breadth-first", "the paper's example of a search that fails", False, _breadth_first),
    Method(
        "orienteering",
        "OR-Tools: a tour of the roads that the target is likely to pass",
        True,
        _orienteering,
        is_sized=False,
        stops=True,
    ),
    _pattern("hover", "hovers over the best place of those last seen at", _hover),
    _pattern("spiral", "a tuned spiral outwards", _spiral),
    _pattern("expanding-square", "a tuned expanding square search (SS)", _expanding_square),
    _pattern("sector", "a tuned sector search (VS): triangles that meet in one point", _sector),
    _pattern("lawnmower", "tuned parallel tracks over a rectangle (PS)", _lawnmower),
    _pattern("main-streets", "out along the busiest streets and back, tuned", _main_streets),
    _pattern("best-crossing", "hovers over the best of all crossings", _best_crossing),
    Method("wait", "fly to where most targets end and wait there", False, _wait),
    Method("random", "random roads in random directions", False, _random),
)


def method_named(name: str, folder: Path = Path()) -> Method:
    """Return the method of that name, or a user's own planner as ``path.py:function``.

    Parameters
    ----------
    folder
        That the path of a file begins from.

    Raises
    ------
    InputError
        If there is none; the text lists those there are. If the user's file cannot be read.
    """
    for method in METHODS:
        if method.name == name:
            return method
    if ".py:" in str(name):
        from planner.user_code import UserFunction

        return method_of(UserFunction.of(name, folder))
    names = ", ".join(method.name for method in METHODS)
    raise InputError(
        f"method {name!r} is unknown; choose one of {names}, or a planner of your own as "
        "path.py:function"
    )


def method_of(own: "UserFunction") -> Method:
    """Return a user's own planner as a method, which gets whatever `best` gets.

    It may be stopped early, as it is given ``budget.stop``; how long it takes is unknown.
    """

    def load() -> Planner:
        from planner.search.own import loaded

        return loaded(own)

    return Method(
        own.name,
        "a planner of your own",
        True,
        load,
        chooses=True,
        stops=True,
        is_sized=False,
        own=own,
    )


def plans_for_misses(name: str) -> bool:
    """Tell whether a method plans for a sensor that may miss; one that has no name here may."""
    return all(method.for_misses for method in METHODS if method.name == name)


def is_pattern(name: str) -> bool:
    """Tell whether the method of that name, if there is one, is a pilot's pattern."""
    return any(method.name == name and method.is_pattern for method in METHODS)
