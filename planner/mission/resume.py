"""A mission in the middle of it: where its UAVs are, what they have flown, what is left to fly.

What a UAV has flown without finding the target is news like any other's search. One that is lost,
or has landed for good, stays in the scenario, so that all keep their numbers: it flies no more.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any

import numpy as np

from planner.clock import clock
from planner.errors import InputError, NotApplicableError, NothingLeftError
from planner.flight.plan import ROUNDING_S, Plan, Sortie
from planner.flight.track import Track
from planner.flight.uav import Uav
from planner.futures.none import NO_TARGETS
from planner.mission.joined import with_joined
from planner.mission.news import search_of
from planner.mission.opening import OpenScenario
from planner.mission.planning import problems_of
from planner.mission.standing import OfUav, Standing
from planner.scenario.faults import faults_of
from planner.scenario.news import News, NewsSection
from planner.scenario.uav import UavSection
from planner.scenario.uav_values import InAir, PointStart
from planner.search.anneal_waypoints import waypoints_of
from planner.search.plan import plan_of_legs, plan_of_waypoints
from planner.search.problem import Problem

NO_MORE: Mapping[str, Any] = {"sorties": 0, "swap_s": None, "in_air": None}  # of a UAV's section


@dataclass(frozen=True, eq=False)
class Resumed:
    """A mission from now on."""

    opened: OpenScenario  # where the UAVs are, and what is known now
    incumbent: Plan  # what is left of the plan there was
    at_s: float  # from when on
    # since that plan began, by the UAV's number; without those that have not taken off
    flown: Mapping[int, Track] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class _Part:
    """One UAV from now on."""

    section: UavSection
    left: tuple[Plan, ...] = ()  # its flights that are not over, as planned; the one it is in first
    flown: Track | None = None
    paused_s: float | None = None  # until when it has flown the first of these; None: not at all
    is_elsewhere: bool = False  # than its plan has it

    @property
    def flies(self) -> bool:
        """Whether it flies from now on."""
        return self.section.sorties != 0


def resumed(
    opened: OpenScenario, plan: Plan, standing: Standing, news: Sequence[News] = ()
) -> Resumed:
    """Return a mission as it goes on from where its UAVs are.

    Parameters
    ----------
    opened
        The scenario that the plan is for.
    news
        All of the target that has come in, with what was known when the plan was made.

    Raises
    ------
    InputError
        If something is said of a UAV that there is not, or that is on the ground.
    NothingLeftError
        If nobody flies any more.
    """
    opened = with_joined(opened, standing.joined, standing.at_s)
    problems = problems_of(opened, NO_TARGETS)
    told = _told(standing, problems)
    parts = [
        _Now(opened, number, problem.uav, standing.at_s).part(_flights(plan, number), said)
        for number, (problem, said) in enumerate(zip(problems, told, strict=True))
    ]
    if not any(part.flies for part in parts):
        raise NothingLeftError(_nobody(plan, told))
    flown = {number: part.flown for number, part in enumerate(parts) if part.flown is not None}
    sensor, speed_mps = problems[0].sensor, problems[0].uav.speed_mps
    own = [search_of(track, sensor, speed_mps) for track in flown.values()]
    after = _with(opened, [part.section for part in parts], (*news, *own))
    rest = _rest_of_all(problems_of(after, NO_TARGETS), plan, parts)
    is_whole = not flown and len(rest.tracks) == len(plan.tracks)
    begun_s = (part.section.in_air.at_s for part in parts if part.section.in_air and part.flown)
    at_s = min(begun_s, default=standing.at_s)
    return Resumed(after, plan if is_whole else rest, at_s, flown)


def grounded(opened: OpenScenario, plan: Plan, standing: Standing) -> tuple[int, ...]:
    """Return who is on the ground, by the plan and by what is said; nobody who is lost.

    Raises
    ------
    InputError
        If something is said of a UAV that there is not.
    """
    opened = with_joined(opened, standing.joined, standing.at_s)
    problems = problems_of(opened, NO_TARGETS)
    told = _told(standing, problems)
    return tuple(
        number
        for number, (problem, said) in enumerate(zip(problems, told, strict=True))
        if said.lost_s is None
        and not _Now(opened, number, problem.uav, standing.at_s).is_up(_flights(plan, number), said)
    )


def called(number: int, many: int) -> str:
    """Return what one of so many UAVs is called."""
    return "the UAV" if many == 1 else f"UAV {number + 1}"


def refuse_long_delay(opened: OpenScenario, plan: Plan, standing: Standing) -> None:
    """Do nothing if each UAV has been at its height for as long as it is said to have stood still.

    Raises
    ------
    InputError
        If one has not: so long a delay cannot be all of this flight's.
    """
    problems = problems_of(opened, NO_TARGETS)
    for number, problem in enumerate(problems):
        late_s = standing.uavs.get(number, standing.of_only).late_s
        begun_s = [one.take_off_s for one in _flights(plan, number)]
        begins_s = max((s for s in begun_s if s < standing.at_s), default=standing.at_s)
        most_s = max(0.0, standing.at_s - begins_s - _climb_s(problem.uav))
        if late_s > most_s:
            who = called(number, len(problems))
            raise InputError(
                f"--delay {late_s:g}: at {clock(standing.at_s)} {who} has been at its "
                f"height for {most_s:g} s; give at most that"
            )


def in_order(flown: Iterable[Track]) -> Track:
    """Return flights of one UAV as one, the first one first."""
    return reduce(Track.then, flown)


def hovering(flown: Track, until_s: float) -> Track:
    """Return a flight that stands still where another one has ended, until a time."""
    x_m, y_m = float(flown.x_m[-1]), float(flown.y_m[-1])
    time_s = np.array([flown.end_s, until_s])
    return Track(time_s, np.full(2, x_m), np.full(2, y_m), time_s[None, :])


def _told(standing: Standing, problems: Sequence[Problem]) -> list[OfUav]:
    """Return what is said of each UAV, or refuse what is said of none, or of nobody."""
    many = len(problems)
    for number in standing.uavs:
        if not 0 <= number < many:
            there = "there is one, UAV 1" if many == 1 else f"they are UAV 1 to UAV {many}"
            raise InputError(f"uav: there is no UAV {number + 1}; {there}")
        if problems[number].uav.sorties == 0:
            raise InputError(f"uav: UAV {number + 1} flies no more; leave out what is said of it")
    if standing.of_only != OfUav() and many > 1:
        raise InputError(f"uav: is missing; say which of the {many} UAVs it is, as uav 2")
    return [standing.uavs.get(number, standing.of_only) for number in range(many)]


def _nobody(plan: Plan, told: Sequence[OfUav]) -> str:
    """Return what is said if no UAV flies from now on."""
    lost = [f"UAV {number + 1}" for number, said in enumerate(told) if said.lost_s is not None]
    if lost:
        return f"lost: without {' and '.join(lost)} nobody flies any more; there is nothing to plan"
    return f"the flight is over at {clock(plan.end_s)}; give an earlier time, or where the UAV is"


def _flights(plan: Plan, number: int) -> list[Plan]:
    """Return the flights of one UAV, each alone."""
    every = sorted(zip(plan.flights, plan.tracks, plan.legs, strict=True), key=lambda one: one[0])
    mine = [one for one in every if one[0].uav == number]
    return [Plan(plan.method, (track,), (legs,), (sortie,)) for sortie, track, legs in mine]


@dataclass(frozen=True, eq=False)
class _Now:
    """A UAV of a scenario, at a time."""

    opened: OpenScenario
    number: int
    uav: Uav  # as its first flight begins
    at_s: float

    @property
    def section(self) -> UavSection:
        return self.opened.scenario.uavs[self.number]

    def part(self, flights: Sequence[Plan], said: OfUav) -> _Part:
        """Return how it goes on with what is said of it."""
        by_s = self.at_s if said.lost_s is None else min(self.at_s, said.lost_s)
        begun = [one for one in flights if one.take_off_s < by_s]
        waiting = tuple(flights[len(begun) :])
        flown = [one.tracks[0] for one in begun]
        if said.lost_s is not None:
            return _Part(self._changed(NO_MORE), flown=_flown_until(flown, by_s))
        if self.is_up(flights, said):
            return self._in_flight(begun, waiting, said)
        if said != OfUav():
            self._refuse_on_ground(has_landed=bool(begun) and not waiting)
        left = self.uav.sorties - len(begun)
        if not begun:
            return _Part(self._changed(self._ready(left)), waiting)
        ready = self._ready(left, begun[-1].end_s + self.uav.swap_s)
        changes = {"in_air": None, **ready}
        return _Part(self._changed(changes), waiting, _flown_until(flown, self.at_s))

    def is_up(self, flights: Sequence[Plan], said: OfUav) -> bool:
        """Return whether it flies on in a flight that it has begun.

        Of several flights, one that comes down already is as good as over. In the last one it is
        where it is said to be, whatever the plan has.
        """
        begun = [one for one in flights if one.take_off_s < self.at_s]
        if not begun:
            return False
        if said.xy_m is not None and len(begun) == len(flights):
            return True
        uav, down_s = self.uav.of_flight(len(begun) - 1), 0.0
        is_alone = len(self.opened.scenario.uavs) == 1 and self.uav.sorties == 1
        if uav.aircraft is not None and uav.return_to_m is not None and not is_alone:
            down_s = uav.aircraft.law.descend_s
        return self.at_s < begun[-1].end_s - down_s

    def _refuse_on_ground(self, *, has_landed: bool) -> None:
        who = called(self.number, len(self.opened.scenario.uavs))
        if has_landed:
            raise InputError(
                f"uav: {who} has landed by {clock(self.at_s)}, as planned; say where it is if it "
                "flies still, or leave out what is said of it"
            )
        raise InputError(
            f"uav: {who} is on the ground at {clock(self.at_s)}, as planned, where no place, "
            "battery or delay of it counts; leave out what is said of it"
        )

    def _in_flight(self, begun: Sequence[Plan], waiting: tuple[Plan, ...], said: OfUav) -> _Part:
        """Return how it goes on in the middle of the last flight that it has begun."""
        last, uav = begun[-1], self.uav.of_flight(len(begun) - 1)
        up_s = last.take_off_s + _climb_s(uav)
        now_s = max(self.at_s, up_s)
        paused_s = max(up_s, now_s - said.late_s)
        flown = last.tracks[0].until(paused_s)
        if paused_s < now_s:
            flown = flown.then(hovering(flown, now_s))
        x_m, y_m = flown.xy(now_s).tolist() if said.xy_m is None else said.xy_m
        lands_s = last.take_off_s + uav.max_flight_time_s
        left_s = None if np.isinf(lands_s) else max(1.0, lands_s - now_s)
        if said.left_s is not None:
            left_s = said.left_s - (now_s - self.at_s)
        there = self._in_air({"place": {"x_m": x_m, "y_m": y_m}, "at_s": now_s, "left_s": left_s})
        changes = {"in_air": there, **self._flights_left(self.uav.sorties - len(begun) + 1)}
        whole = in_order([*(one.tracks[0] for one in begun[:-1]), flown])
        left = (last, *waiting)
        return _Part(self._changed(changes), left, whole, paused_s, said.xy_m is not None)

    def _ready(self, left: int, landed_s: float | None = None) -> dict[str, Any]:
        """Return how its section changes while it is on the ground.

        Parameters
        ----------
        left
            How many flights it has left.
        landed_s
            When it can take off again; None: it has not flown.
        """
        scenario, section = self.opened.scenario, self.section
        last_seen_s, charged_s = scenario.target.last_seen_ago_s, scenario.search.planning_time_s
        ready_s = landed_s
        if ready_s is None:
            ready_s = last_seen_s + section.take_off_s + charged_s
            if section.in_air is not None or self.at_s <= ready_s or left == 0:
                return {}
        if left == 0 or max(ready_s, self.at_s) >= scenario.search.horizon_s:
            return dict(NO_MORE)
        changes = {"take_off_s": max(ready_s, self.at_s) - last_seen_s, **self._flights_left(left)}
        home_m = self.opened.landings_m[self.number]
        if landed_s is None or home_m is None or section.return_to == "start":
            return changes
        return changes | {"start": PointStart(x_m=home_m[0], y_m=home_m[1])}

    def _flights_left(self, left: int) -> dict[str, Any]:
        if left == self.uav.sorties:
            return {}
        return {"sorties": left} if left > 1 else {"sorties": None, "swap_s": None}

    def _in_air(self, table: Mapping[str, Any]) -> InAir:
        """Return where it is, or refuse a place, time or battery that no scenario may hold."""
        there, errors = InAir.checked(table)
        if there is None:
            key = "uav" if len(self.opened.scenario.uavs) == 1 else f"uav[{self.number}]"
            raise InputError(str(next(iter(faults_of(f"{key}.in_air", InAir, errors)))))
        return there

    def _changed(self, changes: Mapping[str, Any]) -> UavSection:
        return self.section.model_copy(update=dict(changes))


def _climb_s(uav: Uav) -> float:
    """Return how long it takes to be at its height."""
    return 0.0 if uav.aircraft is None else uav.aircraft.law.climb_s


def _flown_until(flights: Sequence[Track], time_s: float) -> Track | None:
    """Return flights of one UAV as one, up to a time; None if there are none."""
    return in_order([one.until(time_s) for one in flights]) if flights else None


def _with(
    opened: OpenScenario, sections: Sequence[UavSection], news: Sequence[News]
) -> OpenScenario:
    uav, *others = sections
    section = NewsSection(heard=tuple(news) or None)
    scenario = replace(opened.scenario, uav=uav, others=tuple(others), news=section)
    return replace(opened, scenario=scenario)


def _rest_of_all(problems: Sequence[Problem], plan: Plan, parts: Sequence[_Part]) -> Plan:
    """Return what is left of a plan, each UAV's flights counted anew; ``problems`` are theirs."""
    tracks, legs, sorties = [], [], []
    for uav, (problem, part) in enumerate(zip(problems, parts, strict=True)):
        for number, one in enumerate(_rests(problem, part)):
            tracks.append(one.tracks[0])
            legs.append(one.legs[0])
            sorties.append(Sortie(uav, number))
    return Plan(plan.method, tuple(tracks), tuple(legs), tuple(sorties))


def _rests(problem: Problem, part: _Part) -> list[Plan]:
    """Return what is left of a UAV's flights; each takes off as late as the one before has it."""
    if part.paused_s is None:
        return [*part.left]
    first, *waiting = part.left
    found = [_rest(problem, first, part.paused_s, part.is_elsewhere)]
    for one in waiting:
        late_s = found[-1].end_s + problem.uav.swap_s - one.take_off_s
        found.append(one.later(late_s) if late_s > ROUNDING_S else one)
    return found


def _rest(problem: Problem, plan: Plan, paused_s: float, is_elsewhere: bool) -> Plan:
    """Return what is left of a flight, as far as the battery lasts."""
    uav = problem.uav
    kept_s = 0.0 if uav.aircraft is None else uav.aircraft.reserve_s
    rest = plan.after(paused_s).later(uav.take_off_s - paused_s)
    if not is_elsewhere and rest.end_s <= uav.landing_s - kept_s + ROUNDING_S:
        return rest
    try:
        return plan_of_waypoints(problem, plan.method, waypoints_of(problem, rest))
    except NotApplicableError:  # the sensor only looks along roads
        return plan_of_legs(problem, plan.method, [leg.leg for leg in rest.legs[0]])
