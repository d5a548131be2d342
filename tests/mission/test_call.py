"""Calls in words: what they become, what is echoed, and all that is refused at once."""

from dataclasses import replace
from datetime import datetime, timedelta, timezone
from itertools import pairwise
from pathlib import Path

import pytest

from planner.errors import Fault, InputError, ScenarioError
from planner.futures.traffic import Permit
from planner.mission.call import Call, as_said, understood
from planner.mission.call_words import Words
from planner.mission.opening import OpenScenario, open_scenario
from support.command_line import TOWN
from support.user_traffic import write_traffic

NOW = datetime(2026, 5, 1, 14, 7, 30, 400, tzinfo=timezone(timedelta(hours=2)))
WORDS = Words("berlin", "Rudower Chaussee / Wegedornstraße", "14:05", ("52.43045,13.52019",))


def call(**changed: object) -> Call:
    return understood(replace(WORDS, **changed), NOW)  # type: ignore[arg-type]


def opened(some: Call, folder: Path) -> OpenScenario:
    file = folder / "call.toml"
    file.write_text(some.text(), encoding="utf-8")
    return open_scenario(file)


def test_a_call_becomes_a_scenario(tmp_path: Path) -> None:
    some = call(heading="NE", ready="+3min", until="14:40", battery="20min", target="lost")
    scenario = opened(some, tmp_path).scenario
    assert scenario.target.last_seen_ago_s == 150.0
    assert scenario.target.sighted_at == datetime.fromisoformat("2026-05-01T14:05:00+02:00")
    assert scenario.target.start.heading_deg == 45.0  # type: ignore[union-attr]
    assert scenario.target.start.radius_m == 200.0  # type: ignore[union-attr]
    assert scenario.target.stops is not None  # of the profile
    assert (scenario.uav.take_off_s, scenario.take_off_s) == (180.0, 330.0)
    assert (scenario.uav.max_flight_time_s, scenario.uav.speed_mps) == (1200.0, 15.0)
    assert scenario.uav.is_real
    assert scenario.search.horizon_s == 35 * 60.0
    assert scenario.network.credit == "© OpenStreetMap contributors"
    assert dict(some.understood) == {
        "last seen": "Rudower Chaussee / Wegedornstraße: 52.42885 N 13.52677 E, within 200 m, "
        "heading NE (45 deg)",
        "seen at": "14:05:00, 2 min ago",
        "target": "lost",
        "drone at": "52.43045 N 13.52019 E",
        "aircraft": "multicopter, 15 m/s, up to 20 min in the air",
        "ready": "14:10:30",
        "until": "14:40",
    }
    for line in some.understood:
        assert f"# {line[0]}: {line[1]}\n" in some.text()


def test_what_is_not_said_has_a_default(tmp_path: Path) -> None:
    some = call()
    scenario = opened(some, tmp_path).scenario
    assert (some.ready_s, dict(some.understood)["ready"]) == (0.0, "as soon as there is a plan")
    # Until the battery is empty, if a minute goes into planning; a whole minute on the clock.
    assert scenario.search.horizon_s == 60.0 * 29
    assert scenario.target.mix is not None


def test_a_scenario_says_its_words_at_its_keys() -> None:
    some = call(
        last_seen="Am Studio", heading="E", ready="+3min", drone_at=("Am Studio", "52.43,13.52")
    )
    assert 'title = "last seen Am Studio, heading E (90 deg)"' in some.text()
    lines = some.text().splitlines()
    before = {line.partition(" = ")[0]: above for above, line in pairwise(lines)}
    assert before["last_seen_ago_s"] == "# --at 14:05"
    assert before["take_off_s"] == "# --ready +3min"
    assert "# --last-seen Am Studio" in lines
    assert "# --drone-at Am Studio" in lines
    other = some.changed(uav={"start": some.sites[1]})
    assert "# --drone-at 52.43,13.52" in other.text()
    assert not any(line.startswith("# --until") for line in lines)


def test_the_search_ends_at_a_whole_minute_of_the_watch() -> None:
    some = understood(replace(WORDS, at="-2min", until="+9min"), NOW)
    assert dict(some.understood)["until"] == "14:17"
    assert some.tables["search"]["horizon_s"] == 11 * 60.0 + 30.0
    assert dict(understood(replace(WORDS, at="-2min"), NOW).understood)["until"] == "14:34"


def test_who_cannot_leave_a_net_stays_on_it(tmp_path: Path) -> None:
    stays = "it stays on this net, which no road leaves"
    for profile, goes in (("driving", ["somewhere", "turns"]), ("joyride", ["turns"])):
        some = call(net=TOWN, last_seen="n", drone_at=("nw",), target=profile)
        parts = opened(some, tmp_path).scenario.target.parts("target")
        assert [part.goes for _, part in parts] == goes
        said = dict(some.understood)["target"]
        assert said == (f"{profile}; {stays}" if profile == "driving" else profile)
    mine = tmp_path / "mine.toml"
    mine.write_text('goes = "leaves"\n', encoding="utf-8")
    some = call(net=TOWN, last_seen="n", drone_at=("nw",), target=str(mine))
    assert opened(some, tmp_path).scenario.target.goes == "somewhere"


def test_a_street_is_all_of_its_edges_that_lead_on_along_the_heading() -> None:
    whole, east = (
        call(last_seen="Rudower Chaussee", heading=to).tables["target"]["start"]
        for to in (None, "E")
    )
    assert {one["edge"] for one in east} < {one["edge"] for one in whole}
    assert all(set(one) == {"edge"} for one in whole)
    assert "within" not in dict(call(last_seen="Rudower Chaussee").understood)["last seen"]
    with pytest.raises(ScenarioError, match=r"no part of edge .* within 45 degrees"):
        call(last_seen=east[0]["edge"], heading="W")


def test_all_wrong_words_are_refused_together() -> None:
    with pytest.raises(ScenarioError) as refused:
        call(
            last_seen="Rudower Chausee",
            at="+1min",
            drone_at=("13.52,52.43", "52.5,13.5"),
            heading="up",
            target="fleeting",
            aircraft=Path("copter"),
            ready="-1min",
            until="late",
            battery="long",
        )
    said = [(fault.key, fault.text) for fault in refused.value.faults]
    expected = [
        ("--target", "did you mean fleeing?"),
        ("--heading", "is no heading"),
        ("--last-seen", "did you mean Rudower Chaussee?"),
        ("--drone-at", "did you mean 13.52 and 52.43 the other way round?"),
        ("--aircraft", "is no file and no aircraft"),
        ("--at", "14:08:30 is still to come"),
        ("--ready", "14:06:30 has passed"),
        ("--until", "is no time"),
    ]
    assert [key for key, _ in said] == [key for key, _ in expected]
    for (_, text), (_, part) in zip(said, expected, strict=True):
        assert part in text


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (
            {"last_seen": "Am Studio", "radius_m": 9.0},
            "--radius-m: goes with a point, and Am Studio",
        ),
        ({"until": "14:06"}, "--until: 14:06 is not after the drone is ready, 14:07:30"),
        ({"battery": "long"}, '--battery: "long" is no duration'),
        ({"at": "2026-04-01T10:00"}, "too long for a call"),
        ({"ready": "+99999min"}, "--ready: 2026-07-10 00:46:30 is 1,666.7 h away"),
        ({"until": "2026-05-09T10:00"}, "too long for a call; give an earlier one"),
        ({"battery": "0min"}, '--battery: "0min" is no time in the air; write how long'),
        ({"battery": "9999h"}, '--battery: "9999h" is no time in the air; write how long'),
        ({"at": "-9999999999999min"}, '--at: "-9999999999999min" is out of reach'),
        (
            {"last_seen": "52.43,13.5"},
            "m from the nearest road for cars (Hermann-Dorner-Allee)",
        ),
        ({"net": "berlim"}, "did you mean berlin?"),
    ],
)
def test_what_cannot_be(changed: dict[str, object], said: str) -> None:
    with pytest.raises(InputError) as refused:
        call(**changed)
    assert said in str(refused.value)


def test_a_place_off_the_road_is_moved_and_said() -> None:
    said = dict(call(last_seen="52.4325,13.5255").understood)["last seen"]
    assert "moved" in said
    assert "to the nearest road" in said


def test_a_net_without_a_projection_has_places_in_metres(tmp_path: Path) -> None:
    some = call(net=TOWN, last_seen="210,400", drone_at=("nw", "se"), target="joyride")
    assert some.tables["target"]["start"] == {"x_m": 209.5, "y_m": 400.0, "radius_m": 200.0}
    assert some.sites == ({"x_m": 0.0, "y_m": 400.0}, {"x_m": 400.0, "y_m": 5.0})
    assert some.site_names == ("node nw", "node se")
    scenario = opened(some, tmp_path).scenario
    assert Path(scenario.network.nodes or "").is_absolute()
    assert scenario.sensor.radius_m == 60.0  # of the scenario that the net is from


def test_words_of_others_stay_words(tmp_path: Path) -> None:
    odd = tmp_path / "$(touch x);'\" net.toml"
    odd.write_text((Path(TOWN) / "scenario.toml").read_text(encoding="utf-8"), encoding="utf-8")
    for name in ("town.nod.xml", "town.edg.xml"):
        (tmp_path / name).write_bytes((Path(TOWN) / name).read_bytes())
    some = call(net=str(odd), last_seen="n", drone_at=("nw",), target="joyride")
    assert opened(some, tmp_path).scenario.target.last_seen_ago_s == 150.0


# Keys that are set


def test_what_is_set_is_echoed_and_kept(tmp_path: Path) -> None:
    some = call(settings=("uav.speed_mps = 12", "sensor={ radius_m = 40 }", "greedy.tick_s=2"))
    assert some.understood[-3:-1] == (
        ("set", "uav.speed_mps = 12"),
        ("set", "sensor={ radius_m = 40 }"),
    )
    text = some.text()
    assert "# --set uav.speed_mps = 12\nspeed_mps = 12\n" in text
    scenario = opened(some, tmp_path).scenario
    assert (scenario.uav.speed_mps, scenario.sensor.radius_m) == (12.0, 40.0)
    assert scenario.uav.aircraft is not None  # and all else that words say
    assert scenario.greedy.tick_s == 2
    assert "tick_s" in some.changed(uav={"take_off_s": 5.0}).text()


@pytest.mark.parametrize(
    ("setting", "fault"),
    [
        ("uav.take_off_s=5", "--set uav.take_off_s: is what --ready says"),
        ("uav=[]", "--set uav: is what --drone-at says"),
        ("uav.0.speed_mps=3", "uav.0.speed_mps: is none of a call's sections"),
        ("target.start.radius_m=5", "--set target.start.radius_m: is what --last-seen says"),
        ("network.net=x", "--set network.net: is what NET says"),
        ("search.particles=9", "is chosen while the clock runs"),
        ("title=x", "title: is none of a call's sections"),
        ("speed", "is not an override; write dotted.key=value"),
    ],
)
def test_what_words_say_and_the_clock_decides_is_not_set(setting: str, fault: str) -> None:
    with pytest.raises(ScenarioError) as refused:
        call(settings=(setting,))
    assert fault in str(refused.value)
    assert len(refused.value.faults) == 1


def test_a_fault_of_what_is_set_is_told_as_such() -> None:
    some = call(settings=("uav.speed_mps=fast",))
    assert as_said(Fault("uav.speed_mps", "x"), some).key == "--set uav.speed_mps"
    assert as_said(Fault("uav.aircraft", "x"), some).key == "--aircraft"


def test_a_target_can_be_set_to_drive_in_the_traffic_of_the_nets_scenario(tmp_path: Path) -> None:
    folder = write_traffic(tmp_path / "own")
    words = {"net": str(folder), "last_seen": "nw-n", "drone_at": ("0,0",)}
    assert "traffic" not in call(**words).tables
    some = call(**words, settings=("target.driving=traffic",))
    assert some.understood[-1] == ("traffic", "time 0 of the target is its 0:01:00")
    (tmp_path / "run").mkdir()
    file = tmp_path / "run" / "call.toml"
    file.write_text(some.text(), encoding="utf-8")
    with pytest.raises(InputError, match="does not lie below"):
        open_scenario(file)
    traffic = open_scenario(file, permit=Permit((folder,))).traffic
    assert traffic is not None
    assert traffic.at_s == 60.0
