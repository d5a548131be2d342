"""Group hunts: no flight is worth more than if each small group of particles had its own UAV.

Deal the particles into groups. What one flight earns with a group is at most what the best flight
for that group alone earns, so the sum over the groups bounds every flight, on roads or off them.
Groups of one are the bound of physics. The farther apart the particles of a group are, the more
it costs to see them all: each group has one particle of each of as many clusters.

For a group the best order of first sightings is found by dynamic programming over sets (Held and
Karp, 1962). Where particle k is seen at time t, the UAV is within the radius R of it, so particle j
is seen next no sooner than at the first t' with |x_j(t') - x_k(t)| <= 2 R + v (t' - t). Times
count as the starts of their bins; how far particles stray within a bin is added to the distance.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from planner.arrays import Floats, Ints
from planner.bounds.kernels.group_orders import Whereabouts, most_reward, onward
from planner.bounds.whereabouts import driven_at, is_there, places_at
from planner.futures.futures import Futures
from planner.search.problem import Problem

SIZES = (8, 12, 16)  # of groups, one after the other; time and memory grow as 2 ** size
STEPS = 100  # in which all groups of a size are bounded
MOST_BINS = 10_000
PER_RADIUS = 10  # bins in which the UAV flies as far as it sees
LATE = (0.5, 0.9)  # shares of what can be met: when they are, particles are told apart by place
ROUNDING = 1e-9  # of a bin, by which a time may seem to lie in the next one
ROUNDING_M = 1e-6


@dataclass(frozen=True, eq=False)
class GroupHunts:
    """Groups of a problem's particles, and what one UAV can earn with each."""

    problem: Problem
    earliest_s: Floats  # (N,) when each particle could be seen if it were the only one; inf: never

    def most(self, stop: Callable[[float], bool]) -> float:
        """Return an expected reward that no flight's is above.

        Parameters
        ----------
        stop
            Hears the lowest bound after each step; once it says so, the search ends.
        """
        physics = least = float(self._alone.sum())
        for size in SIZES:
            groups, bounded = self._groups(size), physics
            ends = np.linspace(0, len(groups), STEPS + 1).astype(int).tolist()
            for begin, end in pairwise(ends):
                for group in groups[begin:end]:
                    bounded -= max(0.0, float(self._alone[group].sum()) - self.reward(group))
                least = min(least, bounded)
                if stop(least):
                    return least
        return least

    def reward(self, group: Ints) -> float:
        """Return a reward that no flight earns more than with a group of particles."""
        problem, starts_s = self.problem, self._starts_s
        edges_s = np.append(starts_s, starts_s[-1] + self._bin_s)
        places = _whereabouts(problem.futures, group, edges_s)
        bins = (self.earliest_s[group] - starts_s[0]) / self._bin_s - ROUNDING
        first = np.clip(bins, 0.0, len(starts_s)).astype(np.int32)
        around_m = 2.0 * problem.sensor.radius_m + ROUNDING_M
        onward_to = onward(places, around_m, self._bin_s * problem.uav.speed_mps)
        of_bins = problem.objective.reward(starts_s) * problem.futures.weight[group, None]
        return float(most_reward(first, onward_to, np.minimum(of_bins, self._alone[group, None])))

    @cached_property
    def _alone(self) -> Floats:
        """What each particle earns when it is seen as early as can be, (N,), with its weight."""
        reward = self.problem.objective.reward(self.earliest_s)
        return self.problem.futures.weight * reward

    @cached_property
    def _bin_s(self) -> float:
        uav = self.problem.uav
        flown_s = self.problem.sensor.radius_m / PER_RADIUS / uav.speed_mps
        return max(flown_s, (self._ends_s - uav.take_off_s) / MOST_BINS, ROUNDING)

    @property
    def _ends_s(self) -> float:
        uav = self.problem.uav
        return max(uav.take_off_s, min(self.problem.objective.ends_s, uav.landing_s))

    @cached_property
    def _starts_s(self) -> Floats:
        """When each bin starts, (bins,) seconds; the last one holds the end."""
        begins_s = self.problem.uav.take_off_s
        bins = int((self._ends_s - begins_s) / self._bin_s + ROUNDING) + 1
        return np.asarray(begins_s + self._bin_s * np.arange(bins))

    def _groups(self, size: int) -> list[Ints]:
        """Return groups of at most ``size`` particles, each with one of every cluster."""
        found = np.flatnonzero(self._alone > 0.0)
        if len(found) == 0:
            return []
        at_s = np.quantile(self.earliest_s[found], LATE)
        futures = self.problem.futures
        places = np.array([places_at(futures, k, at_s).ravel() for k in found.tolist()])
        clusters = [found[rows] for rows in split(places, np.arange(len(found)), size)]
        return [
            np.array([cluster[i] for cluster in clusters if i < len(cluster)])
            for i in range(max(map(len, clusters)))
        ]


def split(places: Floats, rows: Ints, parts: int) -> Iterator[Ints]:
    """Yield rows of places, (M, columns), in parts of about equal numbers of near ones.

    They are cut in two where they spread farthest, and the halves again.
    """
    if parts == 1:
        yield rows
        return
    widest = int(np.argmax(np.ptp(places[rows], axis=0)))
    by_place = rows[np.argsort(places[rows, widest], kind="stable")]
    few = parts // 2
    cut = round(len(rows) * few / parts)
    for some, into in ((by_place[:cut], few), (by_place[cut:], parts - few)):
        if len(some):
            yield from split(places, np.sort(some), into)


def _whereabouts(futures: Futures, group: Ints, edges_s: Floats) -> Whereabouts:
    """Return where particles are in the bins between some times, (bins + 1,)."""
    shape = (len(group), len(edges_s) - 1)
    xy_m, strays_m, there = np.empty((2, *shape)), np.empty(shape), np.empty(shape, dtype=bool)
    for i, k in enumerate(group.tolist()):
        xy_m[:, i] = places_at(futures, k, edges_s[:-1])
        strays_m[i] = np.diff(driven_at(futures, k, edges_s))
        there[i] = is_there(futures, k, edges_s)
    return Whereabouts(xy_m[0], xy_m[1], strays_m, there)
