"""A forger of certified runs, and the verdict of tools/verify.py on what it has forged."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import pyarrow
import pyarrow.parquet
import pytest

from support.certified_runs import reseal

NO_PRICES = pyarrow.table(
    {
        "flight": pyarrow.array([], pyarrow.list_(pyarrow.int64())),
        "price": pyarrow.array([], pyarrow.list_(pyarrow.float64())),
    }
)
TOOLS = Path(__file__).parents[2] / "tools"


def verdicts(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[[Path], int]:
    """Return what tells the exit code of verify.py: refusals are one line, none a traceback."""
    monkeypatch.syspath_prepend(TOOLS)
    main = import_module("verify").main

    def code(folder: Path) -> int:
        capsys.readouterr()
        found: int = main([str(folder)])
        said = capsys.readouterr()
        assert len(said.err.splitlines()) == (found == 2)
        assert said.err.isprintable() or said.err.strip("\n").isprintable()
        assert (found == 1) == ("WRONG" in said.out)
        return found

    return code


@dataclass
class Forger:
    """A copy of a run, whose files are changed."""

    folder: Path

    def json(self, name: str) -> Any:
        return json.loads((self.folder / name).read_text(encoding="utf-8"))

    def write(self, name: str, content: Any) -> None:
        (self.folder / name).write_text(json.dumps(content), encoding="utf-8")

    def put(self, name: str, *keys: Any) -> None:
        """Change one value of a JSON file; but for changed digests those in run.json stay true."""
        content = self.json(name)
        *way, last, value = keys
        place = content
        for key in way:
            place = place[key]
        place[last] = value(place[last]) if callable(value) else value
        self.write(name, content)
        if keys[0] != "sha256":
            reseal(self.folder)

    def drop(self, name: str, *keys: Any) -> None:
        content = self.json(name)
        *way, last = keys
        place = content
        for key in way:
            place = place[key]
        del place[last]
        self.write(name, content)

    def text(self, name: str, old: str, new: str) -> None:
        path = self.folder / name
        text = path.read_text(encoding="utf-8")
        assert old in text
        path.write_text(text.replace(old, new, 1), encoding="utf-8")

    def column(self, name: str, column: str, values: Any, kind: Any = None) -> None:
        path = self.folder / name
        table = pyarrow.parquet.read_table(path)
        if callable(values):
            values = values(table[column].to_pylist())
        new = pyarrow.array(values, kind)
        table = table.set_column(table.column_names.index(column), column, new)
        pyarrow.parquet.write_table(table, path)

    def table(self, name: str, change: Callable[[Any], Any]) -> None:
        path = self.folder / name
        pyarrow.parquet.write_table(change(pyarrow.parquet.read_table(path)), path)


def climbs_for_ever(forger: Forger) -> None:
    """Aircraft that take longer than the search to climb: nobody can be found, and none is."""
    content = forger.json("plan.json")
    horizon_s = content["planned"]["horizon_s"]
    for flight in content["uavs"]:
        up_s, x_m, y_m = flight["waypoints"][0][:3]
        flight |= {"waypoints": [[up_s, x_m, y_m], [up_s + 1e6, x_m, y_m]]}
        flight |= {"legs": [], "sensor_on": []}
        flight["aircraft"] = {
            **dict.fromkeys(("acceleration_mps2", "corner_m", "descend_mps", "min_speed_mps")),
            "climb_mps": max(1.0, flight["altitude_m"]) / 1e5,
            "hover": True,
            "reserve_s": 0.0,
            "wind_mps": [0.0, 0.0],
            "headwind_mps": 0.0,
        }
    content["planned"] |= {
        "expected_detection_time_s": horizon_s,
        "detection_probability": 0.0,
    }
    content["certificate"] |= {
        "plan_class": "free",
        "bin_s": 0.0,
        "lower_bound_s": horizon_s,
        "gap": 0.0,
    }
    forger.write("plan.json", content)
    pyarrow.parquet.write_table(NO_PRICES, forger.folder / "prices.parquet")
    reseal(forger.folder)
