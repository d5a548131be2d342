"""The small town on a net that says where it lies, and whose it is."""

from pathlib import Path

from planner.mission.opening import open_scenario
from support.command_line import TOWN

UTM = 'projParameter="+proj=utm +zone=32 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"'
OFFSET_M = (-294_000.0, -5_498_000.0)
CREDIT = "© who -- drew it"
REAL = {  # keys of [uav] of an aircraft that brakes and climbs
    "speed_mps": 15,
    "acceleration_mps2": 1.4,
    "corner_m": 2,
    "climb_mps": 2.5,
    "descend_mps": 1.5,
    "max_flight_time_s": 1500,
    "return_to": "start",
}
SETS = tuple(word for key, value in REAL.items() for word in ("--set", f"uav.{key}={value}"))


def on_earth(folder: Path) -> Path:
    """Write the town's scenario into a folder, with a moment at which the target was seen."""
    net = open_scenario(TOWN).network.path.read_text()
    east, north = OFFSET_M
    net = net.replace('projParameter="!"', UTM)
    net = net.replace('netOffset="0.00,0.00"', f'netOffset="{east:.2f},{north:.2f}"')
    assert UTM in net
    (folder / "town.net.xml").write_text(net)
    text = (Path(TOWN) / "scenario.toml").read_text()
    text = text.replace('nodes = "town.nod.xml"\nedges = "town.edg.xml"', 'net = "town.net.xml"')
    text = text.replace("exits", f'attribution = "{CREDIT}"\nexits')
    text = text.replace("[target]", '[target]\nsighted_at = "2026-05-01T14:05:00+02:00"')
    (folder / "scenario.toml").write_text(text)
    return folder
