"""Traffic where a net is all there is: so many vehicles an hour, from anywhere to anywhere."""

import hashlib
import sys
from pathlib import Path
from typing import NamedTuple

from planner.cache import cache_folder, is_whole, seal
from planner.errors import SumoError
from planner.files import written_whole
from planner.futures.simulation import plain_link
from planner.locks import held, temporary_folder
from planner.network.sumo import ended, sumo_file, sumo_version
from planner.provenance import sha256_of_file
from planner.xml_guard import rewritten_xml

TOOL = "tools/randomTrips.py"
# So much more often than elsewhere trips begin and end where the net was cut off.
FRINGE = 5.0


class Demand(NamedTuple):
    """How many vehicles set out."""

    vehicles_per_hour: float
    until_s: float  # from 0 on


def demand_routes(demand: Demand, net: Path, seed: int) -> Path:
    """Return the file of the trips of a demand, from the cache; SUMO's randomTrips draws them once.

    Raises
    ------
    SumoError
        If SUMO's program finds none, in its own words.
    """
    said = (tuple(demand), FRINGE, sha256_of_file(net), seed, sumo_version())
    key = hashlib.sha256(repr(said).encode()).hexdigest()[:32]
    kept = cache_folder("nets") / f"{key}.rou.xml"
    if is_whole(kept):
        return kept
    with held(cache_folder("unfinished") / key), temporary_folder() as work:
        if not is_whole(kept):  # another process may have made it meanwhile
            trips = _drawn(demand, plain_link(net, work), seed, work)
            with written_whole(kept) as new, new.open("wb") as file:
                rewritten_xml(trips, file, lambda _, said: said)  # without the day of its making
            seal(kept)
    return kept


def _drawn(demand: Demand, net: Path, seed: int, work: Path) -> Path:
    trips = work / "trips.xml"
    options = {
        "net-file": net,
        "output-trip-file": trips,
        "route-file": work / "routes.xml",  # of no use, but else it falls where the user is
        "seed": seed,
        "begin": 0,
        "end": demand.until_s,
        "insertion-rate": demand.vehicles_per_hour,
        "fringe-factor": FRINGE,
    }
    words = [f"--{name}={value}" for name, value in options.items()]
    tool = [sys.executable, str(sumo_file(TOOL))]
    code, said = ended([*tool, *words, "--random-depart", "--validate"], work)
    if code or not trips.is_file():
        last = said.strip().splitlines()[-1:] or ["it gives no reason"]
        raise SumoError(f"SUMO's randomTrips finds no trips on {net.resolve()}: {last[0]}")
    return trips
