"""What questions are worth: nothing for coin flips, something for what tells targets apart."""

import numpy as np
import pytest

from planner.flight.plan import Plan
from planner.futures.futures import Futures
from planner.mission import ask, questions
from planner.mission.online import Mission, Remembering
from planner.mission.opening import open_scenario
from planner.mission.standing import Standing
from planner.search.methods import method_named
from support.instances import figure3, physics_futures

SMALL = ("search.particles=256", "search.work=2000", "search.sampling=sobol", "search.targets=400")


@pytest.fixture(scope="module")
def mission() -> Mission:
    recorder = Remembering(open_scenario("grid5x5", overrides=SMALL), workers=1)
    found = Mission(recorder, Plan("", (), ()), method_named("rate"))
    found.plan = found.made().plan
    return found


def coin(number: int) -> questions.Question:
    """A question that has nothing to do with the target."""

    def of(futures: Futures) -> np.ndarray:
        return np.random.default_rng([number, len(futures)]).integers(0, 2, len(futures))

    return questions.Question(f"coin {number}", ("heads", "tails"), of)


def test_coin_flips_are_not_worth_asking(mission: Mission) -> None:
    going_on = mission.heard(Standing(300.0))
    targets = ask.fresh_now(mission, going_on)
    coins = [coin(number) for number in range(20)]
    found = ask.ask(mission.recorder, going_on, mission.method, coins, targets)
    assert sum(one.is_worth_asking for one in found) <= 1
    assert [one.low_s for one in found] == sorted((one.low_s for one in found), reverse=True)


@pytest.mark.parametrize("at_s", [0.0, 300.0])  # before take-off nothing has been heard yet
def test_a_question_that_tells_is_worth_something_and_no_more_than_can_be(
    mission: Mission, at_s: float
) -> None:
    going_on = mission.heard(Standing(at_s))
    targets = ask.fresh_now(mission, going_on)
    believed = mission.recorder.now(going_on.opened).planning().futures
    one = questions.first_road(questions.About(believed, mission.opened.network, 300.0))
    (found,) = ask.ask(mission.recorder, going_on, mission.method, [one], targets)
    assert found.is_worth_asking
    assert sum(found.likely) == pytest.approx(1.0)
    assert found.saves_s < ask.most_s(going_on, targets)  # on each target, so not by chance


def test_answers_are_told_apart_by_what_targets_do(mission: Mission) -> None:
    futures, network = mission.recorder.planning().futures, mission.opened.network
    about = questions.About(futures, network, 1000.0)
    fast = questions.speed(about).of(futures)
    driven_m = futures.driven_m(np.full(len(futures), 60.0))
    assert driven_m[fast == 2].min() >= driven_m[fast == 0].max()
    south = questions.heading(about).of(futures) == questions.QUARTERS.index("south")
    assert np.all((futures.positions(60.0) - futures.positions(0.0))[south, 1] < 0.0)
    node = network.node_ids.index("r1c0")
    passed = questions.camera(network, node, 1500.0).of(futures) == 1
    near = np.array([futures.xy(k, np.arange(0.0, 1500.0)) for k in range(len(futures))])
    away_m = np.hypot(*(near - network.node_xy_m[node]).transpose(2, 0, 1)).min(axis=1)
    assert np.array_equal(passed, away_m <= questions.CAMERA_M)
    east = questions.side(about)
    assert 0.2 < float(futures.weight @ east.of(futures)) < 0.8
    assert "yes" in {a for one in questions.of_a_flight(about) for a in one.answers}
    assert all(one.option.startswith("--") for one in questions.of_a_call(about))


@pytest.mark.parametrize(
    ("speeds_kmh", "answers"),
    [
        ((20, 36, 60), ("under 30 km/h", "30 to 45 km/h", "over 45 km/h")),
        ((48, 50, 52, 52), ("under 50 km/h", "over 50 km/h")),
        ((1, 2, 9, 1), ("under 5 km/h", "over 5 km/h")),
        ((50.5, 51), None),  # all answer alike
        ((1,), None),
    ],
)
def test_no_two_limits_of_speeds_are_the_same(
    speeds_kmh: tuple[float, ...], answers: tuple[str, ...] | None
) -> None:
    network = figure3()
    speed_mps = np.array(speeds_kmh) / 3.6
    driven = physics_futures(network, [["AB"]] * len(speed_mps), 0.0, speed_mps)
    about = questions.About(driven, network, 60.0)
    for asked in (questions.of_a_call(about), questions.of_a_flight(about)):
        told = {one.asked: one for one in asked}
        assert (answers is None) == ("how fast it drove" not in told)
        if answers is not None:
            one = told["how fast it drove"]
            assert one.answers == answers
            assert len(set(one.of(driven).tolist())) > 1
    assert "which way it went" not in {one.asked for one in questions.of_a_call(about)}
