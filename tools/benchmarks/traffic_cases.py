"""Towns with traffic, as scenario files: Berlin at a stated rate, Bologna in its rush hour."""

import os
import sys
from pathlib import Path

CASE = """
[network]
net = "{net}"
[traffic]
{traffic}
[target]
start = {start}
speed_mps = {{ uniform = [11, 15] }}
driving = "traffic"
[uav]
start = {uav}
speed_mps = 25
take_off_s = {take_off_s}
[sensor]
radius_m = 60
[search]
horizon_s = 1200
particles = {particles}
seed = 1
"""
BERLIN: dict[str, object] = {
    "net": "sumo:tools/game/DRT/osm.net.xml",
    "start": "{ x_m = 1492.6, y_m = 671.7, radius_m = 150 }",
    "uav": "{ x_m = 0, y_m = 671.7 }",
    "take_off_s": 300,
}
BOLOGNA: dict[str, object] = {
    "net": "acosta_buslanes.net.xml",
    "traffic": 'sumocfg = "run.sumocfg"\nat = 1800\ndepart_offset_s = 300',
    "start": "{ x_m = 900, y_m = 700, radius_m = 150 }",
    "uav": "{ x_m = 0, y_m = 700 }",
    "take_off_s": 60,
}


def berlin(folder: Path, per_hour: float, particles: int) -> Path:
    """Write Berlin with so many vehicles setting out in an hour, and return its scenario file."""
    folder.mkdir(parents=True, exist_ok=True)
    return _written(folder, {**BERLIN, "traffic": f"vehicles_per_hour = {per_hour:g}"}, particles)


def bologna(folder: Path, particles: int) -> Path | None:
    """Write Bologna with its own traffic; None, with a word, where its data are not."""
    data = Path(os.environ.get("PLANNER_DATA", "data"), "bologna_acosta")
    if not data.is_dir():
        print(f"Bologna is left out: there is no folder {data}", file=sys.stderr)
        return None
    folder.mkdir(parents=True, exist_ok=True)
    for file in data.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    return _written(folder, BOLOGNA, particles)


def _written(folder: Path, text: dict[str, object], particles: int) -> Path:
    path = folder / "scenario.toml"
    path.write_text(CASE.format(**text, particles=particles), encoding="utf-8")
    return path
