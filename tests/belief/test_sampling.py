"""Particles against exact probabilities, and routes against a slow walk."""

import math
import warnings
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from planner.arrays import Floats
from planner.belief.distribution import Distribution, Listed, Normal, Uniform
from planner.belief.particles import Particles
from planner.belief.predefined import predefined
from planner.belief.prior import Prior, turn_probability
from planner.belief.routes import most_turns
from planner.belief.sampling import Sampling, sample
from planner.errors import InputError
from planner.network.road_network import RoadNetwork
from planner.streams import stream
from support.instances import by_two_letters, figure1, figure3, grid

DRAWN: list[Sampling] = ["iid", "sobol"]
# Two-way roads and a way round: A-B-C-A in both directions, and a dead end at D.
TOWN_XY = {"A": (0.0, 0.0), "B": (300.0, 0.0), "C": (0.0, 400.0), "D": (300.0, 100.0)}
TOWN = by_two_letters(TOWN_XY, "AB BA BC CB CA AC BD DB")
FAST = Uniform(15, 25)
SLOW = Listed(np.array([2.0, 5.0]), np.array([0.25, 0.75]))


def prior(
    network: RoadNetwork,
    start: dict[str, float] | None = None,
    *,
    distance_m: Distribution | None = None,
    speed_mps: Distribution = FAST,
    turns: dict[str, dict[str, float]] | None = None,
    speed_per_road: bool = False,
    gone: bool = False,
    probability_present: float = 1.0,
) -> Prior:
    probability = network.edge_length_m / network.edge_length_m.sum()
    if start is not None:
        probability = np.array([start.get(name, 0.0) for name in network.edge_ids])
    return Prior(
        edge_probability=probability,
        distance_m=distance_m,
        speed_mps=speed_mps,
        turn_probability=turn_probability(network, turns or {}),
        speed_per_road=speed_per_road,
        driving="constant",
        gone=gone,
        probability_present=probability_present,
    )


def grid_prior(network: RoadNetwork) -> Prior:
    start = {"r0c0-r0c1": 0.5, "r0c0-r1c0": 0.5}
    return prior(network, start, distance_m=Uniform(0, 7500))


def names(network: RoadNetwork, particles: Particles, k: int) -> str:
    return " ".join(network.edge_ids[edge] for edge in particles.route(k))


def draw(
    belief: Prior,
    network: RoadNetwork,
    n: int,
    sampling: Sampling = "iid",
    *,
    horizon_s: float = 10000.0,
    seed: int = 1,
) -> Particles:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return sample(belief, network, n, stream(seed), sampling=sampling, horizon_s=horizon_s)


def assert_route_is_driven(
    network: RoadNetwork, particles: Particles, k: int, horizon_s: float
) -> None:
    """Drive it slowly: the route goes on just as long as there is time and a way on."""
    route, speeds = particles.route(k).tolist(), particles.speeds(k).tolist()
    assert 0 <= particles.start_m[k] <= network.edge_length_m[route[0]]
    for before, after in pairwise(route):
        assert after in network.turns(before)
    time_s, left_m = 0.0, network.edge_length_m[route[0]] - particles.start_m[k]
    for i, speed in enumerate(speeds):
        assert time_s < horizon_s
        time_s += left_m / speed
        left_m = network.edge_length_m[route[i + 1]] if i + 1 < len(route) else 0.0
    assert time_s >= horizon_s or len(network.turns(route[-1])) == 0


@pytest.mark.parametrize("sampling", DRAWN)
@pytest.mark.parametrize("speed_per_road", [False, True])
def test_routes_go_on_to_a_sink_or_the_horizon(sampling: Sampling, speed_per_road: bool) -> None:
    for network, speed in ((TOWN, Uniform(1, 30)), (figure1(), Uniform(1, 30)), (TOWN, SLOW)):
        belief = prior(network, speed_mps=speed, speed_per_road=speed_per_road)
        particles = draw(belief, network, 200, sampling, horizon_s=900.0)
        assert particles.weight == pytest.approx(1 / 200)
        for k in range(len(particles)):
            assert_route_is_driven(network, particles, k, 900.0)
            assert speed_per_road or len(set(particles.speeds(k).tolist())) == 1
    routes = [names(network, particles, k) for k in range(200)]
    assert len({len(route) for route in routes}) > 1


def test_speed_drawn_on_every_road() -> None:
    belief = prior(TOWN, speed_mps=SLOW, speed_per_road=True)
    particles = draw(belief, TOWN, 2000, horizon_s=900.0)
    speeds = particles.speed_mps
    assert np.mean(speeds[1:][np.diff(particles.route_edge) != 0] == 5.0) == pytest.approx(
        0.75, abs=5 * math.sqrt(0.19 / len(speeds))
    )
    varied = [len(set(particles.speeds(k).tolist())) == 2 for k in range(2000)]
    assert np.mean(varied) > 0.9


def test_iid_draws_follow_the_prior() -> None:
    network, n = figure3(), 20000
    turns = {"AB": {"BC": 0.2, "BD": 0.8}, "BD": {"DG": 1.0}}
    belief = prior(network, {"AB": 1}, speed_mps=SLOW, distance_m=Uniform(0, 5000), turns=turns)
    particles = draw(belief, network, n)
    expected = {
        (route, speed): share * chance
        for route, share in {"AB BC CE": 0.1, "AB BC CF": 0.1, "AB BD DG": 0.8}.items()
        for speed, chance in {2.0: 0.25, 5.0: 0.75}.items()
    }
    particles_of = Counter(
        (names(network, particles, k), float(particles.speeds(k)[0])) for k in range(n)
    )
    assert particles_of.keys() == expected.keys()
    chi2 = sum((particles_of[key] - n * p) ** 2 / (n * p) for key, p in expected.items())
    assert chi2 < 26  # 5 degrees of freedom: one in 10,000
    assert kolmogorov(particles.start_m / 5000) < 2.3 / math.sqrt(n)


def kolmogorov(u: Floats) -> float:
    """Greatest distance of the share below from that of the uniform distribution."""
    below = np.arange(len(u) + 1) / len(u)
    ordered = np.sort(u)
    return float(max((ordered - below[:-1]).max(), (below[1:] - ordered).max()))


def test_sobol_is_exact_in_every_dimension() -> None:
    network, n = grid(6, 6), 1024
    belief = grid_prior(network)
    particles = draw(belief, network, n, "sobol")
    first = particles.route_edge[particles.first_edge[:-1]]
    assert np.count_nonzero(first == network.edge_index["r0c0-r0c1"]) == n / 2
    speed = np.array([particles.speeds(k)[0] for k in range(n)])
    for u in (particles.start_m / 7500, (speed - 15) / 10):
        assert sorted(np.floor(u * n).astype(int)) == list(range(n))
    second = Counter(names(network, particles, k).split()[1] for k in range(n))
    assert set(second.values()) == {n / 4}


def test_sobol_estimates_better_than_iid() -> None:
    network, n = grid(6, 6), 512

    def spread(sampling: Sampling) -> float:
        """Deviation of the mean distance driven along the first of two halves of the grid."""
        means = []
        for seed in range(20):
            particles = draw(grid_prior(network), network, n, sampling, seed=seed)
            speed = particles.speed_mps[particles.first_edge[:-1]]
            means.append(np.mean(particles.start_m + 3600 * speed))
        return float(np.std(means))

    assert spread("sobol") < 0.1 * spread("iid")


@pytest.mark.parametrize("n", [1, 2, 3, 1000, 1025])
@pytest.mark.parametrize("sampling", DRAWN)
def test_any_number_of_particles(n: int, sampling: Sampling) -> None:
    network = grid(3, 3, road_m=15000)
    particles = draw(grid_prior(network), network, n, sampling)
    assert len(particles) == n
    assert particles.weight.sum() == pytest.approx(1)


def test_sobol_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    belief = prior(TOWN, speed_mps=SLOW)
    whole = draw(belief, TOWN, 100, "sobol", horizon_s=500)
    monkeypatch.setattr("planner.belief.uniforms.BLOCK", 2000)
    blocks = draw(belief, TOWN, 100, "sobol", horizon_s=500)
    assert np.array_equal(whole.route_edge, blocks.route_edge)
    assert np.array_equal(whole.start_m, blocks.start_m)
    assert np.array_equal(whole.first_edge, blocks.first_edge)


def test_more_turns_than_a_sobol_sequence_has(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("planner.belief.uniforms.SOBOL_DIMENSIONS", 5)
    particles = draw(prior(TOWN, speed_mps=SLOW), TOWN, 50, "sobol", horizon_s=900)
    assert np.diff(particles.first_edge).max() > 5
    for k in range(50):
        assert_route_is_driven(TOWN, particles, k, 900)


@pytest.mark.parametrize("sampling", DRAWN)
@pytest.mark.parametrize("network", [TOWN, figure1(), grid(4, 4)])
def test_bound_on_turns(sampling: Sampling, network: RoadNetwork) -> None:
    belief = prior(network, speed_mps=Uniform(1, 20))
    bound = most_turns(belief, network, 600.0, limit=1000)
    particles = draw(belief, network, 500, sampling, horizon_s=600.0)
    assert np.diff(particles.first_edge).max() - 1 <= bound
    assert most_turns(belief, network, 600.0, limit=1) == 1


def test_bound_on_turns_is_met() -> None:
    line = by_two_letters({c: (100.0 * i, 0.0) for i, c in enumerate("ABCDE")}, "AB BC CD DE")
    belief = prior(line, {"AB": 1.0}, speed_mps=Uniform(1, 2))
    assert [most_turns(belief, line, t, limit=9) for t in (1, 51, 101, 500)] == [1, 2, 3, 3]


@pytest.mark.parametrize("sampling", DRAWN)
def test_same_stream_same_particles(sampling: Sampling) -> None:
    belief = prior(TOWN, speed_mps=Uniform(2, 9), speed_per_road=True)
    one, two, other = (draw(belief, TOWN, 64, sampling, seed=s, horizon_s=300) for s in (1, 1, 2))
    for name in ("start_m", "route_edge", "speed_mps", "seed", "first_edge"):
        assert np.array_equal(getattr(one, name), getattr(two, name))
    assert not np.array_equal(one.start_m, other.start_m)
    assert not np.array_equal(one.seed, other.seed)


@pytest.mark.parametrize("sampling", DRAWN)
def test_more_particles_leave_the_first_ones_as_they_are(sampling: Sampling) -> None:
    belief = prior(TOWN, speed_mps=Uniform(2, 9))
    few, many = (draw(belief, TOWN, n, sampling, horizon_s=300) for n in (70, 300))
    assert np.array_equal(few.start_m, many.start_m[:70])
    assert np.array_equal(few.route_edge, many.route_edge[: len(few.route_edge)])
    assert np.array_equal(few.seed, many.seed[:70])


def test_one_stream_gives_new_particles_each_time() -> None:
    belief, rng = prior(TOWN, speed_mps=SLOW), stream(1)
    one, two = (sample(belief, TOWN, 10, rng, horizon_s=100.0) for _ in range(2))
    assert not np.array_equal(one.start_m, two.start_m)


def test_seeds_are_sumos() -> None:
    particles = draw(prior(TOWN, speed_mps=SLOW), TOWN, 1000)
    assert particles.seed.min() > 0
    assert particles.seed.max() < 2**31
    assert len(set(particles.seed.tolist())) == 1000


@pytest.mark.parametrize("sampling", [*DRAWN, "all"])
def test_weights_sum_to_the_probability_that_it_is_there(sampling: Sampling) -> None:
    network = figure3()
    belief = prior(
        network,
        {"AB": 0.5, "BC": 0.5},
        distance_m=Listed(np.zeros(1), np.ones(1)),
        speed_mps=SLOW,
        probability_present=0.6,
        gone=True,
    )
    particles = draw(belief, network, 77, sampling)
    assert particles.weight.sum() == pytest.approx(0.6)
    assert particles.gone.all()
    assert not particles.depart_s.any()


def test_all_of_figure3() -> None:
    network = figure3()
    speeds = Listed(np.arange(6.0, 31.0), np.full(25, 1 / 25))
    belief = prior(network, {"AB": 1}, distance_m=Listed(np.zeros(1), np.ones(1)), speed_mps=speeds)
    particles = draw(belief, network, 0, "all")
    found = {
        (names(network, particles, k), float(particles.speeds(k)[0])): float(particles.weight[k])
        for k in range(len(particles))
    }
    paths = ("AB BC CE", "AB BC CF", "AB BD DF", "AB BD DG")
    assert found == {(path, v): pytest.approx(0.01) for path in paths for v in range(6, 31)}
    assert len(particles) == 100


def test_all_are_weighted_by_their_probability() -> None:
    network = figure1()
    turns = {"AB": {"BC": 0.1, "BD": 0.3, "BE": 0.6}, "BC": {"CF": 1.0}}
    belief = prior(
        network,
        {"AB": 0.8, "DF": 0.2},
        distance_m=Listed(np.array([0.0, 10.0]), np.array([0.7, 0.3])),
        speed_mps=SLOW,
        turns=turns,
    )
    particles = draw(belief, network, 0, "all", horizon_s=1e5)
    routes = {
        "AB BC CF FG": 0.08,
        "AB BD DF FG": 0.24,
        "AB BE ED DF FG": 0.24,
        "AB BE EF FG": 0.24,
        "DF FG": 0.2,
    }
    expected = {
        (route, start_m, speed): p * p_start * p_speed
        for route, p in routes.items()
        for start_m, p_start in ((0.0, 0.7), (10.0, 0.3))
        for speed, p_speed in ((2.0, 0.25), (5.0, 0.75))
    }
    found = {
        (
            names(network, particles, k),
            float(particles.start_m[k]),
            float(particles.speeds(k)[0]),
        ): (float(particles.weight[k]))
        for k in range(len(particles))
    }
    assert len(particles) == len(expected)
    assert found == {key: pytest.approx(p) for key, p in expected.items()}


def test_all_in_a_town_are_the_routes_of_a_slow_search() -> None:
    belief = prior(TOWN, distance_m=Listed(np.array([50.0]), np.ones(1)), speed_mps=SLOW)
    particles = draw(belief, TOWN, 0, "all", horizon_s=300.0)
    found = [
        (tuple(particles.route(k).tolist()), float(particles.speeds(k)[0]), particles.weight[k])
        for k in range(len(particles))
    ]
    expected = [
        (route, speed, share * chance * belief.edge_probability[edge])
        for edge in range(len(TOWN.edge_ids))
        for speed, chance in ((2.0, 0.25), (5.0, 0.75))
        for route, share in slow_routes((edge,), (TOWN.edge_length_m[edge] - 50) / speed, speed)
    ]
    assert [row[:2] for row in found] == [row[:2] for row in expected]
    assert [row[2] for row in found] == pytest.approx([row[2] for row in expected])


def slow_routes(
    route: tuple[int, ...], time_s: float, speed: float
) -> list[tuple[tuple[int, ...], float]]:
    ways = TOWN.turns(route[-1]).tolist()
    if time_s >= 300.0 or not ways:
        return [(route, 1.0)]
    return [
        (further, share / len(ways))
        for way in ways
        for further, share in slow_routes(
            (*route, way), time_s + TOWN.edge_length_m[way] / speed, speed
        )
    ]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"speed_mps": Uniform(1, 2)}, "target.speed_mps: has endlessly many"),
        ({"distance_m": Normal(20, 5, 0, 40)}, "target.distance_m: has endlessly many"),
        ({"distance_m": None}, "target.distance_m: has endlessly many"),
        ({"speed_per_road": True}, 'target.speed_drawn: "per road"'),
        ({"speed_mps": Listed(np.arange(1, 200001), np.full(200000, 5e-6))}, "more than 1,000,000"),
        ({}, "more than 1,000,000"),
    ],
)
def test_all_of_too_many_is_refused(changes: dict[str, object], message: str) -> None:
    given: dict[str, object] = {"distance_m": Listed(np.zeros(1), np.ones(1)), "speed_mps": SLOW}
    belief = prior(TOWN, **{**given, **changes})  # type: ignore[arg-type]
    with pytest.raises(InputError, match=message):
        sample(belief, TOWN, 0, stream(1), sampling="all", horizon_s=1e6)


def test_predefined() -> None:
    network = figure3()
    belief = prior(network, {"AB": 1}, gone=True, probability_present=0.3)
    target = predefined(
        network, belief, ["AB", "BD", "DG"], stream(1), speed_mps=20.0, offset_m=100.0
    )
    assert names(network, target, 0) == "AB BD DG"
    assert target.speeds(0).tolist() == [20, 20, 20]
    assert (target.start_m.tolist(), target.weight.tolist()) == ([100], [1])
    assert target.gone.all()


@pytest.mark.parametrize(
    ("route", "speed", "offset", "message"),
    [
        ("", 20, 0, "route: is empty"),
        ("AB BX", 20, 0, "BX is not an edge of the network; known: AB, BC"),
        ("AB CE", 20, 0, "AB does not lead to CE, but to BC, BD"),
        ("CE AB", 20, 0, "CE does not lead to AB, but to nothing"),
        ("AB", 0, 0, "speed 0: give"),
        ("AB", math.nan, 0, "speed nan: give"),
        ("AB", 20, 5001, "offset 5001: is not on AB; give 0 to 5000 m"),
        ("AB", 20, -1, "offset -1: is not on AB"),
        ("AB", 20, math.nan, "offset nan: is not on AB"),
    ],
)
def test_predefined_faults(route: str, speed: float, offset: float, message: str) -> None:
    network = figure3()
    with pytest.raises(InputError, match=message):
        predefined(
            network,
            prior(network),
            route.split(),
            stream(1),
            speed_mps=speed,
            offset_m=offset,
        )
