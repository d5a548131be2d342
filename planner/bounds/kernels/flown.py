"""What hops that begin at a certain time see, compiled and exact."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.bounds.kernels.meetings import Motion, Pieces, contact, meeting, straight_of
from planner.detection.kernels.worth import Goal, worth_of_contact
from planner.jit import compiled


class Looking(NamedTuple):
    """What a sensor that may miss sees with, and what for."""

    reach_m: float
    rate_per_s: float
    goal: Goal


class Outcome(NamedTuple):
    """What hops do to particles that nobody has seen before, (hops, N) each."""

    worth: Floats  # the reward to be expected
    missed: Floats  # the probability that it is unseen after the hop


@compiled
def fly(
    hops: Motion, hop: Ints, start_s: float, pieces: Pieces, reach_m: float, out: Floats
) -> None:
    """Lower ``out`` (hops, N) to when each of some hops, begun at once, first sees each particle.

    Parameters
    ----------
    hops
        The motions of all of them, by seconds after their start.
    hop
        Whose each motion is.
    """
    for p in range(len(pieces.particle)):
        target, k = straight_of(pieces.motion, p), pieces.particle[p]
        if target.to_s >= start_s:
            for s in range(len(hop)):
                seen_s = meeting(straight_of(hops, s), target, start_s, reach_m)
                out[hop[s], k] = min(out[hop[s], k], seen_s)


@compiled
def look(
    hops: Motion, hop: Ints, start_s: float, pieces: Pieces, looking: Looking, out: Outcome
) -> None:
    """Do what ``fly`` does with a sensor that may miss: add to what is earned, lower what is left.

    A particle's pieces come by time, as do the motions of each hop, and so do its contacts.
    """
    for p in range(len(pieces.particle)):
        target, k = straight_of(pieces.motion, p), pieces.particle[p]
        if target.to_s >= start_s:
            for s in range(len(hop)):
                met = contact(straight_of(hops, s), target, start_s, looking.reach_m)
                if met.from_s < met.to_s:
                    rate, at = looking.rate_per_s, (hop[s], k)
                    each = worth_of_contact(k, met.from_s, met.to_s, rate, looking.goal)
                    out.worth[at] += out.missed[at] * each
                    out.missed[at] *= np.exp(-rate * (met.to_s - met.from_s))
