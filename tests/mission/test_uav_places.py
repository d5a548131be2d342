"""Where a UAV takes off and lands may be said in degrees where the net lies on the Earth."""

import pytest

from planner.errors import ScenarioError
from planner.mission.opening import open_scenario
from planner.network.georeference import lonlat

PLACE = "{lon=13.52019,lat=52.43045}"


def test_degrees_are_places_of_the_net() -> None:
    overrides = [f"uav.start={PLACE}", "uav.return_to={lon=13.53,lat=52.43}"]
    opened = open_scenario("berlin", overrides=overrides)
    lon, lat = lonlat(opened.network, opened.starts_m[0])
    assert (lon, lat) == pytest.approx((13.52019, 52.43045), abs=1e-8)
    assert opened.landings_m[0] is not None
    lon, lat = lonlat(opened.network, opened.landings_m[0])
    assert (lon, lat) == pytest.approx((13.53, 52.43), abs=1e-8)


@pytest.mark.parametrize(
    ("scenario", "place", "said"),
    [
        ("grid5x5", PLACE, r"uav.start: .*projection"),
        ("berlin", "{lon=52.43,lat=13.52}", "uav.start"),
        ("berlin", "{lon=13.52}", "uav.start.lat"),
        ("berlin", "{lon=13.52,lat=99}", "uav.start.lat"),
    ],
)
def test_degrees_that_are_nowhere_get_their_line(scenario: str, place: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        open_scenario(scenario, overrides=[f"uav.start={place}"])
