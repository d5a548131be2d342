"""What every planner owes, whoever wrote it: clauses that are held against it on small problems."""

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from planner.detection.evaluate import evaluate
from planner.errors import InputError, NotApplicableError
from planner.flight.plan import Plan
from planner.search.contract_problems import PROBLEMS, MakeProblem
from planner.search.fingerprint import fingerprint
from planner.search.own import COPY, ProblemChangedError
from planner.search.problem import Budget, Problem
from planner.search.random_order import random
from planner.search.result import SearchResult
from planner.search.sound import BY_PLAN, fault_of

BUDGET = Budget(roads=3, work=9000)
SEED = 7
RANDOM_PLANS = 60
OFF_M, OFF_S = 1e-3, 1e-6  # by which a track may miss what its legs say


@dataclass(frozen=True, eq=False)
class Case:
    """One planner on one problem, planned once for all that look at the plan."""

    planner: Callable[..., SearchResult]
    make: MakeProblem

    @cached_property
    def problem(self) -> Problem:
        """The problem."""
        return self.make()

    @cached_property
    def made(self) -> Any:
        """What the planner returns for it."""
        return self.returned(self.problem)

    @property
    def plan(self) -> Plan:
        """Its plan."""
        plan: Plan = self.made.plan
        return plan

    def returned(self, problem: Problem) -> Any:
        """Return what the planner returns for a problem, from the same random stream each time."""
        return self.planner(problem, budget=BUDGET, rng=np.random.default_rng(SEED))


@dataclass(frozen=True)
class Clause:
    """One thing that is owed."""

    name: str
    broken: Callable[[Case], str | None] = field(repr=False)  # what is wrong; None: it is kept
    remedy: str
    is_advice: bool = False  # whether a planner may break it and still be one
    ends: bool = False  # whether nothing else can be asked of a plan that breaks it


@dataclass(frozen=True)
class Breach:
    """A clause that a planner breaks on a problem, or the reason why it does not plan for it."""

    problem: str
    clause: Clause | None  # None: it says that it cannot work on the problem, which it may
    said: str
    has_raised: bool = False  # whether it made no plan at all, for which no clause has a remedy

    @property
    def remedy(self) -> str | None:
        """What helps; None: nothing that is known here."""
        return None if self.clause is None or self.has_raised else self.clause.remedy


def breaches(
    planner: Callable[..., SearchResult], problems: Mapping[str, MakeProblem] = PROBLEMS
) -> Iterator[Breach]:
    """Yield what a planner breaks, problem by problem; after a fault of its result no more of it.

    Parameters
    ----------
    planner
        A function of a problem, ``budget`` and ``rng``.
    """
    for name, make in problems.items():
        case = Case(planner, make)
        for clause in CLAUSES:
            try:
                said = clause.broken(case)
            except NotApplicableError as error:
                yield Breach(name, None, str(error))
                break
            except ProblemChangedError as error:
                yield Breach(name, UNCHANGED, str(error))
                break
            except InputError as error:
                yield Breach(name, clause, str(error), has_raised=error.__cause__ is not None)
                break
            if said is not None:
                yield Breach(name, clause, said)
                if clause.ends:
                    break


def cost_s(problem: Problem, plan: Plan) -> float:
    """Return what the objective has least of: expected seconds, or the horizon for each miss."""
    result = evaluate(plan.tracks, problem.futures, problem.sensor, problem.objective)
    if problem.objective.by_s is None:
        return result.expected_detection_time_s
    found = result.found_by_probability(problem.objective.by_s)
    return problem.horizon_s * (problem.objective.sought - found)


def random_s(problem: Problem, roads: int) -> float:
    """Return what so many random roads cost in the mean."""
    streams = [np.random.default_rng(seed) for seed in range(RANDOM_PLANS)]
    plans = [random(problem, budget=Budget(roads), rng=rng).plan for rng in streams]
    return float(np.mean([cost_s(problem, plan) for plan in plans]))


# The clauses


def _unsound(case: Case) -> str | None:
    return fault_of(case.problem, case.made)


def _by_chance(case: Case) -> str | None:
    for problem in (case.problem, case.make()):
        if fingerprint(case.returned(problem).plan) != fingerprint(case.plan):
            return "plans otherwise when it is called again"
    return None


def _changes(case: Case) -> str | None:
    problem = case.make()
    before = fingerprint((problem, problem.legs))
    case.returned(problem)
    same = fingerprint((problem, problem.legs)) == before
    return None if same else "the problem is not the same after it was planned for"


def _misnamed(case: Case) -> str | None:
    """Return where a track is not where its legs say: at both ends and the middle of a road."""
    network, track = case.problem.network, case.plan.tracks[0]
    speed_mps = case.problem.uav.speed_mps
    for flown in case.plan.legs[0]:
        shape = network.shape(flown.road)[:: -1 if flown.leg % 2 else 1]
        middle = network.xy(flown.road, network.road_length_m[flown.road] / 2)
        takes_s = network.road_length_m[flown.road] / speed_mps
        if abs(flown.end_s - flown.start_s - takes_s) > OFF_S * (1.0 + takes_s):
            return (
                f"flies {network.road_ids[flown.road]} in {flown.end_s - flown.start_s:,.2f} s, "
                f"which takes {takes_s:,.2f} s"
            )
        half_s = (flown.start_s + flown.end_s) / 2
        for when, where in (
            (flown.start_s, shape[0]),
            (half_s, middle),
            (flown.end_s, shape[-1]),
        ):
            off_m = float(np.hypot(*(track.xy(when) - where)))
            if not off_m <= OFF_M:
                return (
                    f"is {off_m:,.1f} m from {network.road_ids[flown.road]} at {when:,.1f} s, when "
                    "it names it"
                )
    return None


def _begins_anew(case: Case) -> str | None:
    """Return what is wrong with the plan of a search that has begun, half of it seen."""
    problem = case.problem
    begun = case.returned(problem.replace(start=problem.first_state))
    if fingerprint(begun.plan) != fingerprint(case.plan):
        return "plans otherwise if problem.start is the state at take-off"
    on_its_way = dataclasses.replace(problem.first_state, time_s=200.0, x_m=1e3, y_m=-2e3)
    seen_at = np.full(len(problem.futures), np.inf)
    seen_at[::2] = 150.0
    later = problem.replace(start=on_its_way.absorb(seen_at))
    return fault_of(later, case.returned(later))


def _no_better(case: Case) -> str | None:
    problem, plan = case.problem, case.plan
    roads = len(plan.legs[0]) or len(problem.network.road_ids)
    costs_s, chance_s = cost_s(problem, plan), random_s(problem, roads)
    if costs_s < chance_s - 1.0:
        return None
    return f"costs {costs_s:,.0f} s, {roads} random roads {chance_s:,.0f} s in the mean"


UNCHANGED = Clause("the problem is left as it is", _changes, COPY)
CLAUSES = (
    Clause("a flight that the UAV can fly", _unsound, BY_PLAN, ends=True),
    Clause(
        "the same stream gives the same plan",
        _by_chance,
        "draw chance from rng alone, read no clock, and keep nothing from call to call",
    ),
    UNCHANGED,
    Clause("legs are flown as they are named", _misnamed, BY_PLAN),
    Clause(
        "a search that has begun is gone on with",
        _begins_anew,
        "start from problem.first_state, and look only for what it has not seen",
    ),
    Clause(
        "better than random roads",
        _no_better,
        "look at what each leg would see: planner.WhatIf(problem).fly(state, legs)",
        is_advice=True,
    ),
)
