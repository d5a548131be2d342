"""Sentences that stand below the tables."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from planner.bounds.certificate import Certificate, gap_of
from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.detection.prospects import Prospects
from planner.intervals import share_interval
from planner.messages import percent
from planner.mission.own_futures import ENOUGH, ENOUGH_FILES
from planner.report.finds import span_of
from planner.report.tables import Fresh, MethodRow
from planner.scenario.target import TargetSection
from planner.search.methods import plans_for_misses

ENOUGH_IN_TOWN = 1000  # particles; measured: with half as many a tuned spiral does better
TOO_FEW = 0.03  # an in-sample gain above this share of the value asks for more particles
MANY_TIMES = 10.0  # the value in sample; a gain beyond is told in seconds


def reasons(rows: Iterable[MethodRow]) -> list[str]:
    """Return why methods cannot be used, a line for each reason, to stand below the table."""
    methods: dict[str, list[str]] = {}
    for row in rows:
        if row.why_not:
            methods.setdefault(row.why_not, []).append(row.method)
    return [f"{', '.join(names)}: {why_not}" for why_not, names in methods.items()]


def as_if_perfect(evaluations: Mapping[str, Evaluation]) -> str | None:
    """Return which methods took no account of a sensor that may miss, by their evaluations."""
    blind = [
        method
        for method, evaluated in evaluations.items()
        if evaluated.survival is not None and not plans_for_misses(method)
    ]
    return f"planned as if the sensor were perfect: {', '.join(blind)}" if blind else None


def hidden_line(hidden: float | None) -> str | None:
    """Return what is said of targets that no pass can see, given their share."""
    if not hidden:
        return None
    return (
        f"{percent(hidden, 0)} of targets are where no pass can see them: they count as never found"
    )


def flees_line(targets: Sequence[TargetSection]) -> str | None:
    """Return what is said where a target, or a component of one, flees."""
    if not any(part.flees for target in targets for _, part in target.parts("target")):
        return None
    whoever = "the target" if len(targets) == 1 else "a target"
    return (
        f"{whoever} flees at first whatever is done; a plan fixed at take-off is as good as any "
        "other if the find ends the mission, nothing seen misleads, the target does not react to "
        "the UAV and flight times are as planned"
    )


def particles_hint(planned: Evaluation, evaluated: Evaluation, sampling: str) -> str | None:
    """Return advice if a plan fits its own particles much better than fresh targets.

    Only where both are drawn from the same belief; a truth that differs from it shifts the
    fresh value by itself.

    Parameters
    ----------
    sampling
        How the particles were drawn, as in the scenario's ``search.sampling``.
    """
    expected_s, (_, high_s) = evaluated.expected_detection_time_s, evaluated.ci95_s
    gain_s = expected_s - planned.expected_detection_time_s
    timed = evaluated.objective.by_s is None
    if not timed or gain_s <= max(TOO_FEW * expected_s, high_s - expected_s):
        return None
    planned_s = planned.expected_detection_time_s
    longer = (
        percent(gain_s / planned_s, 0) if gain_s < MANY_TIMES * planned_s else f"{gain_s:,.0f} s"
    )
    or_evenly = " or --set search.sampling=sobol" if sampling == "iid" else ""
    return (
        f"fresh targets take {longer} longer to find than the particles planned "
        f"with: {len(planned.weight):,} are few here; try --set search.particles="
        f"{4 * len(planned.weight)}{or_evenly}"
    )


def few_in_town(particles: int, sought: int = 1) -> str | None:
    """Return advice if a plan in a town was made on so few particles that it may be of no use.

    Parameters
    ----------
    sought
        How many targets share the particles.
    """
    enough = ENOUGH_IN_TOWN * sought
    if particles >= enough:
        return None
    return (
        f"planned on {particles:,} particles: in towns a plan made on fewer than "
        f"{enough:,} may be worse than a well-tuned spiral; try --set search.particles={enough}"
    )


def so_far(evaluated: Evaluation) -> str:
    """Return what is known of a plan while more fresh targets are driven, in words."""
    by_s = evaluated.objective.by_s
    if by_s is None:
        expected_s, (low_s, high_s) = evaluated.expected_detection_time_s, evaluated.ci95_s
        return f"{expected_s:,.0f} s ({low_s:,.0f} .. {high_s:,.0f}) so far"
    many = evaluated.objective.number_found
    within = span_of(many, evaluated.found_by_interval(by_s))
    return f"{many(evaluated.found_by_probability(by_s))} ({within}) so far"


def estimate_follows(targets: int) -> str:
    """Return what stands below a plan that is shown before anything is known of its worth."""
    return (
        f"the plan is made; what it is worth shows on {targets:,} fresh targets, which are driven "
        "now: the estimate gets sharper as they come in"
    )


def better_plan_follows(first: str, method: str, particles: int) -> str:
    """Return what stands below a plan that is shown until a slower method has made its own."""
    return (
        f"a first plan, by {first}; {method} makes its own, and chooses it on {particles:,} "
        "other particles, which are driven now"
    )


def own_futures_line(fresh: Fresh, many: int, files: int) -> str:
    """Return what the targets are that a plan on a user's own futures is evaluated on."""
    of_files = "the file" if files == 1 else f"{files} files"
    if fresh.alike and files >= ENOUGH_FILES:
        return f"evaluated on {many:,} vehicles, in files of which planning had none"
    if fresh.alike:
        kept_out = f"evaluated on {many:,} vehicles of {of_files} that were kept out of planning"
        return kept_out + (files > 1) * (
            "; they met the queues that those met which it is planned on, and flatter the plan: "
            f"of {ENOUGH_FILES} files or more whole ones are kept out"
        )
    return (
        f"there are no fresh targets of {of_files}: with fewer than {ENOUGH} vehicles none are "
        f"kept out; the {many:,} targets are drawn from the scenario's belief, which may differ"
    )


def certificate_line(certificate: Certificate, by_s: float | None) -> str:
    """Return what a certificate says, in words."""
    gap = f"gap {percent(certificate.gap)}{_of_physics(certificate, by_s)}"
    kind = "road plan" if certificate.plan_class == "roads" else "flight"
    if by_s is None:
        return (
            f"expected detection {certificate.value:,.0f} s; no {kind} is below "
            f"{certificate.bound:,.0f} s on these particles: {gap}"
        )
    return (
        f"found by the deadline {percent(certificate.value)}; no {kind} is above "
        f"{percent(certificate.bound)} on these particles: {gap}"
    )


def prospects_lines(found: Prospects) -> list[str]:
    """Return how many targets leave the map, and what no flight surpasses, in words."""
    if found.gone <= 0.0:
        return []
    moments = [f"{percent(share, 0)} by {clock(moment_s)}" for moment_s, share in found.gone_by]
    by_end = f"{percent(found.gone, 0)} by {clock(found.ceiling.objective.horizon_s)}"
    left = f"fresh targets that have left the map: {', '.join([*moments, by_end])}"
    most = found.ceiling.detection_probability / found.ceiling.objective.sought
    at_most = f"no flight finds more of them than {percent(most)}"
    lines = []
    if found.many_leave:
        lines.append(
            "many targets leave the map, which no flight here can follow: take a larger net before "
            "you trust these odds"
        )
    return [*lines, f"{left}; {at_most} (each chased alone)"]


def _of_physics(certificate: Certificate, by_s: float | None) -> str:
    """Return how the bound for all flights stands to that of physics, in words."""
    if certificate.physics is None:
        return ""
    if math.isclose(certificate.physics, certificate.bound):
        return " (each target met as early as can be: this time gave no better bound)"
    physics, gap = certificate.physics, gap_of(certificate.value, certificate.physics)
    figure = f"{physics:,.0f} s" if by_s is None else percent(physics)
    return f" (as computed; the files prove {figure}, gap {percent(gap)})"


def gap_line(gap: float) -> str:
    """Return what may still help if the gap asked for was not reached, in words."""
    return (
        f"the gap asked for, {percent(gap)}, is not reached: give more time with --time-limit, or "
        "plan with more work with --set search.work=..."
    )


def limit_line(limit: float, sets: int, by_s: float | None) -> str:
    """Return what the bounds of independent sets say of the true optimum, in words."""
    beyond = f"below {limit:,.0f} s" if by_s is None else f"above {percent(limit)}"
    return f"with 95 % confidence no plan of this class is truly {beyond} ({sets} sets)"


def world_line(limit: float, evaluated: Mapping[str, Any], by_s: float | None) -> str:
    """Return between which figures a plan truly lies, and how far from the best, in words.

    The limit holds with 95 %, the plan's interval from its fresh targets leaves out 2.5 % on the
    side that counts: both hold with 92.5 % or more.

    Parameters
    ----------
    evaluated
        As ``plan.json`` holds it.
    """
    targets = evaluated["targets"]
    if by_s is None:
        low_s, high_s = evaluated["ci95_s"]
        figure, away = f"takes {low_s:,.0f} to {high_s:,.0f} s on average", high_s / limit - 1
        return _world(figure, targets, f"{percent(max(0.0, away))} above")
    low, high = share_interval(evaluated["found_by_probability"], targets)
    figure = f"finds the target by the deadline with {percent(low)} to {percent(high)}"
    return _world(figure, targets, f"{100 * max(0.0, limit - low):.1f} points below")


def _world(figure: str, targets: int, away: str) -> str:
    return (
        f"this plan truly {figure} ({targets:,} fresh targets, 95 %): with 92.5 % confidence at "
        f"most {away} the best of its class"
    )
