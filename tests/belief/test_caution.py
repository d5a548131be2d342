"""A belief with some doubt: its own part is untouched, the other holds what it leaves out."""

import numpy as np
import pytest

from planner.belief.caution import FASTER, SLOWER, cautious
from planner.belief.mixture import Mixture
from planner.mission.opening import open_scenario


def test_no_caution_leaves_the_belief_as_it_is() -> None:
    opened = open_scenario("grid5x5")
    assert cautious(opened.prior, 0.0, opened.network) is opened.prior


def test_a_share_of_it_is_wider() -> None:
    opened = open_scenario("grid5x5", overrides=["target.caution=0.1"])
    assert isinstance(opened.prior, Mixture)
    own, wide = opened.prior.parts
    assert opened.prior.share == pytest.approx([0.9, 0.1])
    assert (own.speed_mps.low, own.speed_mps.high) == (15.0, 25.0)
    assert (wide.speed_mps.low, wide.speed_mps.high) == (SLOWER * 15.0, FASTER * 25.0)
    assert np.array_equal(own.edge_probability, wide.edge_probability)


def test_true_targets_have_none() -> None:
    opened = open_scenario("grid5x5", overrides=["target.caution=0.1"])
    assert not isinstance(opened.truth_prior, Mixture)


def test_a_mixture_is_widened_part_by_part() -> None:
    opened = open_scenario("grid5x5")
    both = Mixture(np.array([0.25, 0.75]), (opened.prior, opened.prior))
    assert cautious(both, 0.2, opened.network).share == pytest.approx([0.2, 0.6, 0.05, 0.15])
