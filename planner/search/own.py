"""A planner of the user's own: a function in a Python file, by the file's path and its name."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from planner.errors import InputError, NotApplicableError
from planner.search.fingerprint import fingerprint
from planner.search.problem import Budget, Problem
from planner.search.result import SearchResult
from planner.search.sound import fault_of
from planner.user_code import UserFunction

COPY = "copy arrays before you change them; a variant is problem.replace(...)"
ASKED = "def {name}(problem, budget, rng)"


class ProblemChangedError(InputError):
    """A planner has changed the problem that it was given, so that no figure of it can be right."""


def loaded(own: UserFunction) -> Callable[..., SearchResult]:
    """Return a user's planner, whose every fault is told in one line that names it.

    Raises
    ------
    InputError
        If its file has changed, cannot be run, or has no such function.
    """
    function = own.load(ASKED.format(name=own.function), None, budget=None, rng=None)

    def planner(problem: Problem, *, budget: Budget, rng: np.random.Generator) -> SearchResult:
        before = fingerprint(problem)
        made: SearchResult = _called(own, function, problem, budget, rng)
        if fingerprint(problem) != before:
            raise ProblemChangedError(f"{own.name}: has changed the problem; {COPY}")
        fault = fault_of(problem, made)
        if fault is not None:
            raise InputError(f"{own.name}: {fault}")
        return replace(made, plan=replace(made.plan, method=own.name))

    return planner


def _called(
    own: UserFunction,
    function: Callable[..., Any],
    problem: Problem,
    budget: Budget,
    rng: np.random.Generator,
) -> Any:
    try:
        return function(problem, budget=budget, rng=rng)
    except (NotApplicableError, MemoryError, KeyboardInterrupt):
        raise
    except BaseException as error:  # a planner may not end the program
        raise InputError(f"{own.name}: raised {own.said(error)}") from error
