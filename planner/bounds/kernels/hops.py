"""What hops may see and surely see from each of many start times on, compiled."""

import numpy as np

from planner.arrays import Floats, Ints, Offsets
from planner.detection.kernels.closest_approach import first_within
from planner.jit import compiled


@compiled
def apart(a: Floats, b: Floats, reach_m: float) -> bool:
    """Return True only if two segments (x, y, far x, far y) are nowhere within reach."""
    for i in range(2):
        if max(a[i], a[i + 2]) + reach_m < min(b[i], b[i + 2]) or max(
            b[i], b[i + 2]
        ) + reach_m < min(a[i], a[i + 2]):
            return True
    for one, other in ((a, b), (b, a)):
        ux, uy = one[2] - one[0], one[3] - one[1]
        far_m = np.sqrt(ux * ux + uy * uy)
        if far_m > 0.0:
            s = ((other[1] - one[1]) * ux - (other[0] - one[0]) * uy) / far_m
            t = ((other[3] - one[1]) * ux - (other[2] - one[0]) * uy) / far_m
            if min(s, t) > reach_m or max(s, t) < -reach_m:
                return True
    return False


@compiled
def sweep(
    segments: Floats,
    pieces: Floats,
    who: Ints,
    bins: tuple[float, float, int],
    reach_m: float,
    out: Floats,
) -> None:
    """Lower ``out`` (bins, N) to the first second at which a hop has each particle within reach.

    Parameters
    ----------
    segments, pieces
        Of the hop, by seconds after its start, and of the particles, by seconds: from, to, place
        at from, velocity; (S, 6) and (P, 6). ``who`` names the particle of each piece.
    bins
        The hop's first start, the seconds from one start to the next, and how many there are.
    """
    first_s, step_s, many = bins
    a, b = np.empty(4), np.empty(4)
    for segment in segments:
        begin_s, end_s, x, y, ux, uy = segment
        a[0], a[1] = x, y
        a[2], a[3] = x + ux * (end_s - begin_s), y + uy * (end_s - begin_s)
        latest_s = first_s + (many - 1) * step_s + end_s
        for p in range(len(pieces)):
            from_s, to_s, px, py, vx, vy = pieces[p]
            if from_s > latest_s or to_s < first_s + begin_s:
                continue
            low = max(0, int(np.ceil((from_s - end_s - first_s) / step_s - 1e-9)))
            until_s = min(to_s, latest_s)
            high = min(many - 1, int(np.floor((until_s - begin_s - first_s) / step_s + 1e-9)))
            b[0], b[1] = px, py
            b[2], b[3] = px + vx * (until_s - from_s), py + vy * (until_s - from_s)
            if low > high or apart(a, b, reach_m):
                continue
            for i in range(low, high + 1):
                start_s = first_s + i * step_s
                on_s = max(start_s + begin_s, from_s)
                off_s = min(start_s + end_s, to_s)
                if on_s > off_s or out[i, who[p]] <= on_s:
                    continue
                flown_s, gone_s = on_s - start_s - begin_s, on_s - from_s
                offset = (
                    px + vx * gone_s - x - ux * flown_s,
                    py + vy * gone_s - y - uy * flown_s,
                )
                after_s = first_within(offset, (vx - ux, vy - uy), off_s - on_s, reach_m)
                if on_s + after_s < out[i, who[p]]:
                    out[i, who[p]] = on_s + after_s


@compiled
def listed(seen_at: Floats, until_s: float) -> tuple[Offsets, Ints, Floats]:
    """Return how many sightings each start has up to ``until_s``, who, and when."""
    counts = np.zeros(len(seen_at), dtype=np.int64)
    for i in range(len(seen_at)):
        for k in range(seen_at.shape[1]):
            counts[i] += seen_at[i, k] <= until_s
    who, when, n = np.empty(counts.sum(), np.int32), np.empty(counts.sum()), 0
    for i in range(len(seen_at)):
        for k in range(seen_at.shape[1]):
            if seen_at[i, k] <= until_s:
                who[n], when[n] = k, seen_at[i, k]
                n += 1
    return counts, who, when


@compiled
def known_after(first: Offsets, who: Ints, sure: Ints, before: tuple[Ints, Ints]) -> Ints:
    """Return, for each sighting of a leg, after which legs its particle is surely seen, (M,).

    Bit ``b`` says so of the b-th of the legs before.

    Parameters
    ----------
    sure
        Bit ``k`` (highest first) says that a leg from a start on surely sees particle ``k``,
        (legs, bins, N / 8).
    before
        The legs that may come before, (b,), and how many bins ago they begin then, at least and
        at most, (b, 2).
    """
    legs, ago = before
    known = np.zeros(len(who), dtype=np.uint8)
    for i in range(len(first) - 1):
        for b in range(len(legs)):
            late, early = i - ago[b, 0], i - ago[b, 1]
            if early >= 0:
                for e in range(first[i], first[i + 1]):
                    byte, bit = who[e] >> 3, 7 - (who[e] & 7)
                    both = sure[legs[b], early, byte] & sure[legs[b], late, byte]
                    known[e] |= ((both >> bit) & 1) << b
    return known
