"""What the odds of a plan hang on, read off the targets that it was evaluated on: worth asking."""

from collections.abc import Iterator

import numpy as np

from planner.mission.now_events import Condition, FirstPlan, Unknown
from planner.mission.questions import About, Question, of_a_call

FEWEST = 20  # targets of which odds are told


def unknowns(made: FirstPlan) -> tuple[Unknown, ...]:
    """Return what would change the odds of a plan by more than chance, the most first.

    Nothing new is simulated: the plan's own fresh targets are told apart by what they did.
    """
    found = [one for one in every_unknown(made) if _matters(one)]
    return tuple(sorted(found, key=lambda one: -_spread(one)))


def every_unknown(made: FirstPlan) -> Iterator[Unknown]:
    """Yield all that is looked at, with the answers that enough targets give."""
    opened, fresh = made.opened, made.fresh.futures
    about = About(fresh, opened.network, float(opened.scenario.take_off_s))
    for one in of_a_call(about):
        if one.option != "--heading" or made.call.words.heading is None:
            yield Unknown(one.asked, one.option, _answers(made, one))


def _answers(made: FirstPlan, question: Question) -> tuple[Condition, ...]:
    """Return the odds of a plan for each group of targets that is large enough."""
    evaluated, fresh = made.trial.evaluated, made.fresh.futures
    true_answer = question.of(fresh)
    found = []
    for number, name in enumerate(question.answers):
        those = true_answer == number
        share = float(fresh.weight[those].sum() / fresh.weight.sum())
        if those.sum() < FEWEST or share <= 0.0:
            continue
        found.append(Condition(name, evaluated.of_those(those, 1.0 / share), share))
    return tuple(found)


def _matters(one: Unknown) -> bool:
    """Return whether two answers' odds at the end are apart by more than chance."""
    if len(one.answers) < 2:
        return False
    ends = [answer.evaluated.found_interval for answer in one.answers]
    return max(low for low, _ in ends) > min(high for _, high in ends)


def _spread(one: Unknown) -> float:
    """Return by how much answers move the odds, in the mean over how probable they are."""
    share = np.array([answer.share or 0.0 for answer in one.answers])
    odds = np.array([answer.evaluated.detection_probability for answer in one.answers])
    middle = float(np.average(odds, weights=share))
    return float(np.sqrt(share @ (odds - middle) ** 2))
