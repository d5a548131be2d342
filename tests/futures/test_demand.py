"""Traffic at a stated rate: drawn once, other in each run, and a word where it breaks down."""

from dataclasses import replace
from pathlib import Path

import pytest

from planner.errors import SumoError
from planner.futures import demand
from planner.futures.demand import Demand, demand_routes
from planner.futures.warm_up import Warm, breakdown
from planner.mission.opening import OpenScenario, open_scenario
from planner.xml_guard import xml_elements
from support.sumo_instances import town
from support.user_traffic import told, write_traffic

HOUR = Demand(1000, 3600)


def at_rate(folder: Path, vehicles_per_hour: int) -> OpenScenario:
    """Traffic of so many vehicles an hour on the built town, 150 s before the search."""
    rate = f"traffic={{ vehicles_per_hour={vehicles_per_hour}, at=150 }}"
    return open_scenario(write_traffic(folder), overrides=[rate])


def test_trips_are_drawn_once_and_repeat(
    tmp_path: Path, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    net = town().path
    here = Path.cwd()
    before = sorted(here.iterdir())
    drawn = demand_routes(HOUR, net, 7)
    assert drawn.is_relative_to(empty_cache)
    assert sorted(here.iterdir()) == before
    trips = [dict(one.attrib) for one in xml_elements(drawn) if one.tag == "trip"]
    assert 950 <= len(trips) <= 1001
    assert max(float(trip["depart"]) for trip in trips) < 3600
    content = drawn.read_bytes()
    monkeypatch.setenv("PLANNER_CACHE", str(tmp_path / "other"))
    assert demand_routes(HOUR, net, 7).read_bytes() == content
    monkeypatch.setattr(demand, "_drawn", None)
    assert demand_routes(HOUR, net, 7).read_bytes() == content


def test_runs_differ_in_their_trips(tmp_path: Path) -> None:
    opened = at_rate(tmp_path, 1000)
    first, other = told(opened, 0), told(opened, 1)
    assert first == told(opened, 0)
    assert first.places_m != other.places_m
    assert opened.traffic is not None
    assert not first.warm.has_broken_down
    assert breakdown([first.warm, other.warm], opened.traffic) is None


def test_too_many_vehicles_break_down(tmp_path: Path) -> None:
    opened = at_rate(tmp_path, 20_000)
    found = told(opened)
    assert opened.traffic is not None
    line = breakdown([found.warm, Warm(100, 3, 0, 0)], opened.traffic)
    assert line is not None
    assert "20000 is more than the net bears" in line
    assert f"in 1 of 2 runs (at the worst {found.warm.halting} of" in line
    assert breakdown([found.warm], replace(opened.traffic, demand=None)) is None


@pytest.mark.parametrize(
    ("warm", "breaks"),
    [
        (Warm(100, 50, 0, 0), False),
        (Warm(100, 51, 0, 0), True),
        (Warm(100, 0, 20, 10), False),
        (Warm(100, 0, 21, 10), True),
        (Warm(0, 0, 0, 0), False),
        (Warm(0, 0, 1, 0), True),
    ],
)
def test_traffic_flows_while_half_of_it_moves_and_nobody_queues_to_enter(
    warm: Warm, breaks: bool
) -> None:
    assert warm.has_broken_down == breaks


def test_a_net_without_trips_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "empty.net.xml").write_text("<net></net>")
    with pytest.raises(
        SumoError, match=r"randomTrips finds no trips on .*empty.net.xml: \w+"
    ) as no:
        demand_routes(HOUR, tmp_path / "empty.net.xml", 1)
    assert str(no.value).count("\n") == 0
