"""What a flight is worth that is flown as planned, but sooner or later."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from planner.detection.evaluate import evaluate
from planner.detection.evaluation import Evaluation
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.track import Track
from planner.futures.futures import Futures


@dataclass(frozen=True)
class Timing:
    """How the times of a flight differ from those planned."""

    pace: float = 1.0  # the time from take-off to a place is so many times that planned
    late_s: float = 0.0  # it takes off so many seconds later

    def of(self, track: Track) -> Track:
        """Return a track as it is flown at other times."""
        start_s = float(track.time_s[0]) if len(track.time_s) else 0.0
        first_s = start_s + self.late_s
        return replace(
            track,
            time_s=first_s + self.pace * (track.time_s - start_s),
            sensor_on=first_s + self.pace * (track.sensor_on - start_s),
        )


TIMINGS = (Timing(pace=0.97), Timing(pace=1.03), Timing(late_s=10.0))


@dataclass(frozen=True, eq=False)
class Mistimed:
    """What a flight is worth at other times."""

    timing: Timing
    evaluated: Evaluation


def mistimed(
    tracks: Sequence[Track], targets: Futures, sensor: Sensor, objective: Objective
) -> tuple[Mistimed, ...]:
    """Return what a plan is worth if it is flown at each of `TIMINGS`."""
    return tuple(
        Mistimed(timing, evaluate([*map(timing.of, tracks)], targets, sensor, objective))
        for timing in TIMINGS
    )
