"""What flights achieve together against futures."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.detection.evaluation import Evaluation
from planner.detection.first_detection import first_detection
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor
from planner.detection.survival import Searched, survival
from planner.flight.track import Track
from planner.futures.futures import Futures


def evaluate(
    tracks: Sequence[Track], futures: Futures, sensor: Sensor, objective: Objective
) -> Evaluation:
    """Return what flights with the same sensor achieve together against futures."""
    return evaluate_all([Searched(track, sensor) for track in tracks], futures, objective)


def evaluate_all(
    searched: Sequence[Searched], futures: Futures, objective: Objective
) -> Evaluation:
    """Return what flights achieve together against futures.

    With perfect sensors that is each target's earliest sighting; else the exposures of all flights
    add up.
    """
    run = None if futures.fates is None else futures.fates.realisation
    target = None if objective.sought == 1 else futures.target
    if not all(sensor.is_perfect for _, sensor in searched):
        unseen = survival(futures, searched)
        found = Evaluation.of_survival(unseen, futures.weight, futures.end_s, objective)
        return replace(found, run=run, target=target)
    seen_at = np.full(len(futures), np.inf)
    for track, sensor in searched:
        np.minimum(seen_at, first_detection(futures, track, sensor.radius_m), out=seen_at)
    return Evaluation(seen_at, futures.weight, futures.end_s, objective, run=run, target=target)
