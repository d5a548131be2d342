"""A plan within a gap of the best one: planning and bounding by turns, from both sides."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from planner.bounds.certificate import Certificate
from planner.flight.plan import Plan
from planner.mission.trial import Attempt
from planner.search.stop import never

# Shares of the time by which each part has ended; the last bound has what is left.
PLANNED, BOUNDED, PLANNED_AGAIN = 0.15, 0.3, 0.45
MORE = 8  # times as much work for the second plan


@dataclass(frozen=True)
class TwoSided:
    """The two sides from which the gap is closed; each hears how many seconds it has at most."""

    plan: Callable[[int, float], Attempt]  # with so many times the scenario's work
    bound: Callable[[Plan, float], Certificate | None]  # None: no bound is known here
    fly: Callable[[Sequence[int], Attempt], Attempt]  # other legs than an attempt's, in order
    asked: Callable[[], bool] = never  # whether somebody wants the best of both so far


def planned_to_gap(
    sides: TwoSided, gap: float, *, seconds: float = float("inf"), again: bool = True
) -> tuple[Attempt, Certificate | None]:
    """Return a plan and its certificate, as soon as the gap is small enough.

    There are two turns. The second one plans with more work and goes on from the better plan. What
    bounding meets that is better than the plan takes its place if the gap asks for it.

    Parameters
    ----------
    seconds
        After which the best of both so far is returned.
    again
        Whether more work may give another plan.
    """
    begun_s = time.monotonic()

    def left_s(share: float) -> float:
        return max(0.0, share * seconds - (time.monotonic() - begun_s))

    def enough(reached: Certificate | None) -> bool:
        return reached is None or reached.gap <= gap or sides.asked() or left_s(1.0) == 0.0

    attempt = sides.plan(1, left_s(PLANNED if again else BOUNDED))
    certificate = sides.bound(attempt.plan, left_s(BOUNDED if again else 1.0))
    attempt, certificate = _with_better(attempt, certificate, sides, gap)
    if enough(certificate) or not again:
        return attempt, certificate
    cut = left_s(BOUNDED) == 0.0
    other = sides.plan(MORE, left_s(PLANNED_AGAIN))
    better = other.planned.is_better(attempt.planned)
    if better:
        attempt, certificate = other, _certificate_of(other, certificate, sides)
    if not enough(certificate) and (better or cut):
        certificate = _tighter(certificate, sides.bound(attempt.plan, left_s(1.0)), attempt)
    return _with_better(attempt, certificate, sides, gap)


def _with_better(
    attempt: Attempt, certificate: Certificate | None, sides: TwoSided, gap: float
) -> tuple[Attempt, Certificate | None]:
    """Return what bounding met in the plan's place, if it is better and the gap too wide."""
    if certificate is None or certificate.gap <= gap or not certificate.better:
        return attempt, certificate
    other = sides.fly(certificate.better, attempt)
    if not other.planned.is_better(attempt.planned):
        return attempt, certificate
    return other, replace(certificate, value=other.planned.figure, better=())


def _certificate_of(
    attempt: Attempt, certificate: Certificate | None, sides: TwoSided
) -> Certificate | None:
    """Return the certificate of a plan, from that of another one if both are of one class."""
    if certificate is None or (certificate.plan_class == "roads") != attempt.plan.follows_roads:
        return sides.bound(attempt.plan, 0.0)
    return replace(certificate, value=attempt.planned.figure)


def _tighter(
    one: Certificate | None, other: Certificate | None, attempt: Attempt
) -> Certificate | None:
    """Return the certificate with the tighter bound."""
    if one is None or other is None:
        return one or other
    is_higher = other.bound > one.bound
    return other if is_higher == (attempt.planned.objective.by_s is None) else one
