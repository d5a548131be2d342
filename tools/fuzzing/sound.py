"""Small sound files of each kind that users bring, to be changed by chance."""

import csv
import shutil
import struct
from collections.abc import Sequence
from pathlib import Path

import pyarrow
import pyarrow.parquet

ROOT = Path(__file__).parents[2]
FIGURE3 = ROOT / "sumo_nets" / "figure3"
KNOTS = (
    (0, 0.0, 0.0, 0.0),
    (0, 500.0, 5000.0, 0.0),
    (1, 0.0, 5000.0, 0.0),
    (1, 500.0, 7500.0, 2000.0),
)
SAMPLES = ((0, "a", 0.0), (0, "b", 500.0), (60, "a", 600.0), (60, "b", 1100.0), (120, "a", 1200.0))
TURNS = """<turns><interval begin="0" end="3600">
<edgeRelation from="AB" to="BC" probability="0.7"/>
<edgeRelation from="AB" to="BD" probability="0.3"/>
</interval></turns>
"""
IN_TOWN = """network = { net = "sumo:tools/game/DRT/osm.net.xml" }
target = { start = "anywhere" }
uav = { start = { x_m = 600, y_m = 700 } }
airspace = { no_fly = "park.geojson", fence = [[-9000, -9000], [9000, -9000], [0, 9000]] }
"""
PARK = """{"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {},
"geometry": {"type": "Polygon", "coordinates": [[[13.525, 52.43], [13.53, 52.43], [13.53, 52.44],
[13.525, 52.44], [13.525, 52.43]]]}}]}
"""
ZONES = """<additional>
<taz id="z" edges="AB"/>
<taz id="w"><tazSource id="AB" weight="1"/><tazSink id="CF" weight="2"/></taz>
<taz id="s" shape="-10,-10 900,-10 900,900"/>
</additional>
"""
ROUTES = """<routes><route id="r" edges="AB BC CF"/>
<routeDistribution id="d">
<route refId="r" probability="3"/><route edges="AB BD"/>
</routeDistribution>
<vehicle id="a" depart="0" route="d"/><vehicle id="b" depart="1"><route edges="AB BD"/></vehicle>
</routes>
"""
TRIPS = '<routes><trip id="a" depart="0" to="CF"/><flow id="b" begin="0" to="DG"/></routes>'
CONFIG = """<configuration><input><route-files value="cars.rou.xml"/>
<additional-files value="stops.add.xml"/></input>
<time><begin value="0:00:10"/><step-length v="0.5"/></time>
<output><fcd-output value="fcd.xml"/></output><scale>1.5</scale></configuration>
"""
CARS = """<routes><vType id="car"><param key="has.ssm.device" value="1"/></vType>
<flow id="f" type="car" begin="0" end="99" from="AB" to="CF"/><include href="more.xml"/></routes>
"""
STOPS = """<additional><e1Detector id="d" lane="AB_0" pos="9" file="e1.xml"/>
<rerouter id="r" edges="AB" file="more.xml"/><edgeData id="e" file="e.xml"/></additional>
"""
PROFILE = """[[mix]]
weight = 2
start = { x_m = 900, y_m = 9, radius_m = 50, heading_deg = 90 }
goes = [{ edge = "CF", p = 0.5 }, { x_m = 9000, y_m = 0, p = 0.5 }]
[[mix]]
weight = 1
start = [{ edge = "AB", from_m = 10, to_m = 200 }]
stops = { parked = 0.1, share = 0.5, mean_s = 60 }
"""
EXPERIMENT = """title = "two methods"
scenario = "scenario.toml"
replicates = 3
[factors]
method = ["wait", "greedy"]
"search.horizon_s" = [3600, 4000]
"""


def put_scenario(folder: Path) -> None:
    """Put a scenario and its sources."""
    for name in ("scenario.toml", "figure3.nod.xml", "figure3.edg.xml"):
        shutil.copy(FIGURE3 / name, folder)


def put_experiment(folder: Path) -> None:
    """Put an experiment on it."""
    put_scenario(folder)
    (folder / "experiment.toml").write_text(EXPERIMENT, encoding="utf-8")


def put_turns(folder: Path) -> None:
    """Put counted turns."""
    put_scenario(folder)
    (folder / "turns.xml").write_text(TURNS, encoding="utf-8")


def put_park(folder: Path) -> None:
    """Put a town with a no-fly area."""
    (folder / "scenario.toml").write_text(IN_TOWN, encoding="utf-8")
    (folder / "park.geojson").write_text(PARK, encoding="utf-8")


def put_places(folder: Path) -> None:
    """Put files that say where targets start and go."""
    put_scenario(folder)
    files = {
        "zones.add.xml": ZONES,
        "town.rou.xml": ROUTES,
        "trips.xml": TRIPS,
        "own.toml": PROFILE,
    }
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def put_traffic(folder: Path) -> None:
    """Put a SUMO scenario of traffic."""
    put_scenario(folder)
    files = {"run.sumocfg": CONFIG, "cars.rou.xml": CARS, "stops.add.xml": STOPS}
    for name, text in {**files, "more.xml": "<routes/>"}.items():
        (folder / name).write_text(text, encoding="utf-8")


def put_net(folder: Path) -> None:
    """Put a net and a configuration that names it."""
    from planner.mission.opening import open_scenario

    put_scenario(folder)
    shutil.copy(open_scenario("figure3").network.path, folder / "net.net.xml")
    text = '<configuration><input><net-file value="net.net.xml"/></input></configuration>'
    (folder / "net.sumocfg").write_text(text, encoding="utf-8")


def put_fcd_xml(folder: Path) -> None:
    """Put SUMO's floating car data as XML."""
    lines = ["<fcd-export>"]
    for time_s in sorted({time_s for time_s, *_ in SAMPLES}):
        lines.append(f'<timestep time="{time_s}">')
        lines += [
            f'<vehicle id="{name}" x="{x_m}" y="0" speed="10" pos="{x_m}" lane="AB_0"/>'
            for at_s, name, x_m in SAMPLES
            if at_s == time_s
        ]
        lines.append("</timestep>")
    (folder / "fcd.xml").write_text("\n".join([*lines, "</fcd-export>\n"]), encoding="utf-8")


def put_fcd_csv(folder: Path) -> None:
    """Put SUMO's floating car data as CSV."""
    with (folder / "fcd.csv").open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file, delimiter=";")
        rows.writerow(f"{'timestep' if name == 'time' else 'vehicle'}_{name}" for name in _FCD)
        rows.writerows(zip(*_fcd_columns().values(), strict=True))


_FCD = ("time", "id", "x", "y", "speed", "pos", "lane")


def _fcd_columns() -> dict[str, Sequence[object]]:
    time_s, names, x_m = zip(*SAMPLES, strict=True)
    count = len(SAMPLES)
    columns = (time_s, names, x_m, [0.0] * count, [10.0] * count, x_m, ["AB_0"] * count)
    return dict(zip(_FCD, columns, strict=True))


def put_fcd_parquet(folder: Path) -> None:
    """Put SUMO's floating car data as Parquet."""
    columns = _fcd_columns() | {"time": [float(time_s) for time_s, *_ in SAMPLES]}
    named = {
        f"{'timestep' if name == 'time' else 'vehicle'}_{name}": column
        for name, column in columns.items()
    }
    pyarrow.parquet.write_table(pyarrow.table(named), folder / "fcd.parquet")


def put_futures(folder: Path) -> None:
    """Put recorded futures."""
    particle, *columns = zip(*KNOTS, strict=True)
    knots = dict(zip(("time_s", "x_m", "y_m"), columns, strict=True))
    table = {"particle": pyarrow.array(particle, "int32"), **knots}
    pyarrow.parquet.write_table(pyarrow.table(table), folder / "futures.parquet")
    edges = {
        "particle": pyarrow.array([0, 0, 1], "int32"),
        "time_s": [0.0, 100.0, 0.0],
        "edge": ["AB", "BC", "BC"],
    }
    pyarrow.parquet.write_table(pyarrow.table(edges), folder / "edges.parquet")
    beside = {
        "particle": pyarrow.array([0, 1], "int32"),
        "weight": [0.3, 0.7],
        "at_end": ["stays", "gone"],
        "speed_mps": [10.0, 5.0],
        "route": ["AB", "BC"],
    }
    pyarrow.parquet.write_table(pyarrow.table(beside), folder / "particles.parquet")


def _planned(folder: Path) -> str:
    """Plan, in the process itself; there is nothing to see of it."""
    from planner.cli import main

    options = ("--set", "search.sampling=iid", "--set", "search.particles=8", "--targets", "5")
    run = str(folder / "run")
    main(["plan", "figure3", "--method", "rate", *options, "--json", "-o", run])
    return run


def put_run(folder: Path) -> None:
    """Plan and certify."""
    from planner.cli import main

    main(["certify", _planned(folder), "--work", "3", "--json"])


TRACK = ((50.0, 6.0, 0), (50.0, 6.001, 90), (50.001, 6.002, 160), (50.001, 6.003, 160))


def put_tracks(folder: Path) -> None:
    """Put a flight over the run's net, in each format that is read."""
    _planned(folder)
    moments = [f"2026-05-01T12:00:{2 * k:02d}Z" for k in range(len(TRACK))]
    rows = list(zip(TRACK, moments, strict=True))
    points = [
        f'<trkpt lat="{lat}" lon="{lon}"><ele>{height_m}</ele><time>{moment}</time></trkpt>'
        for (lat, lon, height_m), moment in rows
    ]
    text = "\n".join(["<gpx><trk><trkseg>", *points, "</trkseg></trk></gpx>\n"])
    (folder / "flown.gpx").write_text(text, encoding="utf-8")
    lines = [f"{moment},{lat},{lon},{height_m}" for (lat, lon, height_m), moment in rows]
    (folder / "flown.csv").write_text("\n".join(["utc,lat,lon,alt", *lines, ""]), encoding="utf-8")
    held = [f"{k},{900 * k},{100 * k},{k % 2}" for k in range(4)]
    text = "\n".join(["time_s,x_m,y_m,hold_s", *held, ""])
    (folder / "held.csv").write_text(text, encoding="utf-8")
    steps = [
        f'<timestep time="{k}"><vehicle id="uav" x="{90 * k}" y="9" lane=""/></timestep>'
        for k in range(4)
    ]
    text = "\n".join(["<fcd-export>", *steps, "</fcd-export>", ""])
    (folder / "flown.fcd.xml").write_text(text, encoding="utf-8")
    _tlog(folder / "flown.tlog")


def _tlog(path: Path) -> None:
    from pymavlink.dialects.v20 import ardupilotmega

    link = ardupilotmega.MAVLink(None, srcSystem=1)
    with path.open("wb") as file:
        for k, (lat, lon, height_m) in enumerate(TRACK):
            where = (round(1e7 * lat), round(1e7 * lon), 0, 1000 * height_m)
            message = link.global_position_int_encode(0, *where, 0, 0, 0, 0)
            file.write(struct.pack(">Q", 1_777_636_800_000_000 + 2_000_000 * k))
            file.write(message.pack(link))


def put_parameters(folder: Path) -> None:
    """Put a run, and the parameters of a vehicle as two ground stations write them."""
    put_run(folder)
    text = "# all\nWPNAV_SPEED,1500\nWPNAV_ACCEL 250.0\nRTL_ALT\t10000\nANGLE_MAX,4500\n"
    (folder / "v.param").write_text(text, encoding="utf-8")
    text = "# Vehicle-Id\n1\t1\tMPC_XY_CRUISE\t15.0\t9\n1\t1\tRTL_RETURN_ALT\t100\t6\n"
    (folder / "v.params").write_text(text, encoding="utf-8")
