"""Particles of several targets: each has its own stream, and they share the particles evenly."""

import numpy as np
import pytest

from planner.belief.mixture import Several
from planner.belief.particles import Particles
from planner.belief.sampling import Sampling, sample
from planner.errors import InputError
from planner.mission.opening import OpenScenario, open_scenario
from planner.streams import stream

TWO = 'target=[{start={"r0c0-r0c1"=1}},{start={"r4c0-r5c0"=1},probability_present=0.6}]'


@pytest.fixture(scope="module")
def two() -> OpenScenario:
    return open_scenario("grid5x5", overrides=[TWO])


def drawn(opened: OpenScenario, n: int, sampling: Sampling = "iid") -> Particles:
    rng = stream(1, "test")
    return sample(opened.prior, opened.network, n, rng, sampling=sampling, horizon_s=2000.0)


@pytest.mark.parametrize("sampling", ["iid", "sobol"])
@pytest.mark.parametrize("n", [2, 7, 64])
def test_weights_of_each_sum_to_its_presence(two: OpenScenario, n: int, sampling: Sampling) -> None:
    particles = drawn(two, n, sampling)
    assert particles.target.tolist() == [k % 2 for k in range(n)]
    total = np.bincount(particles.target, particles.weight)
    assert total == pytest.approx([1.0, 0.6])


def test_a_target_has_its_own_start(two: OpenScenario) -> None:
    particles = drawn(two, 8)
    first = particles.route_edge[particles.first_edge[:-1]]
    assert {two.network.edge_ids[edge] for edge in first[::2]} == {"r0c0-r0c1"}
    assert {two.network.edge_ids[edge] for edge in first[1::2]} == {"r4c0-r5c0"}


def test_a_target_is_drawn_whatever_the_others_are(two: OpenScenario) -> None:
    assert isinstance(two.prior, Several)
    fewer, more = drawn(two, 8), drawn(two, 20)
    assert (fewer.speed_mps[:4] == more.speed_mps[:4]).all()
    other = open_scenario("grid5x5", overrides=[TWO, "target.0.speed_mps={constant=3}"])
    one, same = drawn(two, 8).take(np.arange(1, 8, 2)), drawn(other, 8).take(np.arange(1, 8, 2))
    assert one.speed_mps.tolist() == same.speed_mps.tolist()
    assert one.route_edge.tolist() == same.route_edge.tolist()


def test_fewer_particles_than_targets_are_refused(two: OpenScenario) -> None:
    with pytest.raises(InputError, match="1 particles are too few for 2 targets"):
        drawn(two, 1)


def test_targets_drive_alike(two: OpenScenario) -> None:
    assert isinstance(two.prior, Several)
    with pytest.raises(InputError, match="two beliefs or more"):
        Several(two.prior.targets[:1])
