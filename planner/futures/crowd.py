"""All vehicles of a realisation of the traffic, from the target's time 0 on: who looks like it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner.arrays import first_rows
from planner.futures.futures import Futures
from planner.futures.simulation import import_libsumo, own_message
from planner.futures.steering import Step, stepper
from planner.futures.traffic import Traffic, traffic_options
from planner.futures.warm_up import warm_up
from planner.futures.workers import in_parts
from planner.locks import temporary_folder
from planner.network.road_network import RoadNetwork

SAMPLE_S = 2.0  # between two looks, in which a car drives straight on


@dataclass(frozen=True)
class Watch:
    """One realisation of the traffic that is looked at."""

    net: Path
    given_as: Path  # the file that messages name
    traffic: Traffic
    realisation: int
    end_s: float  # on the target's clock


def crowds(
    network: RoadNetwork,
    traffic: Traffic,
    realisations: Sequence[int],
    end_s: float,
    workers: int | None = None,
) -> list[Futures]:
    """Return all vehicles of each realisation, as futures; who leaves the net is gone.

    Raises
    ------
    SumoError
        With SUMO's own message.
    """
    watches = [
        Watch(network.path.absolute(), network.given_as, traffic, realisation, end_s)
        for realisation in realisations
    ]
    found = dict(in_parts(watched, watches, workers=workers))
    return [found[number] for number in range(len(watches))]


def watched(watch: Watch) -> Futures:
    """Return all vehicles of a realisation, in a process that does nothing else."""
    with temporary_folder() as folder:
        (work := folder / "sumo").mkdir()
        with own_message(folder / "errors.txt", watch.net, watch.given_as):
            libsumo = import_libsumo()
            libsumo.start(traffic_options(watch.traffic, watch.net, watch.realisation, work))
            try:
                step = stepper(libsumo, watch.traffic.control)
                warm_up(libsumo, step, watch.traffic.at_s)
                return _seen(libsumo, step, watch.end_s)
            finally:
                libsumo.close()


def _seen(libsumo: Any, step: Step, end_s: float) -> Futures:
    """Return where all vehicles are, from now on."""
    car: dict[str, int] = {}
    rows: list[tuple[int, float, float, float]] = []
    begun_s = now_s = libsumo.simulation.getTime()
    while now_s <= begun_s + end_s:
        for name in libsumo.vehicle.getIDList():
            x_m, y_m = libsumo.vehicle.getPosition(name)
            rows.append((car.setdefault(name, len(car)), now_s - begun_s, x_m, y_m))
        next_s = now_s + SAMPLE_S
        while now_s < next_s:
            step()
            now_s = libsumo.simulation.getTime()
    who, *columns = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    order, many = np.argsort(who, kind="stable"), len(car)
    time_s, x_m, y_m = (column[order] for column in columns)
    return Futures(
        time_s,
        x_m,
        y_m,
        first_knot=first_rows(np.bincount(who.astype(np.int64), minlength=many)),
        weight=np.full(many, 1.0 / max(many, 1)),
        gone=np.ones(many, dtype=bool),
    )
