"""What a run.json tells."""

import hashlib
import json
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy
import pytest

from planner.provenance import PACKAGES, provenance, sha256_of_file, sha256_of_json, versions

SCENARIO = {"uav": {"speed_mps": 100.0}, "search": {"seed": 3, "horizon_s": 10000}}


def test_it_survives_json_and_names_what_ran() -> None:
    told = provenance(["planner", "plan", "grid5x5"], SCENARIO, seed=3, took_s={"plan": 0.02})
    back = json.loads(json.dumps(told, allow_nan=False))
    assert back == told
    assert back["arguments"] == ["planner", "plan", "grid5x5"]
    assert back["scenario"] == SCENARIO
    assert back["took_s"] == {"plan": 0.02}


def test_versions_are_those_that_run() -> None:
    found = versions()
    assert found["numpy"] == numpy.__version__
    assert str(found["sumo"]).startswith("1.28.")


def test_a_package_that_is_not_there_is_told_as_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PACKAGES, "made-up", "no-such-package-is-known")
    assert versions()["made-up"] is None


def test_the_scenario_digest_knows_values_and_not_key_order() -> None:
    turned = {key: SCENARIO[key] for key in reversed(SCENARIO)}
    other = {**SCENARIO, "uav": {"speed_mps": 100.5}}
    assert sha256_of_json(SCENARIO) == sha256_of_json(turned) != sha256_of_json(other)


def test_digests_given_are_kept_beside_the_scenario_s() -> None:
    told = provenance([], SCENARIO, seed=3, sha256={"net": "ab"})
    assert told["sha256"] == {"scenario": sha256_of_json(SCENARIO), "net": "ab"}


def test_the_start_is_told_with_its_time_zone() -> None:
    start = datetime(2030, 1, 2, 3, 4, 5, tzinfo=timezone(timedelta(hours=1)))
    assert provenance([], SCENARIO, seed=3, started=start)["started"] == "2030-01-02T03:04:05+01:00"
    now = datetime.fromisoformat(provenance([], SCENARIO, seed=3)["started"])
    assert abs(datetime.now(now.tzinfo) - now) < timedelta(minutes=1)


def test_file_digest(tmp_path: Path) -> None:
    (tmp_path / "net.xml").write_bytes(b"<net/>")
    assert sha256_of_file(tmp_path / "net.xml") == hashlib.sha256(b"<net/>").hexdigest()
