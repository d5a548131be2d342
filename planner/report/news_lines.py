"""What is said of a flight that was planned anew."""

from planner.clock import clock
from planner.detection.evaluation import Evaluation
from planner.detection.paired import Ahead
from planner.mission.follow import EVERY_S, contact
from planner.mission.replan import Replanned


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
    gain = f"{lead.share:.1%} (95 %: {lead.low:.1%} .. {lead.high:.1%}, paired)"
    if found.problem.objective.by_s is not None:
        return f"a new plan, which finds {gain} more than the one there was"
    return f"a new plan; of the time still to come it saves {gain}"


def contact_line(planned: Evaluation, waiting: Evaluation) -> str:
    """Return in how much of the time a target is seen that is lost now and then."""
    return (
        f"if it is lost like this again, each time after {EVERY_S / 60:g} min in sight, it is seen "
        f"{contact(planned):.0%} of the time; {contact(waiting):.0%} by waiting where it was lost"
    )
