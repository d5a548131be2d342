"""Mixtures and profiles: how many of which part, when they park, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from planner.belief.mixture import Mixture
from planner.belief.particles import Particles
from planner.belief.sampling import Sampling, sample
from planner.errors import InputError, ScenarioError
from planner.mission.opening import OpenScenario, open_scenario
from planner.scenario.draft import read_draft
from planner.scenario.profiles import shipped_profiles
from planner.scenario.toml_text import scenario_text
from planner.streams import stream

MIX = """target.mix=[{ weight = 4, goes = "somewhere" }, { weight = 3, goes = "leaves" },
 { weight = 3, speed_mps = { constant = 9 } }]""".replace("\n", "")


def opened(*overrides: str, scenario: str = "berlin") -> OpenScenario:
    return open_scenario(scenario, overrides=overrides)


def draw(one: OpenScenario, n: int, sampling: Sampling = "sobol") -> Particles:
    return sample(one.prior, one.network, n, stream(1), sampling=sampling, horizon_s=900.0)


def faults(*overrides: str, scenario: str = "berlin") -> list[str]:
    with pytest.raises(ScenarioError) as raised:
        open_scenario(scenario, overrides=overrides)
    return list(map(str, raised.value.faults))


def kinds(particles: Particles, one: OpenScenario) -> list[str]:
    """Which component each target is of, told by what it does."""
    found = []
    for k in range(len(particles)):
        by_chance = particles.speeds(k)[0] == 9
        leaves = one.network.edge_exit[particles.route(k)[-1]]
        found.append("turns" if by_chance else "leaves" if leaves else "somewhere")
    return found


@pytest.mark.parametrize("sampling", ["iid", "sobol"])
def test_parts_have_their_weights_and_the_first_ones_stay_the_same(sampling: Sampling) -> None:
    one = opened(MIX)
    many, few = draw(one, 1000, sampling), draw(one, 130, sampling)
    found = kinds(many, one)
    shares = [found.count(name) / 1000 for name in ("somewhere", "leaves", "turns")]
    assert shares == pytest.approx([0.4, 0.3, 0.3], abs=0.001 if sampling == "sobol" else 0.05)
    assert many.weight.sum() == pytest.approx(1)
    for k in range(130):
        assert few.route(k).tolist() == many.route(k)[: len(few.route(k))].tolist()
    for name in ("start_m", "end_m", "seed", "phase_s", "gone"):
        assert getattr(few, name).tolist() == getattr(many, name)[:130].tolist()


def test_shared_out_parts_weigh_exactly_what_they_stand_for() -> None:
    one = opened(MIX)
    particles = draw(one, 7)
    found = np.array(kinds(particles, one))
    weights = [particles.weight[found == name].sum() for name in ("somewhere", "leaves", "turns")]
    assert weights == pytest.approx([0.4, 0.3, 0.3])


def test_the_same_whatever_else_is_in_the_mixture() -> None:
    """A part's targets do not depend on the other parts."""
    one = opened(MIX)
    other = opened(MIX.replace("{ constant = 9 }", "{ constant = 8 }"))
    a, b = draw(one, 100), draw(other, 100)
    index = [k for k, kind in enumerate(kinds(a, one)) if kind != "turns"]
    assert [a.route(k).tolist() for k in index] == [b.route(k).tolist() for k in index]


def test_a_mixture_of_all_paths_weighs_each_by_its_part() -> None:
    mix = (
        'target.mix=[{ weight = 1, speed_mps = { constant = 9 } }, { weight = 3, start = ["BD"] }]'
    )
    settings = ("search.sampling=all", "target.distance_m={ constant = 0 }")
    one = opened(mix, *settings, "target.speed_mps={ constant = 20 }", scenario="figure3")
    particles = draw(one, 1, "all")
    slow = particles.speed_mps[particles.first_edge[:-1]] == 9
    assert particles.weight[slow].sum() == pytest.approx(0.25)
    assert particles.weight[~slow].sum() == pytest.approx(0.75)


def test_targets_park_as_the_law_says() -> None:
    stops = 'target.stops={ parked = 0.2, share = 0.75, mean_s = "0:10:00" }'
    particles = draw(opened(stops, "target.last_seen_window_s=60"), 8000)
    drives_s = particles.stop_s - particles.depart_s
    assert np.all(drives_s[np.isfinite(drives_s)] == np.round(drives_s[np.isfinite(drives_s)]))
    for at_s in (0.0, 60.0, 300.0, 600.0, 1800.0, 1e6):
        expected = 0.2 + 0.8 * 0.75 * (1 - np.exp(-at_s / 600))
        assert (drives_s <= at_s).mean() == pytest.approx(expected, abs=0.015)


@pytest.mark.parametrize("name", shipped_profiles())
def test_every_profile_makes_a_target(name: str) -> None:
    one = opened(f"target.profile={name}")
    particles = draw(one, 100)
    assert len(particles) == 100
    assert one.scenario.target.driving == "free"


def test_a_profile_is_written_out_where_a_scenario_is_kept(tmp_path: Path) -> None:
    """A run's scenario does not change when a profile does."""
    mix = 'target.mix=[{ weight = 1, profile = "lost" }, { weight = 3, goes = "leaves" }]'
    one = opened(mix)
    path = tmp_path / "scenario.toml"
    path.write_text(scenario_text(one.scenario), encoding="utf-8")
    assert "profile" not in one.scenario.as_dict()["target"]
    again = open_scenario(tmp_path)
    assert again.scenario.target == one.scenario.target
    assert draw(again, 50).route_edge.tolist() == draw(one, 50).route_edge.tolist()


def test_a_component_that_is_a_mixture_shares_out_its_weight() -> None:
    one = opened(
        'target.mix=[{ weight = 2, profile = "driving" }, { weight = 3, profile = "lorry" }]'
    )
    mix = one.scenario.target.mix
    assert mix is not None
    told = [(part.goes, round(part.weight, 9)) for part in mix]
    # The first part of each stands where the component was written.
    assert told == [
        ("somewhere", 1.0),
        ("leaves", 2.4),
        ("leaves", 0.6),
        ("turns", 0.4),
        ("somewhere", 0.6),
    ]
    assert isinstance(one.prior, Mixture)


def test_own_profiles_and_what_stands_beside_one(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text("speed_mps = { constant = 7 }\ngoes = 'leaves'\n", encoding="utf-8")
    target = opened(f"target.profile='{own}'", "target.goes=turns").scenario.target
    assert target.goes == "turns"  # its own keys count
    overrides = (f"target.profile='{own}'",)
    draft = read_draft("berlin", overrides=overrides)
    assert draft.target is not None
    assert draft.target.goes == "leaves"
    assert draft.target.speed_mps.constant is None  # berlin says its own


def test_the_truth_may_be_one_thing_where_a_mixture_is_believed() -> None:
    one = opened(MIX, "truth.goes=leaves")
    assert isinstance(one.prior, Mixture)
    assert not isinstance(one.truth_prior, Mixture)
    both = opened(MIX, "truth.speed_mps={ constant = 5 }")
    assert isinstance(both.truth_prior, Mixture)
    assert [part.speed_mps.high for part in both.truth_prior.parts] == [5, 5, 9]


def test_parts_that_drive_differently_are_refused() -> None:
    prior, other = opened().prior, opened("target.driving=constant").prior
    assert not isinstance(prior, Mixture)
    assert not isinstance(other, Mixture)
    with pytest.raises(InputError, match="driving"):
        Mixture(np.array([0.5, 0.5]), (prior, other))


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        (
            ('target.mix=[{ weight = 1, goes = "leaves" }]',),
            ["target.mix: has one component; add another one, or write its keys in [target]"],
        ),
        (
            ('target.mix=[{ goes = "leaves" }, { weight = -1 }]',),
            ["target.mix[0].weight: is missing; give its probability, or any number in proportion "
             "to it, above 0",
             "target.mix[1].weight: should be greater than 0, not -1; give its probability, or any "
             "number in proportion to it, above 0"],
        ),
        (
            ('target.mix=[{ weight = 1, driving = "constant" }, { weight = 1 }]',),
            ["target.mix[0].driving: is the same in all components; write it in [target] alone"],
        ),
        (
            ('target.mix=[{ weight = 1, profile = "lots" }, { weight = 1 }]',),
            ["target.mix[0].profile: lots is not a profile; did you mean lost?"],
        ),
        (
            ('target.mix=[{ weight = -1, profile = "driving" }, { profile = "driving" }]',),
            ["target.mix[0].weight: should be greater than 0, not -1; give its probability, or any "
             "number in proportion to it, above 0",
             "target.mix[1].weight: is missing; give its probability, or any number in proportion "
             "to it, above 0"],
        ),
        (
            ('target.mix=[{ weight = 1, gos = "leaves" }, { weight = 1 }]',),
            ["target.mix[0].gos: is not a known key; did you mean goes?"],
        ),
        (
            ('target.mix=[{ weight = 1, start = ["nosuch"] }, { weight = 1 }]',
             "target.start=['nosuch']"),
            ["target.mix[0].start.nosuch: is not an edge of the network; known: "
             "-135777010#0, -135777010#1, -135777010#2, -135777010#3, -135777010#4, -135777010#5, "
             "-137483014, -137483015#0, ..."],
        ),
        (
            ("target.start={ x_m = 1, radius_m = 1 }", MIX),
            ["target.start.y_m: is missing; give metres to the north"],
        ),
        (
            ("target.mix=5",),
            ["target.mix: should be tables; write [[target.mix]] for each"],
        ),
        (
            ("target.stops={ share = 0.5 }",),
            ["target.stops: says nothing of how long they drive; give mean_s, as in "
             '{ share = 0.85, mean_s = "1:00:00" }, or { parked = 0.3 }'],
        ),
        (
            ("target.flees={ for_s = 90 }", "target.driving=constant"),
            ['target.flees: needs limits to exceed; write driving = "free", or leave it and its '
             'profile out'],
        ),
    ],
)  # fmt: skip
def test_faults_are_told_by_key(overrides: tuple[str, ...], expected: list[str]) -> None:
    assert faults(*overrides) == expected
