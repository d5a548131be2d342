"""What moves over a net in sumo-gui: the UAVs, what their sensors see, and the targets."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.evaluate import evaluate
from planner.export.sumo_gui import LABEL
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.futures.futures import Futures
from planner.mission.plan_file import StoredPlan
from planner.network.road_network import RoadNetwork

Colour = tuple[int, int, int, int]

UNSEEN, SEEN = (0, 158, 115, 255), (110, 110, 110, 255)
UAV, DISC, DISC_OFF = (0, 0, 0, 255), (255, 226, 120, 255), (228, 228, 228, 255)
DOTS = 80  # side by side they are as wide as the net
# Roads are at 0, and what lies on them up to 101; sumo-gui shows nothing through a disc above them.
DISC_LAYER, SEEN_LAYER, UNSEEN_LAYER, UAV_LAYER = -1, 300, 301, 302


class Look(NamedTuple):
    """How a round mark is drawn."""

    colour: Colour
    width_m: float
    layer: int
    label: str = ""


class Mark(NamedTuple):
    """A round mark."""

    place_m: Sequence[float]  # x and y
    look: Look


@dataclass(frozen=True, eq=False)
class Scene:
    """A plan and the targets that it looks for."""

    plan: Plan
    futures: Futures
    seen_at: Floats  # (N,) seconds at which each target is seen first; infinity: never
    radius_m: float  # of the sensor
    size_m: float  # of the net

    @classmethod
    def of(
        cls, stored: StoredPlan, futures: Futures, network: RoadNetwork, *, most: int
    ) -> "Scene":
        """Return a plan among at most so many of the targets that it was made for."""
        some = futures.take(equally_likely(futures.weight, most))
        evaluation = evaluate(stored.plan.tracks, some, stored.sensor, stored.objective)
        size_m = float(np.ptp(network.shape_xy_m, axis=0).max())
        return cls(stored.plan, some, evaluation.seen_at, stored.sensor.radius_m, size_m)

    def marks(self, time_s: float) -> dict[str, Mark]:
        """Return all that is to be seen at a time, by name."""
        return self._targets(time_s) | self._uavs(time_s)

    def _targets(self, time_s: float) -> dict[str, Mark]:
        dot_m = self.size_m / DOTS
        looks = Look(UNSEEN, dot_m, UNSEEN_LAYER), Look(SEEN, 0.7 * dot_m, SEEN_LAYER)
        xy_m, seen = self.futures.positions(time_s), (self.seen_at <= time_s).tolist()
        there = np.flatnonzero(~np.isnan(xy_m[:, 0])).tolist()
        places = xy_m.tolist()
        return {f"target{k}": Mark(places[k], looks[seen[k]]) for k in there}

    def _uavs(self, time_s: float) -> dict[str, Mark]:
        marks = {}
        several = len(self.plan.tracks) > 1
        for number, track in enumerate(self.plan.tracks):
            if len(track.time_s) == 0:
                continue
            at_s = min(max(time_s, float(track.time_s[0])), track.end_s)
            place = track.xy(at_s).tolist()
            colour = DISC if _is_on(track, time_s) else DISC_OFF
            label = f"UAV {number + 1}" if several else "UAV"
            uav = Look(UAV, 1.6 * self.size_m / DOTS, UAV_LAYER, label)
            marks[f"uav{number}"] = Mark(place, uav)
            disc = Look(colour, 2.0 * self.radius_m, DISC_LAYER)
            marks[f"uav{number}.disc"] = Mark(place, disc)
        return marks


def _is_on(track: Track, time_s: float) -> bool:
    """Return whether the sensor is on."""
    return bool(np.any((track.sensor_on[:, 0] <= time_s) & (time_s <= track.sensor_on[:, 1])))


def equally_likely(weight: Floats, many: int) -> Ints:
    """Return which targets to show, so that equally many dots are equally likely.

    Parameters
    ----------
    weight
        Probabilities, (N,).
    many
        How many at most; there are fewer where some are far more likely than others.
    """
    if len(weight) <= many:
        return np.arange(len(weight))
    up_to = np.cumsum(weight)
    marks = (np.arange(many) + 0.5) / many * up_to[-1]
    return np.unique(np.searchsorted(up_to, marks))


@dataclass(eq=False)
class Canvas:
    """The marks that a connection to sumo-gui shows; only what changes is told to it."""

    gui: Any  # of the package traci
    _shown: dict[str, Mark] = field(default_factory=dict)

    def show(self, marks: Mapping[str, Mark]) -> None:
        """Show these marks and no others."""
        kept = {
            name: shown
            for name, shown in self._shown.items()
            if name in marks and marks[name].look == shown.look
        }
        for name in self._shown.keys() - kept.keys():
            self.gui.poi.remove(name, self._shown[name].look.layer)
        for name, mark in marks.items():
            if name not in kept:
                self._add(name, mark)
            elif kept[name] != mark:
                self.gui.poi.setPosition(name, *mark.place_m)
        self._shown = dict(marks)

    def _add(self, name: str, mark: Mark) -> None:
        colour, width_m, layer, label = mark.look
        size = {"width": width_m, "height": width_m}
        self.gui.poi.add(name, *mark.place_m, colour, "", layer, **size)
        if label:
            self.gui.poi.setParameter(name, LABEL, label)
