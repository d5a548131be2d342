"""A call planned while the clock runs: a guess at once, a plan soon, better ones as they come.

Each plan is what `planner plan` makes of the scenario that goes with it. That scenario holds the
particles, the work and the take-off that it came to: planning takes time, so the drone takes off
when the plan is there, or when it is ready, whichever is later.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from planner.detection.evaluate import evaluate
from planner.detection.paired import ahead
from planner.detection.prospects import prospects
from planner.errors import NotApplicableError, ScenarioError
from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.futures.store import Recording
from planner.futures.workers import HERE
from planner.mission.call import Call
from planner.mission.guess import planning_guess
from planner.mission.now_events import (
    BetterPlan,
    Cloud,
    Condition,
    Done,
    Event,
    FirstPlan,
    How,
    NoBetter,
    Outlook,
    Rung,
)
from planner.mission.now_unknowns import unknowns
from planner.mission.opening import OpenScenario, open_scenario
from planner.mission.planning import budget_of, needs_holdout, problem_of
from planner.mission.recorder import Recorder
from planner.mission.trial import Attempt, attempted
from planner.network.street_names import crossing, nearest_node
from planner.scenario.toml_text import toml_text
from planner.search.methods import METHODS, Method, method_named
from planner.search.stop import Asked

METHOD = METHODS[0]
RECORDED = "particles and targets"
WAITS = "best-crossing"
STANDS = ("hover", WAITS)  # patterns that go nowhere
EVERY_S = 5.0  # take-offs are told in such steps
FIRST_S, WRITES_S = 5.0, 2.0  # for the first search, where none has been timed; for the files
SPARE = 1.3  # times as long as the search before, for its work, a search may take
OTHERS = 200  # targets on which a plan is evaluated for each thing that is not known


def events(call: Call, file: Path, how: How) -> Iterator[Event]:
    """Yield what comes of a call, as it comes.

    Parameters
    ----------
    file
        Holds the scenario of the call.

    Raises
    ------
    ScenarioError
        If the search would be over before the first plan is there.
    """
    yield from _Planning(call, file, how).events()


class _Rival(NamedTuple):
    """What could be flown instead."""

    name: str
    plan: Plan
    waits: bool = False  # at a crossing, which is its name


class _Searched(NamedTuple):
    """What a search has found."""

    take_off_s: float  # of the drone that it is for, since the call
    attempts: list[Attempt]  # one for each place
    there_s: float  # when it was there


class _Enough(Exception):
    """Somebody wants the best plan so far, or no time is left for a better one."""


class _Planning:
    """A call in work."""

    def __init__(self, call: Call, file: Path, how: How) -> None:
        self._call, self._file, self._how = call, file, how
        self._best: FirstPlan | None = None
        self._unit_s: float | None = None  # how long a unit of work takes, fixed costs included
        self._others: list[tuple[str, Futures]] | None = None
        self._rivals: list[_Rival] | None = None

    def events(self) -> Iterator[Event]:
        """Yield the events in their order."""
        opened = self._opened(self._how.rungs[0], 0, self._call.ready_s)
        yield Cloud(self._how.elapsed_s(), opened, planning_guess(self._recorder(opened, "")))
        told = None
        try:
            for number, rung in enumerate(self._how.rungs, 1):
                event = self._next(rung)
                yield event
                if number == min(2, len(self._how.rungs)):
                    yield self._outlook()
                    told = self._best
            if told is not self._best:
                yield self._outlook()
        except _Enough:
            pass
        assert self._best is not None
        yield Done(self._how.elapsed_s(), self._best, self._asked())

    def _asked(self) -> bool:
        return self._best is not None and self._how.stop()

    def _opened(self, rung: Rung, site: int, take_off_s: float) -> OpenScenario:
        changes = {
            "uav.start": dict(self._call.sites[site]),
            "uav.take_off_s": take_off_s,
            "search.particles": rung.particles,
            "search.work": rung.work,
            "search.targets": rung.targets,
        }
        overrides = [f"{key}={toml_text(value)}" for key, value in changes.items()]
        return open_scenario(self._file, overrides=overrides, permit=self._how.permit)

    def _recorder(self, opened: OpenScenario, title: str) -> Recorder:
        shown = self._how.progress(title)

        def progress(done: int, total: int, note: str = "", /) -> None:
            if self._asked():
                raise _Enough
            shown(done, total, note)

        return Recorder(opened, self._how.workers, progress)

    # Plans

    def _next(self, rung: Rung) -> FirstPlan | BetterPlan | NoBetter:
        """Return the next plan; it is the best from now on if it is better."""
        before = self._best
        if before is None:
            self._best = self._planned(rung, range(len(self._call.sites)))
            return self._best
        site = self._call.sites.index(before.call.tables["uav"]["start"])
        made = self._planned(rung, [site])
        lead = ahead(made.trial.evaluated, before.trial.evaluated_on(made.fresh.futures))
        if not _is_better(made, before):
            return NoBetter(made.elapsed_s, rung.particles, lead)
        held = vars(made) | {"sites": before.sites}
        found = BetterPlan(**held, lead=lead, before_s=before.take_off_s)
        self._best = found
        return found

    def _planned(self, rung: Rung, sites: Sequence[int]) -> FirstPlan:
        """Return the plan from the best of several places that is there when the drone takes off.

        All but the fresh targets is recorded before it is known when that is: the particles do not
        depend on the drone. The fresh ones are driven while the search goes on.
        """
        opened = self._opened(rung, sites[0], self._call.ready_s)
        recorder, chooses = self._recorder(opened, RECORDED), needs_holdout(METHOD, opened)
        begun_s = self._how.elapsed_s()
        with closing(recorder.in_turn(holdout=chooses)) as sets:
            planning = next(sets)
            holdout = next(sets).futures if chooses else None
            rides = len(planning.futures) + (0 if holdout is None else len(holdout))
            wait_s = (self._how.elapsed_s() - begun_s) * rung.targets / rides
            found = self._searched(rung, sites, planning, holdout, wait_s)
            fresh = next(sets)
        trials = [attempt.met(fresh.futures) for attempt in found.attempts]
        now_s = self._how.elapsed_s()
        while now_s > found.take_off_s:
            found = self._searched(rung, sites, planning, holdout)
            trials = [attempt.met(fresh.futures) for attempt in found.attempts]
            now_s = found.there_s
        take_off_s = found.take_off_s
        judges = fresh.futures if holdout is None else holdout
        trial = trials[0]
        for other in trials[1:]:
            if other.evaluated_on(judges).is_better(trial.evaluated_on(judges)):
                trial = other
        site = sites[trials.index(trial)]
        opened = self._opened(rung, site, take_off_s)
        problem = problem_of(opened, planning.futures, method=METHOD)
        names = [self._call.site_names[k] for k in sites]
        return FirstPlan(
            elapsed_s=now_s,
            call=self._call.changed(
                uav={"start": dict(self._call.sites[site]), "take_off_s": take_off_s},
                search=rung._asdict(),
            ),
            opened=opened,
            planning=planning,
            holdout=holdout,
            fresh=fresh,
            problem=problem,
            trial=trial,
            prospects=prospects(fresh.futures, problem.flying, problem.sensor, problem.objective),
            sites=tuple(zip(names, (one.evaluated for one in trials), strict=True)),
        )

    def _searched(
        self,
        rung: Rung,
        sites: Sequence[int],
        planning: Recording,
        holdout: Futures | None,
        wait_s: float = 0.0,
    ) -> _Searched:
        """Return what is found for each place.

        Parameters
        ----------
        wait_s
            For how long there would be no fresh targets yet, were it not for the search, which
            shares the processors with those that drive them.
        """
        begun_s, work = self._how.elapsed_s(), rung.work * len(sites)
        takes_s = FIRST_S if self._unit_s is None else SPARE * self._unit_s * work
        shared_s = wait_s + takes_s / HERE.size(self._how.workers)
        take_off_s = self._take_off_s(begun_s + max(takes_s, shared_s))
        found = [
            self._attempt(METHOD, self._opened(rung, site, take_off_s), planning, holdout)
            for site in sites
        ]
        there_s = self._how.elapsed_s()
        self._unit_s = (there_s - begun_s) / work
        return _Searched(take_off_s, found, there_s)

    def _take_off_s(self, there_s: float) -> float:
        """Return when the drone takes off if its plan is there at a time, but for the files."""
        there_s += WRITES_S
        take_off_s = max(self._call.ready_s, EVERY_S * math.ceil(there_s / EVERY_S))
        target, search = self._call.tables["target"], self._call.tables["search"]
        if self._best and target["last_seen_ago_s"] + take_off_s >= search["horizon_s"]:
            raise _Enough
        return take_off_s

    def _attempt(
        self, method: Method, opened: OpenScenario, planning: Recording, holdout: Futures | None
    ) -> Attempt:
        recorder = self._recorder(opened, "particles")
        budget = replace(budget_of(opened), stop=Asked(self._asked))
        futures = planning.futures
        found = attempted(method, recorder, futures, holdout=holdout, budget=budget)
        if found.result.stopped:
            raise _Enough  # its work is not one that a scenario can name
        return found

    # What the odds depend on

    def _outlook(self) -> Outlook:
        plan = self._best
        assert plan is not None
        if self._others is None:
            self._others = [*self._other_targets(plan.opened)]
        if self._rivals is None:
            self._rivals = [*self._rival_plans(plan)]
        sensor, objective = plan.problem.sensor, plan.problem.objective
        conditions = [
            Condition(name, plan.trial.evaluated_on(futures)) for name, futures in self._others
        ]
        flown = [
            (rival, evaluate(rival.plan.tracks, plan.fresh.futures, sensor, objective))
            for rival in self._rivals
        ]
        waiting = [(rival.name, one) for rival, one in flown if rival.waits]
        patterns = [(rival.name, one) for rival, one in flown if not rival.waits]
        return Outlook(
            self._how.elapsed_s(),
            plan,
            tuple(conditions),
            unknowns(plan),
            waiting[0] if waiting else None,
            patterns[0] if patterns else None,
        )

    def _other_targets(self, opened: OpenScenario) -> Iterator[tuple[str, Futures]]:
        """Yield targets for each thing that is not known, under what that is."""
        target = self._call.tables["target"]
        changes: dict[str, dict[str, Any]] = {"it parked": {"truth.profile": "parked"}}
        if any(part.stops for _, part in opened.scenario.target.parts("target")):
            changes = {"it drives": {"truth.stops": {"share": 0.0}}, **changes}
        start = target["start"]
        if isinstance(start, dict) and "heading_deg" in start:
            turned = {**start, "heading_deg": (start["heading_deg"] + 180.0) % 360.0}
            changes["the heading is wrong"] = {"truth.start": turned}
        for name, change in changes.items():
            overrides = [f"{key}={toml_text(value)}" for key, value in change.items()]
            with suppress(ScenarioError):  # there may be no road that way
                permit = self._how.permit
                other = open_scenario(self._file, overrides=overrides, permit=permit)
                yield name, self._recorder(other, "targets").evaluation(OTHERS).futures

    def _rival_plans(self, plan: FirstPlan) -> Iterator["_Rival"]:
        """Yield what could be flown without a planner: the best pattern, and waiting."""
        found: list[Attempt] = []
        for method in (one for one in METHODS if one.is_pattern and one.name not in STANDS):
            with suppress(NotApplicableError):
                found.append(self._attempt(method, plan.opened, plan.planning, plan.holdout))
        if found:
            best = found[0]
            for other in found[1:]:
                best = other if other.planned.is_better(best.planned) else best
            yield _Rival(best.method, best.plan)
        with suppress(NotApplicableError):
            method = method_named(WAITS)
            waits = self._attempt(method, plan.opened, plan.planning, plan.holdout).plan
            yield _Rival(_stays_at(waits, plan), waits, waits=True)


def _is_better(made: FirstPlan, before: FirstPlan) -> bool:
    """Return whether a plan is better than one before, on particles that chose the new one."""
    judges = made.fresh.futures if made.holdout is None else made.holdout
    return made.trial.evaluated_on(judges).is_better(before.trial.evaluated_on(judges))


def _stays_at(plan: Plan, made: FirstPlan) -> str:
    """Return what the crossing is called at which a plan stays longest."""
    (track,) = plan.tracks
    k = int(np.argmax(np.diff(track.time_s)))
    node, _ = nearest_node(made.opened.network, np.array([track.x_m[k + 1], track.y_m[k + 1]]))
    return crossing(made.opened.network, node)
