"""One bound for many plans that answer the same problem, and what a stored run knows of it."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from planner.errors import InputError
from planner.flight.plan import Plan
from planner.mission.trial import Trial

Kind = tuple[str, float]  # a bound is for one class of plans and one take-off, seconds
BOUND = ("lower_bound_s", "upper_bound_probability")  # the keys of plan.json's certificate


@dataclass(frozen=True)
class Bounds:
    """What no plan of a kind can pass, and why some have no bound."""

    of: Mapping[Kind, float]
    reasons: tuple[str, ...] = ()

    def bound(self, plan: Plan) -> float | None:
        """Return the bound for a plan, None if none is known."""
        return self.of.get(kind_of(plan))


def kind_of(plan: Plan) -> Kind:
    """Return of which kind the bound of a plan is."""
    return "roads" if plan.follows_roads else "free", plan.take_off_s


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


def stored_bound(plan_file: Path, plan: Plan) -> dict[Kind, float]:
    """Return the bound of a stored plan's certificate, nothing if it has none.

    Raises
    ------
    InputError
        If the certificate is broken.
    """
    certificate = json.loads(plan_file.read_text(encoding="utf-8")).get("certificate")
    if certificate is None:
        return {}
    try:
        (key,) = [key for key in BOUND if key in certificate]
        kind = (str(certificate["plan_class"]), plan.take_off_s)
        return {kind: float(certificate[key])}
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{plan_file}: its certificate is broken ({error!r}); "
            f"`planner certify {plan_file.parent} --force` makes a new one"
        ) from error
