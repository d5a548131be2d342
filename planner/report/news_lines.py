"""What is said of a flight that was planned anew."""

from collections.abc import Iterator, Sequence
from typing import Any

from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.detection.paired import Ahead
from planner.messages import percent
from planner.mission.ask import Worth
from planner.mission.follow import EVERY_S, contact
from planner.mission.live import Offer
from planner.mission.replan import Replanned
from planner.report.formats import Column, FittingTable


def verdict(found: Replanned, lead: Ahead) -> str:
    """Return whether the flight is another one now, and what that is worth.

    Parameters
    ----------
    lead
        Of the plan that is flown over the one there was, on fresh targets.
    """
    at = clock(found.resumed.at_s)
    if found.is_kept:
        return f"from {at}: the plan there was goes on, as nothing better was found"
    return f"from {at}: {saving(found, lead)}"


def saving(found: Replanned, lead: Ahead) -> str:
    """Return what a new plan saves against the one there was."""
    objective = found.problem.objective
    sure = f"95 %: {100 * lead.low:.1f} .. {100 * lead.high:.1f}, paired"
    if objective.by_s is not None and objective.sought > 1:
        sure = f"95 %: {lead.low:.2f} .. {lead.high:.2f}, paired"
    sure = sure if lead.is_known else "too few targets for an interval"
    if objective.by_s is None:
        return f"a new plan; of the time still to come it saves {percent(lead.share)} ({sure})"
    if objective.sought == 1:
        return f"a new plan, which finds {percent(lead.share)} ({sure}) more than the one there was"
    more = f"{lead.share:.2f} more of the {objective.sought} targets"
    return f"a new plan, which finds {more} ({sure}) than the one there was"


def offer_line(offer: Offer) -> str:
    """Return what is said of a plan that could be flown."""
    took = f"{offer.took_s:.1f} s, by {offer.found.attempt.method}"
    if offer.wrong:
        return f"the plan there was stands ({took}): {'; '.join(offer.wrong)}"
    if offer.found.is_kept:
        return f"the plan there was goes on ({took}): nothing better was found"
    return f"from {clock(offer.going_on.at_s)} ({took}): {saving(offer.found, offer.found.lead)}"


def contact_line(planned: Evaluation, waiting: Evaluation) -> str:
    """Return in how much of the time a target is seen that is lost now and then."""
    return (
        f"if it is lost like this again, each time after {EVERY_S / 60:g} min in sight, it is seen "
        f"{percent(contact(planned), 0)} of the time; {percent(contact(waiting), 0)} by waiting "
        "where it was lost"
    )


def worth_blocks(found: Sequence[Worth], most_s: float, targets: int) -> Iterator[Any]:
    """Yield which questions are worth asking, and what no answer can exceed."""
    shown = [one for one in found if one.is_worth_asking]
    if shown:
        table = FittingTable(
            f"what an answer saves, on {targets:,} fresh targets",
            (
                Column("question", left=True, wraps=True),
                Column("saves"),
                Column("95 %\ninterval", rank=1),
                Column("answers", left=True, wraps=True, rank=2),
            ),
        )
        for one in shown:
            answers = zip(one.question.answers, one.likely, strict=True)
            said = ", ".join(f"{name} {percent(share, 0)}" for name, share in answers)
            interval = f"{one.low_s:,.0f} .. {one.high_s:,.0f} s"
            table.add_row(one.question.asked, f"{one.saves_s:,.0f} s", interval, said)
        yield table
    else:
        yield f"no question is worth asking: none of {len(found)} surely saves anything"
    yield f"no answer can save more than {most_s:,.0f} s: then the target would be flown to at once"
