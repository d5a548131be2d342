"""Several UAVs: one after the other, all at once, and then each again with the others' flights.

What a flight is worth beside others adds up: `Problem.flown` says what they leave, and any planner
of one flight plans given those. So flights are allocated one by one; a joint beam finds what this
misses, as the first one takes what is best alone; and the better plan gets better flight by flight,
until no flight alone makes it better. Which plan is best, particles say that made none of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from planner.detection.evaluate import evaluate_all
from planner.detection.survival import Searched
from planner.flight.plan import Plan, Sortie
from planner.flight.separation import Course, course_of, delay_s, meetings
from planner.flight.track import Track
from planner.flight.uav import Uav
from planner.search.beam import RewardToGo, is_small
from planner.search.joint_beam import JointBeam, joint_orders
from planner.search.methods import Planner
from planner.search.patrol import with_patrol
from planner.search.plan import plan_of_legs
from planner.search.problem import Budget, Problem
from planner.search.rate import rate
from planner.search.result import SearchLog, SearchResult

# Tuned on grid5x5 alone, from 60, 120 and 300 km, with two to four UAVs.
JOINT = (JointBeam(200, 1300), JointBeam(300, 2000))  # the second learns from the first
FIRST = 0.5  # share of the work for the first plans of all flights
AGAIN = 0.2  # share of the work for planning all flights again, once
ROUNDS = 2  # in which each flight is planned again, at most


@dataclass(frozen=True, eq=False)
class Flight:
    """One flight of a UAV, as it is planned."""

    sortie: Sortie
    problem: Problem  # that it was planned for, but for what others fly
    plan: Plan  # of it alone

    @property
    def track(self) -> Track:
        """Where it is when."""
        return self.plan.tracks[0]

    @property
    def searched(self) -> Searched:
        """What it searches with."""
        return Searched(self.track, self.problem.sensor)

    @cached_property
    def course(self) -> Course:
        """Where it may be when, for others to keep apart from."""
        return course_of(self.track, self.problem.uav)

    def later(self, by_s: float) -> "Flight":
        """Return the same flight begun later."""
        return replace(self, plan=self.plan.later(by_s))


Flights = tuple[Flight, ...]  # by take-off


def fleet(
    problems: Sequence[Problem],
    planner: Planner,
    *,
    budget: Budget,
    rng: np.random.Generator,
    together: bool,
) -> SearchResult:
    """Return the best plan of a fleet that is found: one flight after the other, or all at once.

    Parameters
    ----------
    problems
        One for each UAV, as if it were alone; all on the same network, particles and objective.
    planner
        Plans each flight.
    together
        Whether flights are also planned at once, and again beside each other; else only one after
        the other.
    """
    search = _Search(problems, planner, budget, rng)
    search.allocate()
    if together and not search.log.stop():
        search.improve()
    return search.result()


class _Search:
    """The plans of a fleet that were tried, and the best of them."""

    def __init__(
        self,
        problems: Sequence[Problem],
        planner: Planner,
        budget: Budget,
        rng: np.random.Generator,
    ) -> None:
        self._problems, self._planner, self._rng = problems, planner, rng
        self._budget, self.log = budget, SearchLog(problems[0], budget)
        self._done, self._best, self._value = 0, Flights(), -np.inf
        self._method = ""

    def allocate(self) -> None:
        """Plan one flight after the other."""
        self._choose(self._allocated(self._planner))
        self._method = self._best[0].plan.method

    def improve(self) -> None:
        """Plan all flights at once where that can be, and every flight of the best plan again.

        Where they may miss, a fleet that a one-pass method allocates may be a better beginning:
        beams along roads reckon with misses in part only.
        """
        if not self._problems[0].sensor.is_perfect and is_small(self._problems[0]):
            self._choose(self._allocated(rate))
        for beam in JOINT if self._can_fly_together() else ():
            if self.log.stop():
                return
            self._choose(self._together(beam, self._best))
        self._choose(self._improved(self._best))

    def _choose(self, flights: Flights) -> None:
        """Keep a plan if it is the best so far on the particles that plans are chosen on."""
        value = self._value_of(flights)
        if value > self._value:
            self._best, self._value = flights, value
        self.log.reached(self._value, self._done)

    def result(self) -> SearchResult:
        """Return the best plan."""
        flights = sorted(self._best, key=lambda one: one.sortie)
        plan = Plan(
            method=self._method,
            tracks=tuple(one.track for one in flights),
            legs=tuple(one.plan.legs[0] for one in flights),
            sorties=tuple(one.sortie for one in flights),
        )
        return self.log.result(plan)

    def _value_of(self, flights: Flights) -> float:
        problem = self._problems[0]
        if _in_the_way(flights):
            return 0.0
        holdout = problem.holdout or problem.futures
        searched = [flight.searched for flight in flights]
        evaluation = evaluate_all(searched, holdout, problem.objective)
        return float(holdout.weight @ evaluation.reward)

    def _allocated(self, planner: Planner) -> Flights:
        """Return flights planned one by one, as they take off, each beside those before it."""
        ends_s = self._problems[0].objective.ends_s
        waiting = [
            (problem.uav.take_off_s, Sortie(number))
            for number, problem in enumerate(self._problems)
        ]
        flights = Flights()
        while waiting and not (flights and self.log.stop()):
            take_off_s, sortie = min(waiting)
            waiting.remove((take_off_s, sortie))
            if take_off_s >= ends_s and flights:
                continue
            planned = self._apart(
                self._planned(planner, sortie, take_off_s, flights, FIRST), flights
            )
            flights += (planned,)
            uav = self._problems[sortie.uav].uav
            if sortie.number + 1 < uav.sorties:
                again_s = planned.track.end_s + uav.swap_s
                waiting.append((again_s, Sortie(sortie.uav, sortie.number + 1)))
        return flights

    def _planned(
        self, planner: Planner, sortie: Sortie, take_off_s: float, others: Flights, share: float
    ) -> Flight:
        """Return a flight beside others; it lands before the same UAV takes off once more."""
        uav = self._uav(sortie, take_off_s, others)
        flown = tuple(one.searched for one in others)
        problem = self._problems[sortie.uav].replace(uav=uav, flown=flown)
        flights = sum(one.uav.sorties for one in self._problems)
        work = max(1, int(share * self._budget.work / flights))
        part = self._budget.part(work, after=self._done)
        found = planner(problem, budget=replace(part, free=self._budget.free), rng=self._rng)
        self._done += found.work or 0
        return Flight(sortie, problem, found.plan)

    def _uav(self, sortie: Sortie, take_off_s: float, others: Flights) -> Uav:
        """Return a UAV as it takes off, from home if it has flown before, until it has to land."""
        uav = self._problems[sortie.uav].uav.of_flight(sortie.number)
        uav = replace(uav, take_off_s=take_off_s)
        if sortie.number and uav.return_to_m is not None:
            uav = replace(uav, x_m=uav.return_to_m[0], y_m=uav.return_to_m[1])
        for one in others:
            if one.sortie == Sortie(sortie.uav, sortie.number + 1):
                kept_s = 0.0 if uav.aircraft is None else uav.aircraft.reserve_s
                may_s = one.plan.take_off_s - uav.swap_s - take_off_s + kept_s
                lasts_s = min(uav.max_flight_time_s, max(0.0, may_s))
                uav = replace(uav, max_flight_time_s=lasts_s)
        return uav

    def _apart(self, flight: Flight, others: Flights) -> Flight:
        """Return a flight that keeps apart from others: planned for a later take-off if need be.

        One that is in the air cannot wait; a plan in which it comes too near others is worth none.
        """
        if flight.problem.uav.in_air:
            return flight
        courses = [one.course for one in others if one.sortie.uav != flight.sortie.uav]
        late_s = delay_s(flight.course, courses)
        return flight if late_s == 0.0 else flight.later(late_s)

    def _improved(self, flights: Flights) -> Flights:
        """Return flights of which none alone can be planned better, or as the work allows."""
        if len(flights) < 2:
            return flights
        value = self._value_of(flights)
        for _ in range(ROUNDS):
            before = value
            for flight in flights:
                if self.log.stop():
                    return flights
                others = tuple(one for one in flights if one is not flight)
                leaves_s = flight.plan.take_off_s
                again = self._planned(self._planner, flight.sortie, leaves_s, others, AGAIN)
                if self._apart(again, others) is not again:
                    continue  # it would have to wait
                tried = tuple(again if one is flight else one for one in flights)
                worth = self._value_of(tried)
                if worth > value:
                    flights, value = tried, worth
            if value <= before:
                break
        return flights

    def _can_fly_together(self) -> bool:
        """Tell whether a joint beam can search here: few roads, and nothing in the way."""
        problems = self._problems
        free = all(one.airspace is None and one.uav.aircraft is None for one in problems)
        once = all(one.uav.sorties == 1 for one in problems)
        return free and once and not self._budget.free and is_small(problems[0])

    def _together(self, beam: JointBeam, known: Flights) -> Flights:
        """Return flights that a joint beam finds, with what usually comes as in known ones.

        It takes the sensor to be perfect; how each flight goes on then reckons with misses.
        """
        problems = self._problems
        blind = [one.replace(sensor=replace(one.sensor, rate_per_s=np.inf)) for one in problems]
        outlook = RewardToGo.of_flights(blind[0], [flight.track for flight in known])
        orders, work = joint_orders(blind, beam, outlook, stop=self.log.stop)
        self._done += work
        method, pairs = known[0].plan.method, [*zip(problems, orders, strict=True)]
        alone = [
            Searched(plan_of_legs(problem, "", order).tracks[0], problem.sensor)
            for problem, order in pairs
        ]
        flights = Flights()
        for number, (problem, order) in enumerate(pairs):
            flown = tuple(one for k, one in enumerate(alone) if k != number)
            beside = problem.replace(flown=flown)
            plan = plan_of_legs(beside, method, with_patrol(beside, order))
            flights += (self._apart(Flight(Sortie(number), beside, plan), flights),)
        return flights


def _in_the_way(flights: Flights) -> bool:
    """Tell whether a flight that is in the air already may come too near another one."""
    courses, whose = [one.course for one in flights], [one.sortie.uav for one in flights]
    flies = [one.problem.uav.in_air for one in flights]
    return any(flies) and any(flies[a] or flies[b] for a, b, _ in meetings(courses, whose))
