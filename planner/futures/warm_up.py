"""A session of traffic up to the target's time 0, and what the traffic is like then."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from planner.futures.steering import Step
from planner.futures.traffic import Traffic

HALTING_MPS = 0.1
FLOWS = 0.5  # the share of vehicles that may halt
# A backlog grows if so many more wait to enter the net than halfway, as a share of those in it.
GROWS = 0.1


class Warm(NamedTuple):
    """What the traffic is like at the target's time 0."""

    vehicles: int  # in the net
    halting: int  # of these
    waiting: int  # to enter the net
    waited: int  # to enter it, when half of the warm-up was over

    @property
    def has_broken_down(self) -> bool:
        """Whether more than half of the vehicles halt, or ever more wait to enter."""
        halts = self.halting > FLOWS * self.vehicles
        return halts or self.waiting - self.waited > GROWS * self.vehicles


def warm_up(libsumo: Any, step: Step, at_s: float) -> Warm:
    """Take a session of SUMO on to a time; return what the traffic is like then.

    Parameters
    ----------
    step
        As `planner.futures.steering.stepper` makes it.
    """
    now, pending = libsumo.simulation.getTime, libsumo.simulation.getPendingVehicles
    halfway_s, waited = (now() + at_s) / 2, 0
    while now() < at_s:
        if now() <= halfway_s:
            waited = len(pending())
        step()
    speeds = [libsumo.vehicle.getSpeed(name) for name in libsumo.vehicle.getIDList()]
    halting = sum(speed < HALTING_MPS for speed in speeds)
    return Warm(len(speeds), halting, len(pending()), waited)


def breakdown(sessions: Sequence[Warm], traffic: Traffic) -> str | None:
    """Return a line on traffic at a stated rate that does not flow; None on what a user gives."""
    broken = [warm for warm in sessions if warm.has_broken_down]
    if traffic.demand is None or not broken:
        return None
    worst = max(broken, key=lambda warm: warm.halting + warm.waiting)
    return (
        f"traffic.vehicles_per_hour: {traffic.demand.vehicles_per_hour:g} is more than the net "
        f"bears: when the search begins, traffic has broken down in {len(broken)} of "
        f"{len(sessions)} runs (at the worst {worst.halting} of {worst.vehicles} vehicles halt, "
        f"and {worst.waiting} wait to enter); give fewer"
    )
