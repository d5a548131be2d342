"""What planning anew with news gains, and that it gains nothing without any.

On the 5 x 5 grid, detects .9. Intervals are over reports, or over sequences of alarms.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

from benchmarks.figures import Figure
from benchmarks.grid import SEED, fresh, opened_at
from planner import Remembering, Standing, plan_of_legs, stream
from planner.intervals import ratio_of_means
from planner.mission.alarms import Alarms, Compared, by_chance, compared, with_alarms
from planner.paper.in_flight import OLD_S, Flight, Heard, afresh, report_of, reported, with_no_news

DETECTS = "sensor.detects=0.9"
ARRIVALS_S = (1000.0, 2000.0, 4000.0)
ALARMS = Alarms(every_s=600.0, lasts_s=120.0)
REPORT_AIMS = {60: 20.0, 120: 22.0, 300: 22.0}  # percent, lower limits
LATE_AIMS, SLOWED_AIM = {60: 15.0, 120: 8.0}, 4.0
NO_NEWS, AFRESH = 0.3, 1.0  # percent, at most
SHARES = (0.25, 0.5, 0.75)  # of the flight, after which its rest is planned afresh
HEARD_S = 1000.0  # when a report comes that has to change the plan


def flight_from(u0_km: int, targets: int, *more: str) -> Flight:
    """Return the flight that is planned from one distance, and who judges it."""
    opened = opened_at(u0_km, DETECTS, *more)
    return Flight.planned(Remembering(opened, 1), fresh(opened, targets))


def silence_rows(u0_km: int, targets: int) -> Iterator[Figure]:
    """Measure what planning anew without news changes, with the old plan and without it."""
    flight = flight_from(u0_km, targets)
    anew_s = flight.expected_s(with_no_news(flight, *ARRIVALS_S))
    change = 100.0 * (anew_s / flight.whole_s - 1.0)  # below 0: the first plan was not the best
    yield Figure("E as planned", "s", (flight.whole_s,))
    yield Figure("E, planned anew three times", "s", (anew_s,))
    yield Figure("the same: E grows by", "%", (change,), at_most=NO_NEWS)
    ends_s = flight.plan.tracks[0].end_s
    for share in SHARES:
        whole_s = flight.expected_s(afresh(flight, share * ends_s))
        worse = 100.0 * (whole_s / flight.whole_s - 1.0)
        what = f"the old plan withheld at {share:.0%}: worse by"
        yield Figure(what, "%", (worse,), at_most=AFRESH)
    yield Figure("one report changes the plan", "", (float(_is_changed(flight)),), at_least=1)


def _is_changed(flight: Flight) -> bool:
    """Return whether a report of where one of the targets was makes another plan."""
    place_m = flight.targets.positions(HEARD_S - OLD_S)[0]
    mission = flight.mission()
    going_on = mission.heard(Standing(HEARD_S), [report_of(place_m, HEARD_S)], insist=True)
    return not mission.planned(going_on).is_kept


def report_rows(u0_km: int, targets: int, reports: int) -> Iterator[Figure]:
    """Measure what one report saves of the time still to come, at three times of arrival."""
    flight, all_of = flight_from(u0_km, targets), list[Heard]()
    for arrival_s in ARRIVALS_S:
        rng = stream(SEED, "reports", f"{arrival_s:g}")
        heard = [*reported(flight, arrival_s, reports, rng)]
        share, half = saved(heard)
        yield Figure(f"heard at {arrival_s:,.0f} s: remaining time less by", "%", (share,))
        all_of += heard
    share, half = saved(all_of)
    yield Figure("remaining time less by", "%", (share,))
    aim = REPORT_AIMS[u0_km]
    yield Figure("the same, lower 95 % limit", "%", (share - half,), at_least=aim)


def saved(heard: list[Heard]) -> tuple[float, float]:
    """Return how much less the time still to come is, percent, and half of its interval."""
    as_planned_s, anew_s = np.array(heard).T
    ratio, half = ratio_of_means(anew_s, as_planned_s)
    return 100.0 * (1.0 - ratio), 100.0 * half


def alarm_rows(u0_km: int, targets: int, sequences: int) -> Iterator[Figure]:
    """Measure planning anew after false alarms against the plan flown late, and a slowed one."""
    flight = flight_from(u0_km, targets)
    # The same share of its time that it stands still makes a UAV slower that never does.
    slower = f"uav.speed_mps={100.0 / (1.0 + ALARMS.lasts_s / ALARMS.every_s)}"
    order = [leg.leg for leg in flight_from(u0_km, 1000, slower).plan.legs[0]]
    route = plan_of_legs(flight.problem, "slowed", order)
    horizon_s = flight.problem.objective.horizon_s
    gaps = [ALARMS.gaps_s(horizon_s, stream(SEED, "alarms", k)) for k in range(sequences)]
    alarms = [partial(by_chance, one.tolist()) for one in gaps]
    found = compared(flight.mission(), flight.targets, alarms, ALARMS.lasts_s)
    fixed_s = tuple(
        flight.expected_s(with_alarms(flight.mission(route), one(), ALARMS.lasts_s, anew=False))
        for one in alarms
    )
    yield Figure("E, flown late", "s", (float(np.mean(found.late_s)),))
    yield Figure("E, planned anew", "s", (float(np.mean(found.anew_s)),))
    for name, one, least in (
        ("flown late", found, LATE_AIMS[u0_km]),
        ("the fixed plan for the slowed UAV", Compared(fixed_s, found.anew_s), SLOWED_AIM),
    ):
        yield Figure(f"less than {name}", "%", (100.0 * one.saved,))
        low = 100.0 * one.interval[0]
        yield Figure(f"less than {name}, lower limit", "%", (low,), at_least=least)
