"""News of the target, and what it makes of the particles: their weights, and nothing else.

A report is true with the probability that is said of it. If it is false, it tells nothing: what is
taken for the target is where the target is believed to be. So a report weighs each particle with
1 - c + c g / sum(w g), where g is how likely the particle makes it, and w the belief at the time
it was heard, without other reports. Several multiply, in any order.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from planner.arrays import Floats
from planner.clock import clock
from planner.detection.likelihood import nearness, posterior
from planner.detection.sensor import Sensor, rate_of
from planner.detection.survival import Searched, survival
from planner.errors import Fault, InputError
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.messages import percent
from planner.mission.uav_places import place_faults_of, start_xy
from planner.network.road_network import RoadNetwork
from planner.network.street_names import no_edge
from planner.scenario.news import FoundNews, News, NothingNews, ReportNews, SearchedNews

LIKELY = 0.01  # of the belief has to be where a report has it; below, the belief is wrong
NEAR_SD = 2.0  # standard deviations from a report's place, within which it may be true
ALONG_M = 20.0  # between places that stand for a street
FOREVER_S = np.inf


def given(
    futures: Futures, news: Sequence[News], network: RoadNetwork, *, speed_mps: float
) -> Futures:
    """Return futures with the weights that their particles have after some news.

    Parameters
    ----------
    speed_mps
        Of the UAV, at which a search's ``detects`` holds where it says no other.

    Raises
    ------
    InputError
        If nothing is left of the belief.
    """
    if not news:
        return futures
    silent = _Silence(futures, network, news, speed_mps)
    likelihood = silent.missed_by(FOREVER_S)
    absent = np.ones(_targets(futures))
    for one in news:
        if isinstance(one, ReportNews):
            rows = futures.target == one.target
            likelihood *= np.where(rows, silent.report(one), 1.0)
            absent[one.target] *= 1.0 - one.sure
    found = [one.target for one in news if isinstance(one, FoundNews)]
    is_found = np.isin(futures.target, found)
    # Who is found has been seen after all, whatever was said of nobody's having been.
    weight = posterior(futures, np.where(is_found, 1.0, likelihood), absent)
    weight = np.where(is_found, 0.0, weight)
    if found and len(weight) and not weight.any():
        raise InputError(
            "news.heard: says of every target that it is found, so that nothing is left to search "
            "for; leave it out of one that is to be searched"
        )
    return futures.reweighted(weight)


def agreeing(
    futures: Futures,
    report: ReportNews,
    news: Sequence[News],
    network: RoadNetwork,
    *,
    speed_mps: float,
) -> float:
    """Return the probability that the target is where a report has it, as believed before it."""
    return _Silence(futures, network, news, speed_mps).agreeing(report)


class _Silence:
    """What is known of particles by nobody having seen them."""

    def __init__(
        self, futures: Futures, network: RoadNetwork, news: Sequence[News], speed_mps: float
    ) -> None:
        self._futures, self._network, self._speed_mps = futures, network, speed_mps
        self._news = [one for one in news if isinstance(one, NothingNews | SearchedNews)]

    def missed_by(self, time_s: float) -> Floats:
        """Return the probability that nobody has seen each particle by a time, (N,)."""
        found = np.ones(len(self._futures))
        for one in self._news:
            found *= self._missed(one, time_s)
        return found

    def report(self, one: ReportNews) -> Floats:
        """Return how likely each particle makes a report, (N,)."""
        near, weight = self._near(one), self._believed(one)
        usual = float(weight @ near)
        if usual <= 0.0:
            return np.full(len(near), 1.0 - one.sure)
        return 1.0 - one.sure + one.sure * near / usual

    def agreeing(self, one: ReportNews) -> float:
        """Return the probability that a particle is where a report has it."""
        return float(self._believed(one) @ (self._near(one) >= np.exp(-(NEAR_SD**2) / 2.0)))

    def _near(self, one: ReportNews) -> Floats:
        places_m = places_of(one, self._network)
        return nearness(self._futures, places_m, one.at_s, radius_m=one.radius_m, sd_m=one.sd_m)

    def _believed(self, one: ReportNews) -> Floats:
        """Return what was believed of a report's target when it was heard, but for reports."""
        mine = self._futures.target == one.target
        unseen = np.where(mine, self.missed_by(one.heard_s), 1.0)
        absent = np.ones(_targets(self._futures))
        return np.where(mine, posterior(self._futures, unseen, absent), 0.0)

    def _missed(self, one: NothingNews | SearchedNews, time_s: float) -> Floats:
        if isinstance(one, SearchedNews):
            return self._unseen(track_of(one), self._sensor(one), time_s)
        spent = np.array([one.from_s, one.to_s])
        seen = np.zeros(len(self._futures), dtype=bool)
        for x_m, y_m in places_of(one, self._network).tolist():
            watch = Track(spent, np.full(2, x_m), np.full(2, y_m), spent[None, :])
            seen |= self._unseen(watch, Sensor(one.radius_m), time_s) < 1.0
        return np.where(seen, 1.0 - one.sure, 1.0)

    def _unseen(self, track: Track, sensor: Sensor, time_s: float) -> Floats:
        by_s = min(time_s, track.end_s)
        return survival(self._futures, [Searched(track, sensor)]).at(by_s)

    def _sensor(self, one: SearchedNews) -> Sensor:
        rate_per_s = rate_of(one.detects, one.radius_m, one.speed_mps or self._speed_mps)
        return Sensor(one.radius_m, rate_per_s=rate_per_s)


def _targets(futures: Futures) -> int:
    """Return how many targets particles are of."""
    return int(futures.target.max(initial=0)) + 1


def track_of(one: SearchedNews) -> Track:
    """Return the flight of a search."""
    time_s, x_m, y_m = np.array(one.waypoints, dtype=np.float64).T
    on = [(time_s[0], time_s[-1])] if one.sensor_on is None else one.sensor_on
    return Track(time_s, x_m, y_m, np.array(on, dtype=np.float64).reshape(-1, 2))


def search_of(track: Track, sensor: Sensor, speed_mps: float) -> SearchedNews:
    """Return a flight that has found nothing as news.

    Parameters
    ----------
    speed_mps
        At which what its sensor detects is told.
    """
    return SearchedNews(
        kind="searched",
        waypoints=np.stack([track.time_s, track.x_m, track.y_m], axis=1).tolist(),
        sensor_on=track.sensor_on.tolist(),
        radius_m=sensor.radius_m,
        detects=sensor.detects(speed_mps),
        speed_mps=speed_mps,
    )


def places_of(one: ReportNews | NothingNews, network: RoadNetwork) -> Floats:
    """Return where news is of, (P, 2) metres; a street stands as places along it."""
    if one.place is not None:
        return np.array([start_xy(one.place, network)])
    lines, points = network.edge_lines, []
    for name in one.edges or ():
        edge = network.edge_index[name]
        length_m = float(lines.length_m[edge])
        along_m = np.linspace(0.0, length_m, max(2, int(length_m / ALONG_M) + 1))
        points.append(lines.at(np.full(len(along_m), edge), along_m))
    return np.concatenate(points)


def refuse_unlikely(
    futures: Futures,
    report: ReportNews,
    news: Sequence[News],
    network: RoadNetwork,
    *,
    speed_mps: float,
) -> None:
    """Do nothing if a report may be true by what is believed.

    Raises
    ------
    InputError
        If hardly any of the belief is where it has the target.
    """
    share = agreeing(futures, report, news, network, speed_mps=speed_mps)
    if share < LIKELY:
        raise InputError(
            f"the report of {clock(report.at_s)}: only {percent(share)} of what is believed is "
            f"there then, less than {percent(LIKELY, 0)}; check its place and time, give it a "
            "larger radius, or have it count all the same: --insist"
        )


def target_faults(news: Sequence[News], targets: int = 1) -> Iterator[Fault]:
    """Yield news of targets that there are not."""
    for k, one in enumerate(news):
        if isinstance(one, ReportNews | FoundNews) and one.target >= targets:
            most = "there is one, target 0" if targets == 1 else f"they are 0 to {targets - 1}"
            yield Fault(f"news.heard[{k}].target", f"{one.target} is none of the targets; {most}")


def news_faults(news: Sequence[News], network: RoadNetwork, targets: int = 1) -> Iterator[Fault]:
    """Yield what news names that the net does not have, and of targets that there are not."""
    yield from target_faults(news, targets)
    for k, one in enumerate(news):
        if not isinstance(one, ReportNews | NothingNews):
            continue
        key = f"news.heard[{k}]"
        for name in one.edges or ():
            if name not in network.edge_index:
                yield Fault(f"{key}.edges", no_edge(name, network))
        if one.place is not None:
            yield from place_faults_of(f"{key}.place", one.place, network)
