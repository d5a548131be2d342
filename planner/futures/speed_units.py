"""Recorded speeds in kilometres per hour, recognised by the places and times beside them."""

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np

from planner.futures.fcd import Samples

log = logging.getLogger(__name__)

KMH_PER_MPS = 3.6
CLOSE = 0.05  # share by which most vehicles' ratios may differ from 3.6
MOVES_MPS = 1.0  # slower ones have speeds of too few digits


def in_mps(path: Path, samples: Samples) -> Samples:
    """Return samples with their speeds in m/s; what were km/h is said in the log.

    Speeds are taken for km/h if the middle half of the samples say 3.6 times what their places and
    times do. Sparse samples, between which roads bend and cars stop, differ too much for that.
    """
    same = np.diff(samples.vehicle) == 0
    lasts_s = np.where(same, np.diff(samples.time_s), 1.0)
    driven_mps = np.hypot(np.diff(samples.x_m), np.diff(samples.y_m)) / lasts_s
    said = (samples.speed_mps[1:] + samples.speed_mps[:-1]) / 2
    moves = same & (driven_mps > MOVES_MPS) & (said > MOVES_MPS)
    if not moves.any():
        return samples
    low, high = np.quantile(said[moves] / driven_mps[moves], (0.25, 0.75))
    if not KMH_PER_MPS * (1 - CLOSE) <= low <= high <= KMH_PER_MPS * (1 + CLOSE):
        return samples
    log.warning(
        "%s: its speeds are %.1f times what its places and times say; taken for km/h",
        path,
        KMH_PER_MPS,
    )
    return replace(samples, speed_mps=samples.speed_mps / KMH_PER_MPS)
