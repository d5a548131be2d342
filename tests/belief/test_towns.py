"""Particles in towns: each is the same, however many there are and whatever the horizon."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from planner.belief.distribution import Uniform
from planner.belief.particles import Particles
from planner.belief.prior import Prior, turn_probability
from planner.belief.routes import AHEAD_EDGES, AHEAD_M
from planner.belief.sampling import TURNS, Sampling, sample
from planner.network.road_network import RoadNetwork
from planner.streams import stream
from support.sumo_instances import grid5x5, town

DRAWN: list[Sampling] = ["iid", "sobol"]


def free(network: RoadNetwork, *, speed_per_road: bool = False) -> Prior:
    return Prior(
        edge_probability=network.edge_length_m / network.edge_length_m.sum(),
        distance_m=None,
        speed_mps=Uniform(2.0, 14.0),
        turn_probability=turn_probability(network, {}),
        speed_per_road=speed_per_road,
        driving="free",
        gone=False,
        probability_present=1.0,
    )


def draw(prior: Prior, n: int, horizon_s: float, sampling: Sampling) -> Particles:
    return sample(prior, town(), n, stream(1, "x"), sampling=sampling, horizon_s=horizon_s)


def assert_prefix(few: Particles, many: Particles) -> None:
    """Assert that all is the same but for the weights, and where routes end."""
    for name in ("start_m", "seed", "phase_s", "depart_s", "gone"):
        assert getattr(few, name).tolist() == getattr(many, name)[: len(few)].tolist(), name
    for k in range(len(few)):
        shared = len(few.route(k))
        assert few.route(k).tolist() == many.route(k)[:shared].tolist()
        assert few.speeds(k).tolist() == many.speeds(k)[:shared].tolist()


@pytest.mark.parametrize("block", [None, 2000])  # in one block of rows, or in blocks of 8 to 16
@pytest.mark.parametrize("speed_per_road", [False, True])
@pytest.mark.parametrize("sampling", DRAWN)
def test_neither_their_number_nor_the_horizon_changes_a_particle(
    sampling: Sampling, speed_per_road: bool, block: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    prior = free(town(), speed_per_road=speed_per_road)
    many = draw(prior, 300, 2400.0, sampling)  # in one block
    turns = np.diff(many.first_edge) - 1
    assert turns.max() > TURNS + 20
    assert speed_per_road or turns.min() < TURNS  # blocks take different numbers of columns
    if block is not None:
        monkeypatch.setattr("planner.belief.uniforms.BLOCK", block)
    for n, horizon_s in product((1, 7, 64, 65, 300), (1.0, 300.0, 900.0, 2400.0)):
        assert_prefix(draw(prior, n, horizon_s, sampling), many)


def test_particles_are_evenly_spread() -> None:
    """So many points of the sequence have one value in each of as many strips."""
    particles = draw(free(town()), 256, 300.0, "sobol")
    speed_mps = particles.speed_mps[particles.first_edge[:-1]]
    assert sorted(np.floor((speed_mps - 2.0) / 12.0 * 256).astype(int)) == list(range(256))


@pytest.mark.parametrize("sampling", DRAWN)
def test_routes_go_on_as_far_as_drivers_look_ahead(sampling: Sampling) -> None:
    network = town()
    particles = draw(free(network), 100, 200.0, sampling)
    length_m = network.edge_length_m
    for k in range(100):
        route, speed = particles.route(k).tolist(), float(particles.speeds(k)[0])
        at_s, ahead = (length_m[route[0]] - particles.start_m[k]) / speed, 0
        while at_s < 200.0:
            ahead += 1
            at_s += length_m[route[ahead]] / speed
        beyond = route[ahead + 1 :]
        if len(network.turns(route[-1])) == 0:
            continue
        assert len(beyond) >= AHEAD_EDGES
        assert length_m[beyond].sum() >= AHEAD_M
        assert len(beyond) == AHEAD_EDGES or length_m[beyond[:-1]].sum() < AHEAD_M


def test_where_all_is_abstract_routes_end_at_the_horizon() -> None:
    network = grid5x5()
    free_there = free(network)
    constant = replace(free_there, driving="constant")
    for sampling in DRAWN:
        routes = [
            sample(p, network, 50, stream(1), sampling=sampling, horizon_s=900.0).route_edge
            for p in (free_there, constant)
        ]
        assert routes[0].tolist() == routes[1].tolist()
