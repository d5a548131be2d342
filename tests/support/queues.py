"""A straight road on which a lorry stands, and a grid of signals with cars: traffic to ride in."""

from pathlib import Path

import numpy as np

from planner.belief.particles import Particles
from planner.futures.riders import TrafficSession
from planner.futures.simulation import Vehicle
from planner.futures.traffic import Traffic
from planner.network.build import build_net
from planner.network.read import read_net
from planner.network.road_network import RoadNetwork
from support.signal_grid import signal_grid

LORRY_M, LORRY_S = 305.0, 200.0  # where its front stands, and until when


def road(folder: Path, lanes: int) -> RoadNetwork:
    """1,200 m due east, then 1,200 m more."""
    nodes, edges = folder / "road.nod.xml", folder / "road.edg.xml"
    ids = zip("abc", (0, 1200, 2400), strict=True)
    places = "".join(f'<node id="{name}" x="{x}" y="0"/>' for name, x in ids)
    nodes.write_text(f"<nodes>{places}</nodes>")
    streets = "".join(
        f'<edge id="{a}{b}" from="{a}" to="{b}" numLanes="{lanes}" speed="13.9"/>'
        for a, b in ("ab", "bc")
    )
    edges.write_text(f"<edges>{streets}</edges>")
    return read_net(build_net(nodes, edges, abstract=False), exits=())


def behind_a_lorry(folder: Path, *, at_s: float = 10.0, cars: int = 0) -> Traffic:
    """A lorry that stands in the right lane until `LORRY_S`, cars that queue behind it or come."""
    queue = "".join(
        f'<vehicle id="car{k}" type="car" depart="1" departPos="{LORRY_M - 20 - 8 * k}">'
        '<route edges="ab bc"/></vehicle>'
        for k in range(cars)
    )
    routes = folder / "queue.rou.xml"
    routes.write_text(
        '<routes><vType id="car" sigma="0"/><vType id="lorry" sigma="0" vClass="truck"/>'
        f'<vehicle id="lorry" type="lorry" depart="0" departPos="{LORRY_M - 10}">'
        f'<route edges="ab bc"/><stop lane="ab_0" endPos="{LORRY_M}" until="{LORRY_S}"/></vehicle>'
        f'{queue}<vehicle id="later" type="car" depart="30"><route edges="ab bc"/></vehicle>'
        "</routes>"
    )
    return Traffic(routes, at_s, realisations=1, seed=1, routes=(routes,), allowed=(folder,))


def nobody(folder: Path, *, at_s: float = 10.0) -> Traffic:
    """Traffic without a car."""
    routes = folder / "nobody.rou.xml"
    routes.write_text("<routes/>")
    return Traffic(routes, at_s, realisations=1, seed=1, routes=(routes,), allowed=(folder,))


def rider(name: str, start_m: float, *, depart_s: float = 0.0) -> Vehicle:
    """A vehicle on the road."""
    return Vehicle(name, ("ab", "bc"), (12.0, 12.0), (1200.0, 1200.0), start_m, depart_s)


def session(
    network: RoadNetwork,
    traffic: Traffic,
    together: tuple[tuple[Vehicle, ...], ...],
    *,
    end_s: float = 120.0,
    alone: bool = False,
) -> TrafficSession:
    """Vehicles in the traffic's first realisation."""
    copies = (alone,) * len(together)
    net, given_as = network.path.absolute(), network.given_as
    return TrafficSession(net, given_as, traffic, 0, together, copies, end_s)


def busy_grid(folder: Path, *, at_s: float = 120.0, realisations: int = 2) -> Traffic:
    """Cars from and to all sides of the grid of signals, imperfect drivers all of them."""
    flows = [
        f'<flow id="{k}" begin="0" end="900" period="exp(0.1)" from="{a}" to="{b}"/>'
        for k, (a, b) in enumerate(
            [("A0B0", "E3E4"), ("E0D0", "A3A4"), ("A4B4", "E1E0"), ("E4D4", "A1A0")]
        )
    ]
    routes = folder / "grid.rou.xml"
    routes.write_text(f"<routes>{''.join(flows)}</routes>")
    some = {"realisations": realisations, "seed": 3}
    return Traffic(routes, at_s, **some, routes=(routes,), allowed=(folder,))


def grid_particles(count: int, *, edge: str = "B2C2", turns: int = 8) -> Particles:
    """Particles that start within one street of the grid and turn at random."""
    network, rng = signal_grid(), np.random.default_rng(5)
    routes = []
    for _ in range(count):
        route = [network.edge_index[edge]]
        while len(route) < turns and len(network.turns(route[-1])):
            route.append(int(rng.choice(network.turns(route[-1]))))
        routes.append(route)
    lengths = [len(route) for route in routes]
    return Particles(
        weight=np.full(count, 1 / count),
        start_m=rng.uniform(0, 180, count),
        depart_s=np.zeros(count),
        first_edge=np.concatenate(([0], np.cumsum(lengths))),
        route_edge=np.concatenate(routes),
        speed_mps=np.repeat(rng.uniform(11, 15, count), lengths),
        seed=rng.integers(1, 2**31 - 1, count),
        gone=np.zeros(count, dtype=bool),
        driving="traffic",
    )


GRID_TOML = """
[network]
net = "grid.net.xml"
[traffic]
sumocfg = "run.sumocfg"
at = 30
realisations = 2
[target]
start = { B2C2 = 1 }
distance_m = "anywhere"
speed_mps = { uniform = [11, 15] }
driving = "traffic"
[uav]
start = { x_m = 0, y_m = 0 }
speed_mps = 20
[sensor]
radius_m = 60
[search]
horizon_s = 40
particles = 12
"""
GRID_CONFIG = """
<configuration>
    <input>
        <net-file value="grid.net.xml"/>
        <route-files value="grid.rou.xml"/>
        <additional-files value="loops.add.xml"/>
    </input>
    <output><tripinfo-output value="trips.xml"/></output>
    <report><log value="log.txt"/></report>
</configuration>
"""
LOOPS = """
<additional>
    <e1Detector id="e1" lane="B2C2_0" pos="50" period="60" file="e1.xml"/>
</additional>
"""


def grid_scenario(folder: Path) -> Path:
    """A user's scenario on the grid, in a folder of its own, which would write into it."""
    busy_grid(folder)
    (folder / "grid.net.xml").write_bytes(signal_grid().path.read_bytes())
    (folder / "run.sumocfg").write_text(GRID_CONFIG)
    (folder / "loops.add.xml").write_text(LOOPS)
    scenario = folder / "scenario.toml"
    scenario.write_text(GRID_TOML)
    return scenario
