"""What is tried: for each kind of file that users bring, small sound ones and a command."""

import random
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from fuzzing import sound
from fuzzing.mutations import NESTED, NUMBERS, WORDS

SMALL = ("--method", "wait", "--targets", "5", "--json")
KEYS = (
    *("search.seed", "search.horizon_s", "search.particles", "search.sampling", "search.objective"),
    *("uav.speed_mps", "uav.start.x_m", "uav.start", "uav.take_off_s", "uav.return_to", "title"),
    *("target.start.AB", "target.start", "target.speed_mps", "target.turning", "target.distance_m"),
    *("target.goes", "target.mix", "target.stops", "target.flees", "target.profile"),
    *(
        "target.last_seen_window_s",
        "sensor.radius_m",
        "greedy.tick_s",
        "network.nodes",
        "network.net",
        "truth.start",
        "x",
        "",
    ),
)


@dataclass(frozen=True)
class Kind:
    """A kind of file, its command, and which of the files in a seed folder are changed."""

    name: str
    seeds: Callable[[Path], None]  # puts the sound files into a folder
    changes: tuple[str, ...]  # one of these is changed
    words: tuple[str, ...] = ()  # of the command; empty: verify.py

    def command(self, rng: random.Random) -> list[str]:
        """Return the words of the command; with --set, a value of chance."""
        if self.name != "set":
            return list(self.words)
        value = rng.choice((*NUMBERS, *WORDS, *NESTED, "{ constant = 1 }", "[1, 2]", '"AB"'))
        key = rng.choice(KEYS)
        return [*self.words, "--set", f"{key}={value}".replace("\x00", "")]


ON_EARTH = ("export", "run", "--aircraft", "multicopter", "--origin", "50,6", "--check")
EXPORT = (*ON_EARTH, "--force", "--json", "--autopilot")
FLOWN = ("fly", "run", "--targets", "5", "--json", "--origin", "50,6", "--takes-off-at", "9")
RUN = ("run/plan.json", "run/plan.json", "run/run.json", "run/prices.parquet")
PROOF = tuple(f"run/{name}.parquet" for name in ("motion", "weights", "prices"))
OWN = ("plan", str(sound.FIGURE3), *SMALL, "--futures")

DRAWN = ("build", ".", "--json", "--set", "target.distance_m=anywhere")
SOBOL = ("--set", "search.sampling=sobol")
PLACES = (
    ("zone", "zones.add.xml", "start", '{taz="w",file="zones.add.xml"}'),
    ("zone drawn", "zones.add.xml", "start", '{taz="s",file="zones.add.xml"}'),
    ("goals", "zones.add.xml", "goes", '[{taz="z",file="zones.add.xml"},{edge="CF"}]'),
    ("routes", "town.rou.xml", "goes", '{file="town.rou.xml"}'),
    ("trips", "trips.xml", "goes", '{file="trips.xml"}'),
    ("profile", "own.toml", "profile", '"own.toml"'),
)

KINDS = (
    Kind("scenario", sound.put_scenario, ("scenario.toml",), ("build", ".", "--json")),
    Kind("scenario planned", sound.put_scenario, ("scenario.toml",), ("plan", ".", *SMALL)),
    Kind("set", sound.put_scenario, (), ("build", ".", "--json")),
    Kind(
        "experiment",
        sound.put_experiment,
        ("experiment.toml",),
        ("experiment", "experiment.toml", "--dry-run", "--json"),
    ),
    Kind(
        "sources",
        sound.put_scenario,
        ("figure3.nod.xml", "figure3.edg.xml"),
        ("build", ".", "--json"),
    ),
    Kind("net", sound.put_net, ("net.net.xml",), ("build", ".", "-n", "net.net.xml", "--json")),
    Kind(
        "survey", sound.put_net, ("net.net.xml", "net.sumocfg"), ("check", "net.sumocfg", "--json")
    ),
    Kind(
        "turns",
        sound.put_turns,
        ("turns.xml",),
        ("build", ".", "--set", 'target.turning={file="turns.xml"}', "--json"),
    ),
    Kind("areas", sound.put_park, ("park.geojson",), ("build", ".", "--json")),
    *(
        Kind(name, sound.put_places, (file,), (*DRAWN, *SOBOL, "--set", f"target.{key}={value}"))
        for name, file, key, value in PLACES
    ),
    Kind(
        "traffic",
        sound.put_traffic,
        ("run.sumocfg", "cars.rou.xml", "stops.add.xml"),
        ("build", ".", "--json", "--set", 'traffic={ sumocfg = "run.sumocfg", at = 60 }'),
    ),
    Kind("fcd xml", sound.put_fcd_xml, ("fcd.xml",), (*OWN, "fcd.xml")),
    Kind("fcd csv", sound.put_fcd_csv, ("fcd.csv",), (*OWN, "fcd.csv")),
    Kind("fcd parquet", sound.put_fcd_parquet, ("fcd.parquet",), (*OWN, "fcd.parquet")),
    Kind(
        "futures",
        sound.put_futures,
        ("futures.parquet", "edges.parquet", "particles.parquet"),
        (*OWN, "futures.parquet"),
    ),
    Kind("fly", sound.put_run, RUN, ("fly", "run", "--targets", "5", "--json")),
    *(
        Kind(f"track {name}", sound.put_tracks, (name,), (*FLOWN, "--track", name))
        for name in ("flown.gpx", "flown.csv", "held.csv", "flown.fcd.xml", "flown.tlog")
    ),
    *(
        Kind(
            f"parameters {pilot}", sound.put_parameters, (name,), (*EXPORT, pilot, "--params", name)
        )
        for pilot, name in (("ardupilot", "v.param"), ("px4", "v.params"))
    ),
    Kind("certify", sound.put_run, RUN, ("certify", "run", "--work", "1", "--force", "--json")),
    Kind("verify", sound.put_run, (*RUN[1:], *PROOF, "run/net.json")),
)


def call_of(kind: Kind, words: Sequence[str]) -> Callable[[], int]:
    """Return the call of a command's words, or of verify.py."""
    import verify

    from planner.cli import main

    if not kind.words:
        return lambda: verify.main(["run"])

    def call() -> int:
        sys.argv = ["planner", *words]
        return main(list(words))

    return call
