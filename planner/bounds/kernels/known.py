"""What sightings of a leg are worth after the leg flown before it, compiled."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Ints, Offsets
from planner.jit import compiled


class Sightings(NamedTuple):
    """Sightings of legs, sorted by leg and bin."""

    first: Offsets  # (legs * bins + 1,) where the sightings of a leg from a bin start
    particle: Ints  # (M,)
    reward: Floats  # (M,) times the particle's weight
    missed: Floats  # (M,) how probably it is unseen at the end of the longest contact, or (1,): 0


class LegBefore(NamedTuple):
    """A leg that may be flown just before a hop."""

    leg: int
    least: int  # how many bins before the hop it begins,
    most: int  # or one more
    seen_before: Flags  # (bins, N) whom it leaves out, by the bin in which it begins


@compiled
def left_after(sightings: Sightings, leg: int, before: LegBefore, left: Floats) -> None:
    """Fill ``left``: what share of each sighting of a leg is left after another leg, (rows,).

    The leg before may see the particle with as great a reward, and leaves what it may miss; or it
    leaves the particle out as seen before. The share is the greater one of the bins in which it
    may begin.
    """
    first, particle, reward, missed = sightings
    bins, particles = before.seen_before.shape
    least, most, offset = before.least, before.most, first[leg * bins]
    earned, passed = np.zeros(particles), np.ones(particles)
    left[:] = 1.0
    for i in range(most, bins):
        rows = slice(first[leg * bins + i], first[leg * bins + i + 1])
        left[rows.start - offset : rows.stop - offset] = 0.0
        for j in range(i - most, i - least + 1):
            begin, end = first[before.leg * bins + j], first[before.leg * bins + j + 1]
            for e in range(begin, end):
                earned[particle[e]] = reward[e]
                passed[particle[e]] = missed[min(e, len(missed) - 1)]
            for e in range(rows.start, rows.stop):
                k, after = particle[e], 1.0
                if before.seen_before[j, k]:
                    after = 0.0
                elif earned[k] >= reward[e]:
                    after = passed[k]
                left[e - offset] = max(left[e - offset], after)
            for e in range(begin, end):
                earned[particle[e]], passed[particle[e]] = 0.0, 1.0


@compiled
def note_known(left: Floats, since: int, known: Ints, again: Floats) -> None:
    """Note after which legs a sighting is known, and what share is left of it then at most.

    Of one share for all these legs, so that the shares lost come to the greatest sum.

    Parameters
    ----------
    left
        What share is left, (rows, legs).
    since
        Number of the first row among all sightings.
    known
        Is filled with a bit for each leg, (M,).
    again
        Is filled with that share, (M,); (1,) where it is nothing.
    """
    for row in range(len(left)):
        most, share = 0.0, 0.0
        for one in left[row]:
            lost = 0.0
            for other in left[row]:
                lost += (1.0 - one) * (other <= one)
            if lost > most:
                most, share = lost, one
        if most > 0.0:
            for bit in range(left.shape[1]):
                if left[row, bit] <= share:
                    known[since + row] |= np.uint8(1 << bit)
            again[min(since + row, len(again) - 1)] = share
