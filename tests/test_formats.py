"""docs/formats.md names all that the files hold."""

import csv
import json
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet
import pytest

from planner.experiments.instances import instances_path
from planner.experiments.results import FIGURES, TIMING
from support.command_line import Commands

PAGE = Path(__file__).parents[1] / "docs" / "formats.md"
SMALL = ("--set", "search.particles=40", "--targets", "40", "--method", "rate")
FREE = {"scenario", "versions", "took_s"}  # keys of what stands below these are not the file's


def section(name: str) -> str:
    """What the page says of a file, under its own heading."""
    found = [part for part in PAGE.read_text().split("\n## ") if part.startswith(f"`{name}`\n")]
    assert len(found) == 1, f"{name} needs one section"
    return found[0]


def missing(name: str, words: set[str]) -> set[str]:
    """Which words are not named in a file's section."""
    return {word for word in words if f"`{word}`" not in section(name)}


def keys_in(content: Any) -> Iterator[str]:
    """All keys of nested JSON."""
    if isinstance(content, dict):
        for key, value in content.items():
            yield key
            yield from () if key in FREE else keys_in(value)
    elif isinstance(content, list):
        for value in content:
            yield from keys_in(value)


def columns_of(path: Path) -> set[str]:
    """The columns of a table, with the names of its metadata."""
    if path.suffix == ".csv":
        with path.open(encoding="utf-8", newline="") as file:
            return {*next(csv.reader(file))}
    schema = pyarrow.parquet.read_schema(path)
    return {*schema.names, *(key.decode() for key in schema.metadata or {})} - {"ARROW:schema"}


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


@pytest.mark.parametrize("objective", [(), ("--objective", "probability", "--by", "900")])
def test_a_certified_run(run: Commands, tmp_path: Path, objective: tuple[str, ...]) -> None:
    assert run("plan", "figure3", *SMALL, *objective, "-o", tmp_path).code == 0
    assert run("certify", tmp_path, "--work", "5", "--sets", "10").code == 0
    assert run("fly", tmp_path, "--targets", "5").code == 0
    assert {path.name for path in tmp_path.glob("*.parquet")} == {
        "evaluation.parquet",
        "motion.parquet",
        "prices.parquet",
        "weights.parquet",
    }
    for path in (*tmp_path.glob("*.parquet"), *tmp_path.glob("*.csv")):
        assert missing(path.name, columns_of(path)) == set()
    for name in ("plan.json", "run.json", "net.json"):
        assert missing(name, {*keys_in(json.loads((tmp_path / name).read_text()))}) == set()


def test_recordings(run: Commands, tmp_path: Path) -> None:
    assert run("futures", "figure3", "-o", tmp_path / "futures").code == 0
    assert run("where", "figure3", "--at", "60", "-o", tmp_path / "where").code == 0
    files = [*(tmp_path / "futures").iterdir(), tmp_path / "where" / "where.csv"]
    assert len(files) == 4
    for path in files:
        assert missing(path.name, columns_of(path)) == set()


def test_tables_of_experiments_and_instances() -> None:
    assert missing("results.csv", {"id", "method", "seed", "targets", *FIGURES}) == set()
    assert missing("timings.parquet", {"id", *TIMING}) == set()
    instances = tomllib.loads(instances_path().read_text())["instance"]
    assert missing("instances.toml", {key for table in instances for key in table}) == set()


def test_what_is_not_named_is_seen() -> None:
    assert missing("weights.parquet", {"weight", "width"}) == {"width"}
