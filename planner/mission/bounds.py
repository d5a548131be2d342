"""One bound for many plans that answer the same problem, and what a stored run knows of it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from planner.bounds.certificate import Effort, certified
from planner.errors import InputError
from planner.flight.plan import Plan
from planner.mission.certificate_file import PRICES, proof_of, read_certificate
from planner.mission.trial import Trial
from planner.search.problem import Problem

Kind = tuple[str, float]  # a bound is for one class of plans and one take-off, seconds


@dataclass(frozen=True)
class Bounds:
    """The bounds by kind of plan, and why some kinds have none."""

    of: Mapping[Kind, float]
    reasons: tuple[str, ...] = ()

    def bound(self, plan: Plan) -> float | None:
        """Return the bound for a plan, None if none is known."""
        return self.of.get(kind_of(plan))


def kind_of(plan: Plan) -> Kind:
    """Return the kind of a plan, for which its bound holds."""
    return ("roads" if plan.follows_roads else "free", plan.take_off_s)


def bounds_of(
    trials: Sequence[Trial], bound: Callable[[Plan], float | None], *, known: Mapping[Kind, float]
) -> dict[Kind, float]:
    """Return the bounds of all kinds of plans that there are, each from the best of its kind.

    Parameters
    ----------
    bound
        Computes one; None if none is known for plans of this kind.
    known
        Bounds that need not be computed.
    """
    best: dict[Kind, Trial] = {}
    for trial in trials:
        before = best.setdefault(kind_of(trial.plan), trial)
        if trial.planned.is_better(before.planned):
            best[kind_of(trial.plan)] = trial
    found = {kind: bound(trial.plan) for kind, trial in best.items() if kind not in known}
    return {**known, **{kind: value for kind, value in found.items() if value is not None}}


def stored_bound(plan_file: Path, plan: Plan, problem: Problem) -> dict[Kind, float]:
    """Return the bound of a stored plan's certificate, nothing if it has none.

    Parameters
    ----------
    problem
        That the plan answers.

    Raises
    ------
    InputError
        If the certificate is broken, or its prices do not prove it.
    """
    certificate = read_certificate(plan_file)
    if certificate is None:
        return {}
    if proof_of(certificate, plan_file, problem) is None:
        raise InputError(
            f"{plan_file}: its certificate does not follow from {PRICES} beside it; "
            f"`planner certify {plan_file.parent} --force` makes a new one"
        )
    is_free = certificate.plan_class == "free"  # of which the files prove less than can be said
    bound = certified(problem, plan, Effort()).bound if is_free else certificate.bound
    return {(certificate.plan_class, plan.take_off_s): bound}
