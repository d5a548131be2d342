"""A UAV between two of its flights, or after the last: what may be said of it, and what may not."""

from collections.abc import Iterator

import pytest

from planner.errors import InputError, NothingLeftError
from planner.flight.plan import Plan
from planner.flight.track import Track
from planner.mission.alarms import with_alarms
from planner.mission.follow import at_loss
from planner.mission.joined import Joined
from planner.mission.online import Mission, Remembering
from planner.mission.opening import open_scenario
from planner.mission.resume import grounded, resumed
from planner.mission.standing import OfUav, Standing
from planner.network.place_words import Where
from planner.search.methods import method_named

FEW = ("search.particles=40", "search.work=500", "sensor.detects=0.5", "search.horizon_s=2000")
TWICE = "{start={x_m=-2000,y_m=0},return_to='start',max_flight_time_s=300,sorties=2,swap_s=60}"
OTHER = "{start={x_m=20000,y_m=0},max_flight_time_s=300}"
PLACE = Where(7.0, 8.0, "A")
HERE = (1.0, 2.0)


def planned(uavs: str) -> Mission:
    recorder = Remembering(open_scenario("figure3", overrides=(*FEW, uavs)), workers=1)
    mission = Mission(recorder, Plan("", (), ()), method_named("rate"))
    mission.plan = mission.made().plan
    return mission


@pytest.fixture(scope="module", autouse=True)
def _few_suffice() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("planner.mission.recorder.ENOUGH", 5)  # no more is driven
        yield


@pytest.fixture(scope="module")
def twice() -> Mission:
    return planned(f"uav={TWICE}")


@pytest.fixture(scope="module")
def two() -> Mission:
    return planned(f"uav=[{TWICE},{OTHER}]")


def pause_s(mission: Mission) -> float:
    """Return a time at which the first UAV has its battery swapped."""
    return mission.plan.tracks[0].end_s + 30.0


def test_who_is_on_the_ground(twice: Mission) -> None:
    first, second = twice.plan.tracks
    up = {first.time_s[0]: (0,), first.end_s - 1.0: (), pause_s(twice): (0,)}
    up |= {second.end_s - 1.0: (), second.end_s + 1.0: (0,)}
    for at_s, down in up.items():
        assert grounded(twice.opened, twice.plan, Standing(at_s)) == down


@pytest.mark.parametrize("anew", [False, True])
def test_alarms_go_on_after_one_that_ends_in_a_pause(twice: Mission, *, anew: bool) -> None:
    """The first ends while the battery is swapped: it delays nothing, and others are to come."""
    mission = Mission(twice.recorder, twice.plan, twice.method)
    alarms_s, rests = [pause_s(twice) - 10.0, pause_s(twice) + 100.0], list[Track]()

    def alarm(rest: Track, now_s: float) -> float:
        rests.append(rest)
        return next((one for one in alarms_s if one > now_s), float("inf"))

    flown = with_alarms(mission, alarm, 10.0, anew=anew)
    assert [rest.end_s for rest in rests[:2]] == [twice.plan.end_s] * 2  # both flights
    assert len(rests) == 3
    if not anew:
        assert flown.xy(alarms_s[1] + 50.0) == pytest.approx(twice.track.xy(alarms_s[1] + 40.0))


def test_alarms_hide_nothing_but_the_end(twice: Mission, monkeypatch: pytest.MonkeyPatch) -> None:
    mission = Mission(twice.recorder, twice.plan, twice.method)
    end_s = twice.plan.end_s
    late = with_alarms(mission, lambda rest, now_s: end_s - 1.0, 10.0, anew=False)  # noqa: ARG005
    assert late.end_s == end_s

    def refuse(*_: object) -> None:
        raise InputError("is wrong")

    monkeypatch.setattr(mission, "heard", refuse)
    with pytest.raises(InputError, match="is wrong"):
        with_alarms(mission, lambda rest, now_s: 100.0, 10.0, anew=False)  # noqa: ARG005


def test_what_people_say_of_who_is_on_the_ground_is_refused(twice: Mission, two: Mission) -> None:
    with pytest.raises(InputError, match=r"uav: the UAV is on the ground at .*; leave out what is"):
        twice.heard(Standing(pause_s(twice), late_s=30.0))
    over_s = two.plan.tracks[-1].end_s + 1.0
    assert two.plan.flights[-1].uav == 1
    for said in (OfUav(late_s=5.0), OfUav(left_s=50.0)):
        with pytest.raises(InputError, match=r"uav: UAV 2 has landed by .*; say where it is if it"):
            two.heard(Standing(over_s, uavs={1: said}))
    still = two.heard(Standing(over_s, uavs={1: OfUav(xy_m=HERE, left_s=50.0)}))
    assert still.opened.scenario.others[0].in_air is not None


def test_who_has_followed_the_target_is_where_it_was_lost(twice: Mission) -> None:
    def told(standing: Standing) -> Standing:
        return at_loss(twice.opened, twice.plan, PLACE, standing)

    assert told(Standing(100.0)).uavs[0].xy_m == (7.0, 8.0)
    said = Standing(100.0, xy_m=HERE, left_s=50.0)
    assert told(said).uavs == {0: OfUav(xy_m=HERE, left_s=50.0)}
    landed = told(Standing(twice.plan.end_s + 1.0))  # as planned: it has followed, and flies still
    assert resumed(twice.opened, twice.plan, landed).opened.scenario.uav.in_air is not None


@pytest.mark.parametrize(
    ("standing", "fault"),
    [
        (Standing(100.0, joined=(Joined(100.0, {}),)), "--lost-at: one of several UAVs has follow"),
        (Standing(100.0, uavs={1: OfUav(late_s=1.0)}), "there is no UAV 2; there is one, UAV 1"),
        (Standing(100.0, uavs={0: OfUav(lost_s=90.0)}), "without UAV 1 nobody flies any more"),
        (Standing(0.0), "--lost-at: by its plan the UAV is on the ground at 0:00:00, and who"),
    ],
)
def test_who_cannot_have_followed_is_refused(
    twice: Mission, standing: Standing, fault: str
) -> None:
    with pytest.raises(InputError, match=fault):
        resumed(twice.opened, twice.plan, at_loss(twice.opened, twice.plan, PLACE, standing))


def test_between_two_flights_nobody_is_followed(twice: Mission, two: Mission) -> None:
    remedy = "give --at a time of its flight, or tell where the target was seen as --report"
    for said in (Standing(pause_s(twice)), Standing(pause_s(twice), xy_m=HERE)):
        with pytest.raises(InputError, match=f"--lost-at: .* the UAV is on the ground .*{remedy}"):
            at_loss(twice.opened, twice.plan, PLACE, said)
    said = Standing(pause_s(two), uavs={0: OfUav(xy_m=HERE)})
    with pytest.raises(InputError, match=f"--lost-at: .* UAV 1 is on the ground .*{remedy}"):
        at_loss(two.opened, two.plan, PLACE, said)


def test_when_all_is_over_that_is_said(twice: Mission) -> None:
    with pytest.raises(NothingLeftError, match="the flight is over at"):
        twice.heard(Standing(twice.plan.end_s + 1.0))
