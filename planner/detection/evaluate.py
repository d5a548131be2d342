"""What flights achieve together against futures."""

from collections.abc import Sequence

import numpy as np

from planner.detection.evaluation import Evaluation
from planner.detection.first_detection import first_detection
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.flight.track import Track
from planner.futures.futures import Futures


def evaluate(
    tracks: Sequence[Track], futures: Futures, sensor: Sensor, objective: Objective
) -> Evaluation:
    """Return what flights achieve together against futures: each target's earliest sighting."""
    seen_at = np.full(len(futures), np.inf)
    for track in tracks:
        np.minimum(seen_at, first_detection(futures, track, sensor.radius_m), out=seen_at)
    return Evaluation(seen_at, futures.weight, futures.end_s, objective)
