"""Which question about the target saves most time: what somebody could be rung up and asked.

An answer re-weights the particles, and a plan is made for each. What a question is worth is the
time that these plans save, weighed by how likely each answer is, on targets that had no part in
making or choosing a plan. It may be less than nothing: then it is noise, and the question is not
worth asking.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.detection.chase import chased_by_any
from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.futures.none import NO_TARGETS
from planner.mission.online import Mission, Remembering
from planner.mission.opening import OpenScenario
from planner.mission.planning import budget_of, holdout_for, problem_of
from planner.mission.questions import Question
from planner.mission.replan import replanned
from planner.mission.resume import Resumed
from planner.progress import Progress, silent
from planner.search.methods import Method

WORK = 0.25  # of the scenario's work that goes into the plan for each answer
RARE = 0.02  # an answer that is less likely is planned for no better than by the plan there was


@dataclass(frozen=True, eq=False)
class Worth:
    """What an answer would save, on targets that had no part in any plan."""

    question: Question
    saves_s: float  # expected
    low_s: float  # of its 95 % interval
    high_s: float
    likely: tuple[float, ...]  # the probability of each answer

    @property
    def is_worth_asking(self) -> bool:
        """Whether it surely saves anything."""
        return self.low_s > 0.0


@dataclass(frozen=True)
class Answered(Remembering):
    """A recorder of the particles of which an answer is true."""

    question: Question | None = None
    answer: int = 0

    @property
    def _knows_more(self) -> bool:
        return self.question is not None or super()._knows_more

    def _given(self, futures: Futures) -> Futures:
        believed = super()._given(futures)
        if self.question is None:
            return believed
        weight = np.where(self.question.of(believed) == self.answer, believed.weight, 0.0)
        present, left = float(believed.weight.sum()), float(weight.sum())
        return believed.reweighted(weight * (present / left) if left > 0.0 else weight)


def ask(
    recorder: Remembering,
    going_on: Resumed,
    method: Method,
    questions: Sequence[Question],
    targets: Futures,
    on_progress: Progress = silent,
) -> list[Worth]:
    """Return what questions are worth, the surest gain first.

    Parameters
    ----------
    going_on
        Where the mission stands when the answer comes.
    targets
        Fresh ones, with the weights that they have then.
    """
    found = []
    for number, one in enumerate(questions):
        on_progress(number, len(questions))
        found.append(_worth(recorder, going_on, method, one, targets))
    return sorted(found, key=lambda one: one.low_s, reverse=True)


def most_s(going_on: Resumed, targets: Futures) -> float:
    """Return the seconds that no answer can save more of: with them each target is chased alone."""
    problem = problem_of(going_on.opened, NO_TARGETS)
    chased_s = chased_by_any(targets, problem.flying, problem.sensor)
    best = Evaluation(chased_s, targets.weight, targets.end_s, problem.objective)
    flown = _evaluated(going_on.opened, going_on.incumbent.tracks, targets)
    return float(targets.weight @ flown.time_s) - float(targets.weight @ best.time_s)


def _worth(
    recorder: Remembering,
    going_on: Resumed,
    method: Method,
    question: Question,
    targets: Futures,
) -> Worth:
    true_answer = question.of(targets)
    before = _evaluated(going_on.opened, going_on.incumbent.tracks, targets)
    saved_s, likely = np.zeros(len(targets)), []
    for answer in range(len(question.answers)):
        rows = true_answer == answer
        likely.append(float(targets.weight[rows].sum()) / float(targets.weight.sum()))
        if likely[-1] > RARE:
            tracks = _planned(recorder, going_on, method, question, answer)
            after = _evaluated(going_on.opened, tracks, targets)
            saved_s[rows] = (before.time_s - after.time_s)[rows]
    mean_s, half_s = float(targets.weight @ saved_s), before.half_width(saved_s)
    return Worth(question, mean_s, mean_s - half_s, mean_s + half_s, tuple(likely))


def _planned(
    recorder: Remembering, going_on: Resumed, method: Method, question: Question, answer: int
) -> tuple[Track, ...]:
    """Return the flight for an answer; that of the plan there was where none is better."""
    opened = going_on.opened
    known = Answered(
        opened, recorder.workers, memory=recorder.memory, question=question, answer=answer
    )
    planning = known.planning().futures
    holdout = holdout_for(method, known)
    if min(len(planning), len(planning if holdout is None else holdout)) < 2:
        return going_on.incumbent.tracks
    budget = budget_of(opened)
    budget = replace(budget, work=max(1, int(WORK * budget.work)))
    found = replanned(going_on, known, method, planning, holdout=holdout, budget=budget)
    return found.attempt.plan.tracks


def _evaluated(opened: OpenScenario, tracks: Sequence[Track], targets: Futures) -> Evaluation:
    problem = problem_of(opened, NO_TARGETS)
    return evaluate(tracks, targets, problem.sensor, problem.objective)


def fresh_now(mission: Mission, going_on: Resumed, targets: int | None = None) -> Futures:
    """Return the scenario's fresh targets as they are believed in now."""
    return mission.recorder.now(going_on.opened).evaluation(targets).futures
