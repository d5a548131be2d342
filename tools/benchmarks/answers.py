"""How soon there are answers: which questions are worth a call, and a new plan after a report."""

import sys
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.figures import Figure
from benchmarks.grid import fresh, opened_at
from benchmarks.news import DETECTS
from benchmarks.towns import opened as opened_town
from planner import OpenScenario, Remembering, Standing, open_scenario
from planner.compiling import COMPILING
from planner.export.flyable import against
from planner.mission.ask import ask
from planner.mission.heard import Heard
from planner.mission.live import BEST_S, QUICK_S, Live, Offer
from planner.mission.questions import About, of_a_flight
from planner.paper.in_flight import OLD_S, Flight, report_of

QUESTIONS, ASKED_S, RANKED_S, JUDGES = 12, 1800.0, 30.0, 4000
INNER = [(row, col) for row in (1, 2, 3) for col in (1, 2, 3)]  # nodes that have a camera
HEARD_S = 600.0  # after the target was last seen, when its place is told as the report has it
LAW = ('uav.aircraft="multicopter"', "uav.speed_mps=20", "sensor.detects=0.9")


def question_rows(u0_km: int) -> Iterator[Figure]:
    """Rank twelve questions before take-off, with recordings and compiled code at hand."""
    opened = opened_at(u0_km, DETECTS)
    flight = Flight.planned(Remembering(opened, 1), fresh(opened, JUDGES))
    mission = flight.mission()
    going_on = mission.heard(Standing(flight.plan.take_off_s))
    believed = flight.recorder.planning().futures
    cameras = [opened.network.junction_index[f"r{row}c{col}"] for row, col in INNER]
    questions = of_a_flight(About(believed, opened.network, ASKED_S, cameras))
    begun_s = time.process_time() - COMPILING.spent_s
    found = ask(flight.recorder, going_on, flight.method, questions, flight.targets)
    took_s = time.process_time() - COMPILING.spent_s - begun_s
    yield Figure("questions ranked", "", (float(len(found)),), at_least=QUESTIONS)
    yield Figure("CPU time", "s", (took_s,), at_most=RANKED_S)
    best = found[0]
    yield Figure(f"the best one, {best.question.asked}, saves", "s", (best.saves_s,))
    yield Figure("the same, lower 95 % limit", "s", (best.low_s,))


def live_rows(town: str, particles: int) -> Iterator[Figure]:
    """Hear one report in flight, in a town: seconds by the clock until there are new plans."""
    with TemporaryDirectory() as folder:
        if opened_town(town, "dice", 1, Path(folder)) is None:
            print(f"{town} is left out: its data are not here", file=sys.stderr)
            return
        more = (*LAW, f"search.particles={particles}")
        opened = open_scenario(Path(folder), overrides=more)
        offers = offered(opened)
    quick, best = offers
    yield Figure("report heard: a first plan", "s", (quick.took_s,), at_most=QUICK_S)
    yield Figure("the best one", "s", (best.took_s,), at_most=BEST_S)
    yield Figure("it saves of the time to come", "%", (100.0 * best.found.lead.share,))


def offered(opened: OpenScenario) -> list[Offer]:
    """Return the plans that are offered after a report of where one of the particles was."""
    recorder = Remembering(opened)
    flight = Flight.planned(recorder, recorder.planning().futures)
    mission, offers = flight.mission(), list[Offer]()
    mission.warm_up()
    # The nearest to the middle of where they may be then.
    at_s = HEARD_S - OLD_S
    there_m = flight.targets.positions(at_s)
    middle_m = np.nanmean(there_m, axis=0)
    nearest = int(np.nanargmin(np.hypot(*(there_m - middle_m).T)))
    report = report_of(there_m[nearest], HEARD_S)

    def takes(offer: Offer) -> bool:
        offers.append(offer)
        return True

    Live(mission, against).hear(Heard(news=(report,)), HEARD_S, takes)
    return offers
