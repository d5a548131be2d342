"""A belief with some doubt in it: a widened one mixed in, for the case that it is wrong.

A narrow belief that is wrong is a disaster for the search; a tenth of a wide one costs a percent or
two where it is right. News cannot make up for it: a plan made anew of the same belief repeats the
same mistake.
"""

from dataclasses import replace

import numpy as np

from planner.belief.distribution import Distribution, Uniform
from planner.belief.mixture import Mixture, OneBelief, parts_of
from planner.belief.prior import Prior, turn_probability
from planner.network.road_network import RoadNetwork

SLOWER, FASTER = 0.6, 1.3  # times the least speed, and the greatest


def cautious(belief: OneBelief, share: float, network: RoadNetwork) -> OneBelief:
    """Return a belief of which a share is widened: any speed about as high, and any turn.

    Parameters
    ----------
    share
        From 0 to below 1; 0 leaves the belief as it is.
    """
    if share == 0.0:
        return belief
    parts = parts_of(belief)
    shares = belief.share if isinstance(belief, Mixture) else np.ones(1)
    wide = tuple(_widened(part, network) for part in parts)
    return Mixture(np.concatenate([(1.0 - share) * shares, share * shares]), (*parts, *wide))


def _widened(prior: Prior, network: RoadNetwork) -> Prior:
    """Return a prior with other speeds, and turns by chance in place of where it is said to go."""
    return replace(
        prior,
        speed_mps=_wider(prior.speed_mps),
        turn_probability=turn_probability(network, {}),
        goals=None,
    )


def _wider(speed: Distribution) -> Distribution:
    return Uniform(SLOWER * speed.low, FASTER * speed.high)
