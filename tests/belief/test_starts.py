"""Starts that are stretches: what is within a circle, along a heading, in an area or a zone."""

from pathlib import Path

import numpy as np
import pytest

from planner.belief.places import holds, in_area, in_circle, lines_of
from planner.belief.prior import Known, Prior, prior_of
from planner.belief.sampling import sample
from planner.belief.starts import stretches_of
from planner.belief.stretches import Stretches
from planner.belief.zone_file import read_zone
from planner.errors import InputError, ScenarioError
from planner.mission.opening import OpenScenario, open_scenario
from planner.network.georeference import grid_convergence_deg, lonlat
from planner.scenario.target import TargetSection
from planner.scenario.target_values import CircleStart
from planner.streams import stream
from support.sumo_instances import grid5x5, town
from support.towns import berlin

ZONES = """<additional>
<taz id="two" edges="r0c0-r0c1 r0c1-r0c2"/>
<taz id="weighted">
<tazSource id="r0c0-r0c1" weight="3"/><tazSource id="r1c0-r1c1" weight="1"/>
</taz>
<taz id="drawn" shape="-1,1 8000,1 8000,-8000 -1,-8000"/>
<taz id="empty"/>
<taz id="weightless"><tazSource id="r0c0-r0c1" weight="0"/></taz>
<taz id="odd"><tazSource id="r0c0-r0c1" weight="-1"/></taz>
</additional>"""


def opened(*overrides: str) -> OpenScenario:
    return open_scenario("grid5x5", overrides=("target.distance_m=anywhere", *overrides))


def faults(*overrides: str, scenario: str = "grid5x5") -> list[str]:
    with pytest.raises(ScenarioError) as raised:
        open_scenario(scenario, overrides=overrides)
    return list(map(str, raised.value.faults))


def walked(network_name: str, inside: object, step_m: float = 1.0) -> dict[int, float]:
    """The twin: metres of each edge within a region, by walking along its line in small steps."""
    network = {"grid5x5": grid5x5, "town": town}[network_name]()
    lines = lines_of(network)
    found: dict[int, float] = {}
    for k in range(len(lines.edge)):
        steps = max(1, round(float(lines.long_m[k]) / step_m))
        share = (np.arange(steps) + 0.5) / steps
        points = lines.a_m[k] + share[:, None] * (lines.b_m[k] - lines.a_m[k])
        metres = sum(map(inside, points)) * float(lines.long_m[k]) / steps  # type: ignore[call-overload]
        if metres:
            edge = int(lines.edge[k])
            found[edge] = found.get(edge, 0.0) + metres
    return found


def lengths(stretches: Stretches) -> dict[int, float]:
    found: dict[int, float] = {}
    for edge, metres in zip(stretches.edge, stretches.to_m - stretches.from_m, strict=True):
        found[int(edge)] = found.get(int(edge), 0.0) + float(metres)
    return found


def assert_like_the_walk(stretches: Stretches, twin: dict[int, float], within_m: float) -> None:
    exact = lengths(stretches)
    for edge in exact.keys() | twin.keys():
        assert exact.get(edge, 0.0) == pytest.approx(twin.get(edge, 0.0), abs=within_m)


@pytest.mark.parametrize("radius_m", [30.0, 150.0])
def test_a_circle_holds_what_a_walk_along_the_streets_finds(radius_m: float) -> None:
    network = town()
    x_m, y_m = network.shape_xy_m.mean(axis=0)
    x_m, y_m = network.shape_xy_m[np.argmin(np.hypot(*(network.shape_xy_m - (x_m, y_m)).T))]
    found = in_circle(network, x_m + 3, y_m - 2, radius_m)
    twin = walked("town", lambda p: np.hypot(*(p - (x_m + 3, y_m - 2))) < radius_m, 0.5)
    assert len(found.edge) > 1
    assert_like_the_walk(found, twin, 2.0)
    assert found.probability.sum() == pytest.approx(1)


def test_an_area_holds_what_a_walk_along_the_streets_finds() -> None:
    corners = ((-50.0, -3000.0), (20000.0, 500.0), (9000.0, -9000.0), (12000.0, -20000.0))
    found = in_area(grid5x5(), corners)
    twin = walked("grid5x5", lambda p: holds(np.array(corners), p), 5.0)
    assert len(found.edge) == 4
    assert_like_the_walk(found, twin, 11.0)


def test_a_heading_leaves_the_roads_that_run_along_it() -> None:
    network = grid5x5()
    lines = lines_of(network)
    for heading_deg, east in ((90.0, True), (60.0, True), (180.0, False), (440.0, True)):
        found = in_circle(network, 100, -100, 5000, heading_deg=heading_deg)
        step = (lines.b_m - lines.a_m)[found.edge]  # one piece per edge
        assert np.all((np.abs(step[:, 0]) > np.abs(step[:, 1])) == east)


def test_starts_are_drawn_as_they_are_asked_for() -> None:
    target = TargetSection.model_validate(
        {
            "start": [
                {"edge": "r0c0-r0c1", "from_m": 1000, "to_m": 2000, "p": 0.75},
                {"edge": "r1c0-r1c1", "from_m": 14000, "p": 0.25},
            ]
        }
    )
    network = grid5x5()
    prior = prior_of(target, network, Known(stretches=stretches_of(target.start, network)))
    particles = sample(prior, network, 4096, stream(1), sampling="sobol", horizon_s=10.0)
    first = particles.route_edge[particles.first_edge[:-1]]
    on_first = first == network.edge_index["r0c0-r0c1"]
    assert on_first.mean() == pytest.approx(0.75, abs=0.001)
    start_m = particles.start_m
    assert 1000 <= start_m[on_first].min() <= start_m[on_first].max() <= 2000
    assert start_m[on_first].mean() == pytest.approx(1500, abs=2)
    assert 14000 <= start_m[~on_first].min() <= start_m[~on_first].max() <= 15000


def test_without_probabilities_stretches_count_by_length() -> None:
    one, other = '{ edge = "r0c0-r0c1", to_m = 300 }', '{ edge = "r0c0-r1c0", from_m = 14100 }'
    prior = opened(f"target.start=[{one}, {other}]").prior
    assert prior.stretches is not None
    assert prior.stretches.probability.tolist() == pytest.approx([0.25, 0.75])


def test_longitude_and_latitude_are_the_same_place() -> None:
    network = berlin().network
    x_m, y_m = 1492.6, 671.7
    lon, lat = lonlat(network, np.array([x_m, y_m]))
    for heading in ("", ", heading_deg = 90"):
        places = (f"x_m = {x_m}, y_m = {y_m}", f"lon = {lon!s}, lat = {lat!s}")
        by_m, by_deg = (
            open_scenario(
                "berlin", overrides=[f"target.start={{ {place}, radius_m = 120{heading} }}"]
            ).prior
            for place in places
        )
        assert isinstance(by_m, Prior)
        assert isinstance(by_deg, Prior)
        np.testing.assert_allclose(by_m.edge_probability, by_deg.edge_probability, atol=1e-5)
    (fault,) = faults("target.start={ lon = 52.4, lat = 13.5, radius_m = 9 }", scenario="berlin")
    assert fault.startswith("target.start: longitude 52.4, latitude 13.5: no place near")


def test_zones_are_read_as_sumo_reads_them(tmp_path: Path) -> None:
    path = tmp_path / "zones.add.xml"
    path.write_text(ZONES, encoding="utf-8")
    asked = f'target.start={{ taz = "weighted", file = "{path}" }}'
    prior = opened(asked).prior
    index = prior.edge_probability.nonzero()[0]
    assert prior.edge_probability[index].tolist() == [0.75, 0.25]
    assert read_zone(path, "two").starts == {"r0c0-r0c1": 1.0, "r0c1-r0c2": 1.0}
    drawn = opened(asked.replace("weighted", "drawn")).prior.stretches
    assert drawn is not None
    assert drawn.to_m.tolist() == [8000, 8000]
    for name, said in (
        ("empty", "the taz empty holds neither edges nor a shape"),
        ("tow", r"holds no taz tow; did you mean two\?"),
        ("odd", 'the taz odd gives edge r0c0-r0c1 the weight "-1"; give a number'),
    ):
        with pytest.raises(InputError, match=said):
            read_zone(path, name)
    (fault,) = faults("target.distance_m=anywhere", asked.replace("weighted", "weightless"))
    assert "has no edge of this net" in fault
    assert "weighs more than 0 (r0c0-r0c1)" in fault


def test_edges_of_a_zone_that_the_net_does_not_have_are_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "zones.add.xml"
    edges = "r0c0-r0c1 r0c1-r0c2 gone1 gone2 gone3 gone4"
    path.write_text(f'<additional><taz id="old" edges="{edges}"/></additional>', encoding="utf-8")
    zone = f'taz = "old", file = "{path}"'
    assert np.count_nonzero(opened(f"target.start={{ {zone} }}").prior.edge_probability) == 2
    left_out = "4 of the 6 edges of the taz old are not in the net, and left out"
    assert [one.message for one in caplog.records] == [
        f"target.start: {left_out} (gone1, gone2, gone3, ...)"
    ]
    caplog.clear()
    opened(f"target.goes=[{{ {zone} }}]", 'target.driving="free"')
    assert f"target.goes[0]: {left_out}" in caplog.text


def test_who_was_seen_within_a_window_sets_out_in_it() -> None:
    seen = opened("target.last_seen_window_s=300")
    particles = sample(seen.prior, seen.network, 2000, stream(3), horizon_s=600.0)
    again = sample(seen.prior, seen.network, 20, stream(3), horizon_s=600.0)
    depart_s = particles.depart_s
    assert again.depart_s.tolist() == depart_s[:20].tolist()
    assert (depart_s.min(), depart_s.max()) == (0, 300)
    assert np.all(depart_s == np.round(depart_s))
    assert depart_s.mean() == pytest.approx(150, abs=8)


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        (
            ("target.start={ x_m = 900, y_m = 300, radius_m = 50 }",),
            ["target.start: lies 300 m from any road (r0c0-r0c1 is the nearest); give a place "
             "nearby, in metres as the net has them, or radius_m = 301"],
        ),
        (
            ("target.start={ x_m = 900, y_m = 300 }",),
            ["target.start.radius_m: is missing; give within how many metres of it the target "
             "was, such as 50"],
        ),
        (
            ('target.start=[{ edge = "r0c0-r0c1", from_m = 16000 }, { edge = "r0c0-r0cl" }]',),
            ["target.start[0].from_m: 16000 is beyond the end of r0c0-r0c1, which is 15000 m long; "
             "stay within it",
             "target.start[1].edge: r0c0-r0cl is not an edge of the network; did you mean "
             "r0c0-r0c1?"],
        ),
        (
            ('target.start=[{ edge = "r0c0-r0c1", p = 0.5 }, { edge = "r0c0-r1c0" }]',),
            ["target.start: gives p for some only; give one for each, or for none"],
        ),
        (
            ('target.start=[{ edge = "r0c0-r0c1", from = 8 }]',),
            ["target.start[0].from: is not a known key; did you mean from_m?"],
        ),
        (
            ("target.start={ area = [[-900, -900], [-800, -900], [-900, -800]] }",),
            ["target.start: there is no road within the polygon (r0c0-r1c0 is the nearest, "
             "867 m from its middle); give corners in metres as the net has them"],
        ),
        (
            ("target.start={ area = [[-10, -10], [90, 90], [90, -10], [-10, 90]] }",),
            ["target.start: a polygon crosses itself, or encloses nothing (self-intersection at "
             "40 m east, 40 m north in the net); correct its points"],
        ),
        (
            ("target.start={ area = [[0, 0], [9, 9]] }",),
            ["target.start.area: has 2 corners; give three or more, as [x_m, y_m]"],
        ),
        (
            ('target.start={ taz = "a", file = "nosuch.xml" }',),
            [],
        ),
        (
            (
                "target.start={ x_m = 0, y_m = 0, radius_m = 50 }",
                "target.distance_m={ constant = 3 }",
            ),
            ["target.distance_m: goes with whole edges only, but target.start says where on them; "
             "leave it out"],
        ),
        (
            ("target.last_seen_window_s=10000",),
            ["target.last_seen_window_s: 10000 s does not end before search.horizon_s, 10000 s; "
             "choose a shorter one"],
        ),
    ],
)  # fmt: skip
def test_faults_are_told_by_key(overrides: tuple[str, ...], expected: list[str]) -> None:
    found = faults("target.distance_m=anywhere", *overrides)
    if expected:
        assert found == expected
    else:
        assert found[0].startswith("target.start: ")
        assert "nosuch.xml" in found[0]


def test_a_heading_is_a_true_one_where_the_net_knows_north() -> None:
    network = berlin().network
    turned_deg = float(grid_convergence_deg(network, np.array([1492.6, 671.7])))
    assert abs(turned_deg) > 0.1
    start = CircleStart(x_m=1492.6, y_m=671.7, radius_m=120, heading_deg=90)
    found = stretches_of(start, network)
    assert found is not None
    by_grid = in_circle(network, 1492.6, 671.7, 120, heading_deg=90 - turned_deg, leads_on=True)
    assert found.edge.tolist() == by_grid.edge.tolist()
    assert found.to_m.tolist() == by_grid.to_m.tolist()
