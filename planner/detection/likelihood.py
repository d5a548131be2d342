"""How likely each particle makes what has been learnt of the target: Bayes' rule on weights."""

import numpy as np
from scipy.spatial import cKDTree

from planner.arrays import Floats
from planner.errors import NothingLeftError
from planner.futures.futures import Futures

ROUNDING = 1e-9  # by which probabilities that sum to one may miss it


def nearness(
    futures: Futures,
    places_m: Floats,
    at_s: float,
    *,
    radius_m: float | None = None,
    sd_m: float | None = None,
) -> Floats:
    """Return how likely a true sighting names one of some places, by particle, (N,) from 0 to 1.

    Parameters
    ----------
    places_m
        (P, 2) metres; the nearest counts.
    at_s
        When it was seen there, seconds on the target's clock.
    radius_m, sd_m
        One of them: how near it was at most, or the standard deviation of the place.
    """
    xy_m = futures.positions(at_s)
    there = np.isfinite(xy_m[:, 0])
    away_m = np.full(len(futures), np.inf)
    if there.any():
        away_m[there] = cKDTree(places_m).query(xy_m[there])[0]
    if sd_m is None:
        return np.asarray(away_m <= (radius_m or 0.0), dtype=np.float64)
    return np.asarray(np.exp(-0.5 * (away_m / sd_m) ** 2))


def posterior(futures: Futures, likelihood: Floats, absent: Floats) -> Floats:
    """Return the weights that particles have once something is known, (N,).

    What is left of each target, and that it is not there at all, are as likely among each other as
    before.

    Parameters
    ----------
    likelihood
        Of what is known, by particle, (N,).
    absent
        Of the same if a target is not there at all, by target, (J,).

    Raises
    ------
    NothingLeftError
        If nothing is left that agrees with it.
    """
    weight = futures.weight * likelihood
    for target, unseen in enumerate(absent.tolist()):
        rows = futures.target == target
        nowhere = 1.0 - float(futures.weight[rows].sum())
        total = float(weight[rows].sum()) + (nowhere * unseen if nowhere > ROUNDING else 0.0)
        if rows.any() and total <= 0.0:
            raise NothingLeftError(
                "news: nothing that is believed of the target agrees with it; leave the news out "
                "that is least sure, or describe the target anew ([target])"
            )
        weight[rows] /= total or 1.0
    return weight


def draws(weight: Floats) -> float:
    """Return how many equal particles weights are worth: (sum w)^2 / sum w^2."""
    square = float(weight @ weight)
    return float(weight.sum()) ** 2 / square if square > 0.0 else 0.0
