"""Farthest reach: sampled motion thinned to what straight motion needs; compiled."""

from typing import NamedTuple

import numpy as np

from planner.arrays import Flags, Floats, Offsets
from planner.jit import compiled

WITHIN = 0.7071  # half the side of a square within a circle of radius 1, rounded down


class SampleColumns(NamedTuple):
    """Where N particles are at sampled times, each one's samples after the other's."""

    first_sample: Offsets  # (N + 1,) where a particle's samples start
    time_s: Floats  # (S,) seconds, rising within a particle
    x_m: Floats  # (S,) metres
    y_m: Floats  # (S,) metres


@compiled
def farthest_reach(samples: SampleColumns, tolerance_m: float, fixed: Flags) -> Flags:
    """Return which samples stay as knots, (S,).

    From each knot the next one is the farthest sample to which straight, even motion passes all
    samples in between within the tolerance, each at its own time. The first and the last sample
    of each particle stay, and so do the fixed ones, (S,): which others stay before one of these
    does not depend on what comes after it.
    """
    stays = np.zeros(len(samples.time_s), dtype=np.bool_)
    for particle in range(len(samples.first_sample) - 1):
        knot = samples.first_sample[particle]
        last = samples.first_sample[particle + 1] - 1
        if knot > last:
            continue
        stays[knot] = True
        while knot < last:
            knot = _reach(samples, knot, last, tolerance_m, fixed)
            stays[knot] = True
    return stays


class _Box(NamedTuple):
    """Velocities, m/s."""

    least_vx: float
    most_vx: float
    least_vy: float
    most_vy: float


@compiled
def _reach(samples: SampleColumns, knot: int, last: int, tolerance_m: float, fixed: Flags) -> int:
    """Return the farthest sample that straight, even motion from a knot reaches.

    Each sample passed allows the velocities of a disc. A sample whose own velocity is in the boxes
    within all discs is reached, one in the boxes around them perhaps; none is any more once those
    have nothing in common.
    """
    time_s, x_m, y_m = samples.time_s, samples.x_m, samples.y_m
    surely = perhaps = _Box(-np.inf, np.inf, -np.inf, np.inf)
    reached = ahead = knot + 1
    while ahead <= last and not _is_empty(perhaps):
        lasts_s = time_s[ahead] - time_s[knot]
        vx_mps, vy_mps = (x_m[ahead] - x_m[knot]) / lasts_s, (y_m[ahead] - y_m[knot]) / lasts_s
        if _holds(surely, vx_mps, vy_mps) or (
            _holds(perhaps, vx_mps, vy_mps) and _is_straight(samples, knot, ahead, tolerance_m)
        ):
            reached = ahead
        slack_mps = tolerance_m / lasts_s
        perhaps = _narrowed(perhaps, vx_mps, vy_mps, slack_mps)
        surely = _narrowed(surely, vx_mps, vy_mps, WITHIN * slack_mps)
        if fixed[ahead]:
            break
        ahead += 1
    return reached


@compiled
def _holds(box: _Box, vx_mps: float, vy_mps: float) -> bool:
    within_x = box.least_vx <= vx_mps <= box.most_vx
    return within_x and box.least_vy <= vy_mps <= box.most_vy


@compiled
def _is_empty(box: _Box) -> bool:
    return not (box.least_vx <= box.most_vx and box.least_vy <= box.most_vy)


@compiled
def _narrowed(box: _Box, vx_mps: float, vy_mps: float, slack_mps: float) -> _Box:
    return _Box(
        max(box.least_vx, vx_mps - slack_mps),
        min(box.most_vx, vx_mps + slack_mps),
        max(box.least_vy, vy_mps - slack_mps),
        min(box.most_vy, vy_mps + slack_mps),
    )


@compiled
def _is_straight(samples: SampleColumns, a: int, b: int, tolerance_m: float) -> bool:
    """Tell whether all samples between two are within the tolerance of even motion, at their time.

    The sample before the far end is looked at first: it is off more often than others.
    """
    time_s, x_m, y_m = samples.time_s, samples.x_m, samples.y_m
    lasts_s = time_s[b] - time_s[a]
    vx_mps, vy_mps = (x_m[b] - x_m[a]) / lasts_s, (y_m[b] - y_m[a]) / lasts_s
    for k in range(b - 1, a, -1):
        since_s = time_s[k] - time_s[a]
        off_x_m = x_m[a] + vx_mps * since_s - x_m[k]
        off_y_m = y_m[a] + vy_mps * since_s - y_m[k]
        if not off_x_m * off_x_m + off_y_m * off_y_m <= tolerance_m * tolerance_m:
            return False
    return True
