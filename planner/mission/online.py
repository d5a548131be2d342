"""A mission in the air, of one UAV or several: it hears news and plans anew at once."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from planner.belief.recipe import Drawn, OneTarget
from planner.flight.plan import Plan, Sortie
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.futures.record import Note
from planner.futures.store import Recording
from planner.mission.opening import OpenScenario
from planner.mission.planning import holdout_for
from planner.mission.recorder import Recorder
from planner.mission.replan import (
    Replanned,
    refuse_unlikely_reports,
    replanned,
    with_news,
    without_news,
)
from planner.mission.resume import Resumed, in_order, resumed
from planner.mission.standing import Standing
from planner.mission.trial import Attempt, attempted
from planner.scenario.news import News
from planner.search.methods import Method
from planner.search.problem import Budget


@dataclass(frozen=True)
class Remembering(Recorder):
    """A recorder that reads each set of targets once, whatever is heard of them later."""

    memory: dict[Any, Any] = field(default_factory=dict)

    def now(self, opened: OpenScenario) -> "Remembering":
        """Return the same for a scenario that differs in the UAV and in news only."""
        return replace(self, opened=opened)

    def _recorded(
        self, recipe: Drawn | OneTarget, described: Mapping[str, Any], note: Note | None = None
    ) -> Recording:
        many = recipe.count if isinstance(recipe, Drawn) else 1
        key = many, json.dumps(described, sort_keys=True)
        if key not in self.memory:
            self.memory[key] = super()._recorded(recipe, described, note)
        found: Recording = self.memory[key]
        return found

    def _proposed(self, recorded: Futures) -> Futures | None:
        if "proposals" not in self.memory:
            self.memory["proposals"] = super()._proposed(recorded)
        found: Futures | None = self.memory["proposals"]
        return found


class Mission:
    """Flights over time: what was flown, what is flown next, and what is known."""

    def __init__(self, recorder: Remembering, plan: Plan, method: Method) -> None:
        self.recorder, self.plan, self.method = recorder, plan, method
        self.flown: dict[int, Track] = {}  # all of it so far, by the UAV's number

    @property
    def opened(self) -> OpenScenario:
        """The scenario as it is now."""
        return self.recorder.opened

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The whole flight of each UAV: what was flown, and what is planned."""
        parts: dict[int, list[Track]] = {uav: [track] for uav, track in self.flown.items()}
        for flight, track in _by_flight(self.plan):
            parts.setdefault(flight.uav, []).append(track)
        return tuple(in_order(parts[uav]) for uav in sorted(parts))

    @property
    def track(self) -> Track:
        """That of the only UAV."""
        (track,) = self.tracks
        return track

    def made(self, budget: Budget | None = None) -> Attempt:
        """Return what the method makes of the scenario as it is now, whatever is flown."""
        planning, holdout = self._particles(self.recorder, self.method)
        return attempted(self.method, self.recorder, planning, holdout=holdout, budget=budget)

    def warm_up(self) -> None:
        """Read, or record, all that planning anew takes, while there is time."""
        planning, _ = self._particles(self.recorder, self.method)
        if self.method.proposes:
            self.recorder.proposals(planning)

    def heard(
        self,
        standing: Standing,
        news: Sequence[News] = (),
        *,
        same_source: bool = False,
        insist: bool = False,
    ) -> Resumed:
        """Return how the mission stands once something is heard; it does not change yet.

        Parameters
        ----------
        same_source
            Whether a report is from who gave the last one, which it replaces.
        insist
            Whether reports count that hardly can be true by what is believed.

        Raises
        ------
        InputError
            If a report is of a place where the target hardly can be, or the flight is over.
        """
        known = with_news(self.opened.news, news, same_source=same_source)
        found = resumed(self.opened, self.plan, standing, known)
        if not insist:
            refuse_unlikely_reports(found.opened, self.believed(), news)
        return found

    def planned(
        self, going_on: Resumed, budget: Budget | None = None, method: Method | None = None
    ) -> Replanned:
        """Return the better of a new plan and the old one; the mission does not change yet."""
        recorder, method = self.recorder.now(going_on.opened), method or self.method
        planning, holdout = self._particles(recorder, method)
        return replanned(going_on, recorder, method, planning, holdout=holdout, budget=budget)

    def goes_on(self, going_on: Resumed, plan: Plan) -> None:
        """Fly a plan from now on."""
        for uav, more in going_on.flown.items():
            self.flown[uav] = self.flown[uav].then(more) if uav in self.flown else more
        self.recorder, self.plan = self.recorder.now(going_on.opened), plan

    def believed(self) -> Futures:
        """Return the particles that are planned on, as believed before any news."""
        return self.recorder.now(without_news(self.opened)).planning().futures

    def _particles(self, recorder: Recorder, method: Method) -> tuple[Futures, Futures | None]:
        """Return the particles to plan on, and those to choose on."""
        return recorder.planning().futures, holdout_for(method, recorder)


def _by_flight(plan: Plan) -> list[tuple[Sortie, Track]]:
    """Return whose track each is, by UAV, its first flight first."""
    return sorted(zip(plan.flights, plan.tracks, strict=True), key=lambda one: one[0])
