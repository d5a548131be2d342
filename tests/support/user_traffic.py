"""A SUMO scenario as a user has one: in files of its own, with buses, persons and detectors."""

import gzip
from dataclasses import dataclass, replace
from pathlib import Path

from planner.futures.simulation import import_libsumo
from planner.futures.steering import stepper
from planner.futures.traffic import NO_PERMIT, Permit, Traffic, traffic_options
from planner.futures.warm_up import Warm, warm_up
from planner.futures.workers import in_processes
from planner.locks import temporary_folder
from planner.mission.opening import OpenScenario, open_scenario
from support.sumo_instances import town

SCENARIO = """
network = { net = "run.sumocfg" }
target = { start = ["nw-n"], driving = "traffic", speed_mps = { uniform = [10, 15] } }
uav = { start = { x_m = 0, y_m = 0 } }
sensor = { radius_m = 60 }
search = { horizon_s = 300, particles = 4 }
traffic = { sumocfg = "run.sumocfg", at = "0:01:00", realisations = 2 }
"""
CONFIG = """<configuration>
    <input>
        <net-file value="town.net.xml.gz"/>
        <route-files value="cars.rou.xml.gz,bus.rou.xml"/>
        <additional-files value="stops.add.xml"/>
    </input>
    <time><step-length value="0.2"/><end value="90"/></time>
    <processing>
        <lateral-resolution value="0.8"/><time-to-teleport value="120"/>
    </processing>
    <output><tripinfo-output value="trips.xml"/></output>
    <report><log value="log.txt"/></report>
    <!-- more -->
</configuration>
"""
CARS = """<routes>
    <vType id="car" sigma="0.5" speedDev="0.1"/>
    <flow id="flow" type="car" begin="0" end="300" vehsPerHour="1200" from="nw-n" to="s-se"/>
    <flow id="other" type="car" begin="0" end="300" vehsPerHour="600" from="w-centre" to="e-se"/>
    <!-- more -->
</routes>
"""
BUS = """<routes>
    <vType id="bus" vClass="bus" length="12"/>
    <route id="line" edges="w-centre centre-e e-se"/>
    <flow id="bus" type="bus" route="line" line="7" begin="0" end="300" period="60">
        <stop busStop="stop" duration="10"/>
    </flow>
    <person id="rider" depart="0">
        <walk edges="w-centre" arrivalPos="60"/><ride busStop="stop" lines="7"/>
    </person>
    <person id="walker" depart="0"><walk edges="nw-n n-ne"/></person>
</routes>
"""
STOPS = """<additional>
    <busStop id="stop" lane="centre-e_0" startPos="50" endPos="70" lines="7"/>
    <e1Detector id="loop" lane="centre-e_0" pos="90" period="10" file="loop.xml"/>
    <e2Detector id="queue" lane="centre-s_0" pos="1" length="50" period="10" file="queue.xml"/>
    <edgeData id="means" file="means.xml" period="30"/>
    <!-- more -->
</additional>
"""


def write_traffic(
    folder: Path, *, config: str = "", cars: str = "", stops: str = "", scenario: str = ""
) -> Path:
    """Write the files, with more in some of them; return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    with gzip.open(folder / "town.net.xml.gz", "wb") as net:
        net.write(town().path.read_bytes())
    with gzip.open(folder / "cars.rou.xml.gz", "wt", encoding="utf-8") as routes:
        routes.write(CARS.replace("<!-- more -->", cars))
    (folder / "bus.rou.xml").write_text(BUS)
    (folder / "stops.add.xml").write_text(STOPS.replace("<!-- more -->", stops))
    (folder / "run.sumocfg").write_text(CONFIG.replace("<!-- more -->", config))
    (folder / "scenario.toml").write_text(scenario or SCENARIO)
    return folder


def traffic_at(folder: Path, permit: Permit = NO_PERMIT) -> OpenScenario:
    """The scenario of a folder, opened."""
    return open_scenario(folder, permit=permit)


@dataclass(frozen=True)
class Told:
    """What a session of traffic is at the target's time 0, and the vehicles a minute later."""

    time_s: float
    step_s: float
    warm: Warm
    buses: int
    persons: int
    on_loop: int  # vehicles that the detector has seen in its last period
    places_m: tuple[tuple[str, float, float], ...]


def told_of(task: tuple[Traffic, Path, int]) -> Told:
    """Start a session on one realisation and look around: a task for a worker."""
    traffic, net, realisation = task
    libsumo = import_libsumo()
    with temporary_folder() as work:
        libsumo.start(traffic_options(traffic, net, realisation, work))
        step = stepper(libsumo, traffic.control)
        warm = warm_up(libsumo, step, traffic.at_s)
        names = libsumo.vehicle.getIDList()
        buses = sum(libsumo.vehicle.getVehicleClass(name) == "bus" for name in names)
        told = Told(
            libsumo.simulation.getTime(),
            libsumo.simulation.getDeltaT(),
            warm,
            buses,
            len(libsumo.person.getIDList()),
            sum(
                map(
                    libsumo.inductionloop.getLastIntervalVehicleNumber,
                    libsumo.inductionloop.getIDList(),
                )
            ),
            (),
        )
        for _ in range(10):
            step()
        names = libsumo.vehicle.getIDList()
        places = tuple((name, *libsumo.vehicle.getPosition(name)) for name in names)
        libsumo.close()
    return replace(told, places_m=places)


def told(opened: OpenScenario, realisation: int = 0) -> Told:
    """What a session on an open scenario's traffic is like."""
    assert opened.traffic is not None
    task = (opened.traffic, opened.network.path, realisation)
    (answer,) = in_processes(told_of, [task], workers=1)
    return answer


def seen_of(folder: Path) -> dict[str, tuple[int, int]]:
    """Names, sizes and times of last change of all that a folder holds."""
    return {
        str(path.relative_to(folder)): (path.stat().st_size, path.stat().st_mtime_ns)
        for path in sorted(folder.rglob("*"))
    }
