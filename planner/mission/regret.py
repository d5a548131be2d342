"""What a plan for one belief costs where another one is true: the regret of each under each."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from planner.belief.mixture import Mixture
from planner.detection.evaluate import evaluate
from planner.errors import InputError
from planner.flight.plan import Plan
from planner.futures.none import NO_TARGETS
from planner.messages import percent
from planner.mission.opening import OpenScenario
from planner.mission.planning import holdout_for, problem_of
from planner.mission.recorder import Recorder
from planner.mission.trial import attempted
from planner.progress import Progress, silent
from planner.scenario.target import Component
from planner.scenario.toml_text import toml_text
from planner.search.methods import Method

MIXTURE = "all of them"


@dataclass(frozen=True)
class Regrets:
    """What is expected of each plan under each belief, the mixture's plan last."""

    planned_for: tuple[str, ...]
    truths: tuple[str, ...]
    figure: tuple[tuple[float, ...], ...]  # by plan and truth: seconds, or a probability
    is_time: bool  # whether less is better
    beliefs: tuple[str, ...] = ()  # what each belief is, in a line

    @property
    def regret(self) -> tuple[tuple[float, ...], ...]:
        """How much worse than the plan for that truth: a share of the time, or a probability."""
        own = [self.figure[k][k] for k in range(len(self.truths))]
        if self.is_time:
            return tuple(
                tuple(one / best - 1.0 for one, best in zip(row, own, strict=True))
                for row in self.figure
            )
        return tuple(
            tuple(best - one for one, best in zip(row, own, strict=True)) for row in self.figure
        )

    @property
    def worst(self) -> tuple[float, ...]:
        """The greatest regret of each plan."""
        return tuple(map(max, self.regret))


def regrets(
    recorder: Recorder,
    method: Method,
    on_progress: Progress = silent,
    *,
    targets: int | None = None,
) -> Regrets:
    """Return what plans for each component of the target's mixture cost under each other one.

    Parameters
    ----------
    targets
        How many fresh ones of each component they are judged on, as `Recorder.evaluation` has it.

    Raises
    ------
    InputError
        If the scenario's belief is no mixture.
    """
    opened = recorder.opened
    parts = opened.scenario.target.mix
    if parts is None:
        raise InputError("target.mix: is not given, so there is one belief; write [[target.mix]]")
    names = tuple(f"{number}" for number in range(1, len(parts) + 1))
    alone = [_alone(opened, number) for number in range(len(parts))]
    recorders = [replace(recorder, opened=one) for one in alone]
    plans: list[Plan] = []
    steps = 2 * len(parts) + 1
    for number, (name, one) in enumerate(
        zip((*names, MIXTURE), (*recorders, recorder), strict=True)
    ):
        on_progress(number, steps, f"a plan for {name}")
        plans.append(_planned(one, method))
    rows = [[0.0] * len(parts) for _ in plans]
    for truth, one in enumerate(recorders):
        on_progress(len(plans) + truth, steps, f"all plans if {names[truth]} is true")
        fresh, problem = one.evaluation(targets).futures, problem_of(one.opened, NO_TARGETS)
        for number, plan in enumerate(plans):
            found = evaluate(plan.tracks, fresh, problem.sensor, problem.objective)
            rows[number][truth] = found.figure
    on_progress(steps, steps)
    is_time = opened.scenario.search.objective == "time"
    figures = tuple(map(tuple, rows))
    return Regrets((*names, MIXTURE), names, figures, is_time, told_apart(parts))


def told_apart(parts: Sequence[Component]) -> tuple[str, ...]:
    """Return what tells the components of a mixture apart, a line for each: weight, and keys."""
    tables = [part.model_dump(mode="json", exclude_none=True) for part in parts]
    total = sum(part.weight for part in parts)
    keys = dict.fromkeys(key for table in tables for key in table if key != "weight")
    apart = [key for key in keys if any(one.get(key) != tables[0].get(key) for one in tables)]
    told = []
    for part, table in zip(parts, tables, strict=True):
        said = [f"{key} = {toml_text(table[key])}" for key in apart if key in table]
        told.append(", ".join([percent(part.weight / total, 0), *said]))
    return tuple(told)


def _alone(opened: OpenScenario, number: int) -> OpenScenario:
    """Return a scenario in which one component of the mixture is what is believed, and true."""
    target = opened.scenario.target
    assert target.mix is not None
    assert isinstance(opened.prior, Mixture)
    part, prior = target.mix[number], opened.prior.parts[number]
    scenario = replace(opened.scenario, target=part, truth=part)
    return replace(opened, scenario=scenario, prior=prior, truth_prior=prior)


def _planned(recorder: Recorder, method: Method) -> Plan:
    planning = recorder.planning().futures
    return attempted(method, recorder, planning, holdout=holdout_for(method, recorder)).plan
