"""The study of on-line planning, small, and what is said of it."""

from dataclasses import replace

import pytest

from planner.experiments.experiment_file import read_experiment
from planner.experiments.results import Row, rows_of
from planner.experiments.run import Results
from planner.mission.alarms import Alarms
from planner.paper import online
from planner.paper.figures import U0
from planner.paper.studies import STUDIES

SMALL = ("search.particles=300", "search.work=400")


@pytest.mark.long
def test_what_comes_in_is_worth_something(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(online, "REPORTS", 1)
    monkeypatch.setattr(online, "ALARMS", Alarms(every_s=2000.0, lasts_s=120.0))
    first = read_experiment("online", STUDIES).only(["uav.start.distance_m=60000"]).conditions()[0]
    small = replace(first, overrides=(*first.overrides, *SMALL), targets=200)
    found = {row["what"]: row for row in rows_of(small, online.online_of(small))}
    assert set(found) == {*online.WORTH, *online.NOTHING}
    for row in found.values():
        assert row["saved"] == pytest.approx(1.0 - row["anew_s"] / row["as_planned_s"])
        assert 0.0 < row["anew_s"] <= 10_000.0
    assert found[online.SECOND]["saved"] > 0.05


def test_two_claims_with_a_row_for_each_thing_that_comes_in() -> None:
    rows: list[Row] = [
        {"what": what, U0: u0, "seed": seed, "as_planned_s": 900.0 + seed, "anew_s": 600.0}
        | {"saved": 1.0 - 600.0 / (900.0 + seed)}
        for what in (*online.WORTH, *online.NOTHING)
        for u0 in (60e3, 120e3)
        for seed in (1, 2, 3)
    ]
    worth, nothing = online.claims({"online": Results(tuple(rows), 1, {})})
    assert worth.where == nothing.where == "Section 6"
    for claim, whats in ((worth, online.WORTH), (nothing, online.NOTHING)):
        lines = claim.table.splitlines()[2:]
        assert [line.split(" | ")[:2] for line in lines] == [
            [f"| {what}", km] for what in whats for km in ("60 km", "120 km")
        ]
        finding = claim.finding.lower()
        assert all(f"{what}: 33.5 to 33.5 % less".lower() in finding for what in whats)
    assert [*online.claims({})] == []
