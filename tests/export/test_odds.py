"""Odds before and after a flight add up, and are what a look at each target alone gives."""

import json
from pathlib import Path

import geojson as geojson_package
import numpy as np
import pytest
import shapely
from lxml import etree

from planner.export.from_run import placed
from planner.export.odds import Odds
from planner.export.odds_files import edgedata, odds_features
from planner.export.tables import geojson
from planner.futures.edges_driven import EdgesDriven
from planner.futures.futures import Futures
from planner.network.sumo import sumo_home
from support.flight_files import flight_at
from support.instances import figure3

MANY = 40
NETWORK = placed(figure3(), (-33.9, 18.4))


def drawn(seed: int) -> Odds:
    """Targets that change edges now and then; some vanish, some are found."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(1, 5, MANY)
    first = np.append(0, np.cumsum(counts))
    time_s = np.concatenate([np.sort(rng.uniform(0, 500, n)) for n in counts])
    places = rng.uniform(0, 9000, (first[-1], 2))
    edge = rng.integers(-1, len(NETWORK.edge_ids), first[-1])
    futures = Futures(
        time_s=time_s,
        x_m=places[:, 0],
        y_m=places[:, 1],
        first_knot=first,
        weight=np.full(MANY, 1.0 / MANY),
        gone=rng.random(MANY) < 0.5,
        edges=EdgesDriven.of_knots(edge, time_s, first),
    )
    seen_at = np.where(rng.random(MANY) < 0.6, rng.uniform(100, 600, MANY), np.inf)
    return Odds(futures, seen_at, NETWORK, 150.0, 400.0)


@pytest.mark.parametrize("seed", range(5))
def test_success_is_containment_times_detection(seed: int) -> None:
    odds = drawn(seed)
    before, pod, pos, after = odds.roads
    assert np.allclose(pos, before * pod)
    assert pod.min() >= 0.0
    assert pod.max() <= 1.0
    on_road, found = np.zeros_like(before), np.zeros_like(before)
    left = np.zeros_like(before)
    for k in range(MANY):
        for time_s, column in ((150.0, on_road), (150.0, found), (400.0, left)):
            edge = int(odds.futures.edges.at(time_s)[k])
            is_there = not np.isnan(odds.futures.positions(time_s)[k, 0]) and edge >= 0
            is_found = odds.seen_at[k] <= 400.0
            counts = {id(on_road): True, id(found): is_found, id(left): not is_found}[id(column)]
            if is_there and counts:
                column[NETWORK.edge_road[edge]] += 1.0 / MANY
    assert np.allclose(before, on_road)
    assert np.allclose(pos, found)
    assert np.allclose(after, left)
    assert np.all(odds.cloud(400.0).weight > 0.0)
    assert len(odds.cloud(400.0).weight) == sum(
        not np.isnan(place[0]) and seen > 400.0
        for place, seen in zip(odds.futures.positions(400.0), odds.seen_at, strict=True)
    )


@pytest.mark.parametrize("seed", range(3))
def test_seconds_on_edges_are_those_of_many_looks(seed: int) -> None:
    odds, step_s = drawn(seed), 0.5
    slow = np.zeros(len(NETWORK.edge_ids))
    for time_s in np.arange(60.0, 120.0, step_s) + step_s / 2:
        edge = odds.futures.edges.at(time_s)
        there = ~np.isnan(odds.futures.positions(time_s)[:, 0]) & (odds.seen_at > time_s)
        np.add.at(slow, edge[there & (edge >= 0)], step_s / MANY)
    assert np.allclose(odds.on_edges(60.0, 120.0), slow, atol=4 * step_s / MANY)


def test_sumo_s_schema_and_sums_of_the_data_of_edges(tmp_path: Path) -> None:
    odds, path = drawn(1), tmp_path / "odds.xml"
    path.write_text(edgedata(odds), encoding="utf-8")
    schema = sumo_home() / "data" / "xsd" / "meandata_file.xsd"
    tree = etree.parse(str(path))
    etree.XMLSchema(etree.parse(str(schema))).assertValid(tree)
    intervals = tree.findall("interval")
    assert [one.get("begin") for one in intervals[:2]] == ["0.00", "60.00"]
    assert float(intervals[-1].get("end")) >= odds.to_s
    told = sum(float(edge.get("sampledSeconds")) for edge in intervals[3].iter("edge"))
    assert told == pytest.approx(float(odds.on_edges(180.0, 240.0).sum()), abs=1e-4)
    assert edgedata(odds) == edgedata(drawn(1))


def test_sumo_s_own_reader_takes_the_data_of_edges(tmp_path: Path) -> None:
    from sumolib import xml

    odds, path = drawn(2), tmp_path / "odds.xml"
    path.write_text(edgedata(odds), encoding="utf-8")
    edges = {edge.id for one in xml.parse(str(path), "interval") for edge in one.edge or []}
    assert edges
    assert edges <= set(NETWORK.edge_ids)


def test_maps_have_roads_and_clouds() -> None:
    odds = drawn(3)
    text = geojson([flight_at(-33.9, 18.4)], odds_features(odds))
    read = geojson_package.loads(text)
    assert read.is_valid, read.errors()
    features = json.loads(text)["features"]
    roads = [one for one in features if one["properties"]["kind"] == "road"]
    assert {"poc_before", "pod", "pos", "poc_after", "street"} <= roads[0]["properties"].keys()
    before = sum(one["properties"]["poc_before"] for one in roads)
    assert before == pytest.approx(float(odds.roads.poc_before.sum()), abs=1e-4)
    clouds = [one for one in features if one["geometry"]["type"] == "MultiPoint"]
    assert [one["properties"]["when"] for one in clouds] == ["before", "after"]
    for one in clouds:
        places = shapely.geometry.shape(one["geometry"])
        assert len(places.geoms) == len(one["properties"]["weight"])
        assert -35.0 < places.bounds[1] < -33.0  # latitude second
