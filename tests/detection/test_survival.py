"""Sensors that miss: sweep widths, contacts and survival against closed forms and small steps."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from planner.arrays import Floats
from planner.detection.evaluate import evaluate, evaluate_all
from planner.detection.first_detection import first_detection
from planner.detection.kernels.worth import Goal, others_of, worth_of_contact
from planner.detection.objective import Objective
from planner.detection.sensor import Sensor, rate_of, rate_of_sweep, sweep_width_m
from planner.detection.survival import Searched, contacts, survival
from planner.errors import InputError
from planner.flight.track import Track
from planner.futures.futures import Futures
from support.search_instances import strayed

HORIZON_S = 10_000.0
SIDE_M = 10e3
ALWAYS = np.array([[-np.inf, np.inf]])


def one(time_s: list[float], x_m: list[float], y_m: list[float]) -> Futures:
    return Futures(
        time_s=np.array(time_s),
        x_m=np.array(x_m),
        y_m=np.array(y_m),
        first_knot=np.array([0, len(time_s)]),
        weight=np.ones(1),
        gone=np.zeros(1, dtype=bool),
    )


def wandering(seed: int, *, points: int = 12, within_m: float = 8e3) -> Track:
    rng = np.random.default_rng(seed)
    time_s = np.cumsum(np.concatenate(([5.0], rng.uniform(20.0, 120.0, points - 1))))
    half = float(time_s[points // 2])
    on = np.array([[0.0, half], [half + 40.0, np.inf]])
    return Track(time_s, *rng.uniform(-within_m, within_m, (2, points)), on)


RateAt = Callable[[Floats], Floats]  # of detection per second, by range in metres


def exposures(futures: Futures, track: Track, rate_at: RateAt, times_s: Floats) -> Floats:
    """The rate at which a flight detects each particle at each time, (times, N): the slow twin."""
    at = np.array([futures.positions(float(time_s)) for time_s in times_s])
    is_on = (
        (track.sensor_on[:, 0, None] <= times_s) & (times_s <= track.sensor_on[:, 1, None])
    ).any(0)
    away_m = np.linalg.norm(at - track.xy(times_s)[:, None], axis=2)
    return np.asarray(is_on[:, None] * rate_at(away_m))


def within(sensor: Sensor) -> RateAt:
    return lambda away_m: (away_m <= sensor.radius_m) * sensor.rate_per_s


def by_small_steps(futures: Futures, flights: list[Searched], moments: int) -> Floats:
    """E[min(time seen, horizon)] of each particle: the rate added up moment by moment."""
    end_s = max(flight.track.end_s for flight in flights)
    edges = np.linspace(0.0, end_s, moments + 1)
    times_s, step_s = 0.5 * (edges[1:] + edges[:-1]), edges[1]
    rate = sum(exposures(futures, track, within(sensor), times_s) for track, sensor in flights)
    exposure = np.cumsum(rate, axis=0) * step_s
    unseen = np.exp(-np.vstack([np.zeros(len(futures)), exposure]))
    return step_s * 0.5 * (unseen[1:] + unseen[:-1]).sum(axis=0) + (HORIZON_S - end_s) * unseen[-1]


def test_the_slow_twin_knows_the_inverse_cube_law() -> None:
    """Koopman's law, which no sensor here has: the sweep width, and parallel sweeps."""
    m, v = 2e6, 100.0
    aside_m, half_m, moments = np.geomspace(40.0, 1e4, 60), 1e5, 10_000
    some, none = len(aside_m), np.zeros(len(aside_m))
    resting = Futures(none, none, aside_m, np.arange(some + 1), none + 1 / some, none > 0)
    ends_m = np.array([-half_m, half_m])
    track = Track(np.array([0.0, 2.0 * half_m / v]), ends_m, np.zeros(2), ALWAYS)
    times_s = (np.arange(moments) + 0.5) * track.end_s / moments
    rate = exposures(resting, track, lambda away_m: m / away_m**3, times_s)
    exposure = rate.sum(axis=0) * track.end_s / moments

    def of(ranges_m: Floats) -> Floats:
        """Exposure by one pass at a lateral range; beyond the last one it falls with its square."""
        inner = np.interp(np.log(ranges_m), np.log(aside_m), np.log(exposure))
        return np.exp(inner) * np.minimum(1.0, aside_m[-1] / ranges_m) ** 2

    ranges_m = np.linspace(0.5, aside_m[-1] - 0.5, int(aside_m[-1]))
    width_m = 2.0 * (-np.expm1(-of(ranges_m)).sum() + exposure[-1] * aside_m[-1])
    assert width_m == pytest.approx(708.98, abs=0.5)
    for apart_m, known in ((500.0, 0.924457), (1000.0, 0.625769)):
        between_m, sweeps = apart_m * (np.arange(200) + 0.5) / 200, np.arange(-2000, 2000) * apart_m
        passed = of(np.abs(between_m[:, None] - sweeps)).sum(axis=1)
        assert -np.expm1(-passed).mean() == pytest.approx(known, abs=2e-4)


@pytest.mark.parametrize(
    ("rate_per_s", "width_m"),
    [(0.02, 144.497), (0.12, 594.594), (0.23, 807.693), (1.0, 989.631)],
)
def test_sweep_widths_that_are_known(rate_per_s: float, width_m: float) -> None:
    assert sweep_width_m(500.0, rate_per_s, 100.0) == pytest.approx(width_m, abs=5e-4)
    assert rate_of_sweep(width_m, 500.0, 100.0) == pytest.approx(rate_per_s, rel=1e-4)


def test_one_head_on_pass_sees_with_the_probability_given() -> None:
    sensor = Sensor(500.0, rate_per_s=rate_of(0.7, 500.0, 100.0))
    track = Track(np.array([0.0, 100.0]), np.array([-5e3, 5e3]), np.zeros(2), ALWAYS)
    seen = 1.0 - survival(one([0.0], [0.0], [0.0]), [Searched(track, sensor)]).at(HORIZON_S)
    assert seen == pytest.approx(0.7, abs=1e-12)
    assert sensor.detects(100.0) == pytest.approx(0.7, abs=1e-12)
    assert rate_of(1.0, 500.0, 100.0) == rate_of_sweep(1000.0, 500.0, 100.0) == math.inf
    assert Sensor(500.0).detects(100.0) == 1.0
    assert Sensor(500.0).sweep_width_m(100.0) == 1000.0
    with pytest.raises(InputError, match="wider than the sensor sees"):
        rate_of_sweep(1001.0, 500.0, 100.0)
    with pytest.raises(InputError, match="no probability"):
        rate_of(1.1, 500.0, 100.0)


def test_one_meeting_in_closed_form() -> None:
    """A target at 20 m/s and a UAV at 100 m/s towards it: in range from 56.25 s to 68.75 s."""
    target = one([0.0, 1000.0], [0.0, 20e3], [0.0, 0.0])
    track = Track(np.array([0.0, 200.0]), np.array([-5e3, 15e3]), np.zeros(2), ALWAYS)
    found = contacts(target, track, 500.0)
    assert (found.from_s.tolist(), found.to_s.tolist()) == ([56.25], [68.75])
    evaluated = evaluate([track], target, Sensor(500.0, rate_per_s=0.12), Objective(HORIZON_S))
    assert 1.0 - evaluated.detection_probability == pytest.approx(0.22313016, abs=1e-8)
    assert evaluated.expected_detection_time_s == pytest.approx(2278.6853183, abs=1e-7)
    assert evaluated.found_by_probability(60.0) == pytest.approx(1.0 - math.exp(-0.12 * 3.75))
    assert evaluated.seen_at.tolist() == pytest.approx([56.25 + math.log(2.0) / 0.12])
    times_s, found_by = evaluated.curve()
    wanted = [evaluated.found_by_probability(time_s) for time_s in times_s.tolist()]
    assert found_by == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_contacts_begin_with_the_first_detection(seed: int) -> None:
    futures, track = strayed(np.random.default_rng(seed), 40), wandering(seed)
    found, seen_at = contacts(futures, track, 3000.0), first_detection(futures, track, 3000.0)
    some = np.diff(found.first) > 0
    assert some.any()
    np.testing.assert_array_equal(found.from_s[found.first[:-1][some]], seen_at[some])
    assert np.isinf(seen_at[~some]).all()
    assert (found.to_s >= found.from_s).all()
    perfect = survival(futures, [Searched(track, Sensor(3000.0))])
    np.testing.assert_array_equal(perfect.lasts_s(HORIZON_S), np.minimum(seen_at, HORIZON_S))


@pytest.mark.parametrize("seed", range(2))
def test_equal_to_small_steps_of_one_flight_and_of_two(seed: int) -> None:
    futures = strayed(np.random.default_rng(seed), 12)
    flights = [
        Searched(wandering(seed), Sensor(6000.0, rate_per_s=0.01)),
        Searched(wandering(seed + 90), Sensor(4000.0, rate_per_s=0.02)),
    ]
    for some in (flights[:1], flights):
        found = evaluate_all(some, futures, Objective(HORIZON_S))
        assert found.time_s == pytest.approx(by_small_steps(futures, some, 10_000), abs=12.0)


@pytest.mark.parametrize("seed", range(4))
def test_what_a_flight_is_cut_into_changes_nothing(seed: int) -> None:
    futures, whole = strayed(np.random.default_rng(seed), 30), wandering(seed)
    sensor, objective = Sensor(4000.0, rate_per_s=0.008), Objective(HORIZON_S)
    wanted = evaluate([whole], futures, sensor, objective)
    for i in range(1, 11):
        parts = [
            Track(whole.time_s[cut], whole.x_m[cut], whole.y_m[cut], whole.sensor_on)
            for cut in (slice(i + 1), slice(i, None))
        ]
        found = evaluate(parts, futures, sensor, objective)
        assert found.time_s == pytest.approx(wanted.time_s, abs=1e-9)
    # The sum of passes counts, not their order.
    unseen = [survival(futures, [Searched(part, sensor)]).at(HORIZON_S) for part in parts]
    assert unseen[0] * unseen[1] == pytest.approx(wanted.survival.at(HORIZON_S), abs=1e-12)


@pytest.mark.parametrize("by_s", [None, 700.0])
@pytest.mark.parametrize("rates", [(0.01, 0.004), (math.inf, 0.004), (0.01, math.inf)])
def test_what_flights_add_to_each_other_adds_up(
    rates: tuple[float, float], by_s: float | None
) -> None:
    """E(a) less what b gains beside a is E(a and b), whichever of them is perfect."""
    futures = strayed(np.random.default_rng(3), 60)
    objective = Objective(HORIZON_S, by_s)
    a, b = (
        Searched(wandering(seed), Sensor(4000.0, rate_per_s=rate))
        for seed, rate in zip((1, 2), rates, strict=True)
    )
    by = math.inf if by_s is None else by_s
    goal = Goal(HORIZON_S, by, others_of(survival(futures, [a]).columns, HORIZON_S, by))
    first, from_s, to_s = contacts(futures, b.track, 4000.0)
    gained = 0.0
    for k in range(len(futures)):
        miss = float(futures.weight[k])
        for c in range(first[k], first[k + 1]):
            gained += miss * worth_of_contact(k, from_s[c], to_s[c], rates[1], goal)
            exposure = rates[1] * (to_s[c] - from_s[c])
            miss *= 0.0 if rates[1] == math.inf else math.exp(-exposure)
    alone, both = (evaluate_all(some, futures, objective).figure for some in ([a], [a, b]))
    assert gained > 0.0
    assert gained == pytest.approx(both - alone if by_s else alone - both, abs=1e-9 * HORIZON_S)


def test_the_expected_time_falls_with_the_rate() -> None:
    futures, track = strayed(np.random.default_rng(5), 40), wandering(5)
    rates = [1e-3, 1e-2, 0.1, 1.0, 100.0, math.inf]
    expected_s = [
        evaluate([track], futures, Sensor(3000.0, rate_per_s=rate), Objective(HORIZON_S)).figure
        for rate in rates
    ]
    assert expected_s == sorted(expected_s, reverse=True)


def test_random_search_finds_by_its_law() -> None:
    """Straight passes over a square, anywhere: 1 - exp(-W v t / A), W the sweep width."""
    rng, radius_m, speed_mps, passes = np.random.default_rng(1), 50.0, 50.0, 240
    sensor = Sensor(radius_m, rate_per_s=rate_of(0.6, radius_m, speed_mps))
    targets, found = 300, []
    for _ in range(16):
        places = rng.uniform(-0.5 * SIDE_M, 0.5 * SIDE_M, (2, targets))
        first, weight = np.arange(targets + 1), np.full(targets, 1 / targets)
        still = Futures(np.zeros(targets), *places, first, weight, np.zeros(targets, bool))
        # How far each line is from the middle is spread evenly, its direction is any.
        asides_m = SIDE_M * (2.0 * (np.arange(passes) + rng.random(passes)) / passes - 1.0)
        flights = [a_line(float(rng.uniform(0, np.pi)), aside_m, speed_mps) for aside_m in asides_m]
        evaluated = evaluate(flights, still, sensor, Objective(HORIZON_S))
        found.append(evaluated.detection_probability)
    effort = passes * sensor.sweep_width_m(speed_mps) / (2.0 * SIDE_M)
    assert np.mean(found) == pytest.approx(1.0 - math.exp(-effort), rel=0.01)


def a_line(angle: float, aside_m: float, speed_mps: float) -> Track:
    """A long straight flight past the middle of a square."""
    way = np.array([math.cos(angle), math.sin(angle)])
    ends = np.array([[-2.0], [2.0]]) * SIDE_M * way + aside_m * np.array([-way[1], way[0]])
    return Track(np.array([0.0, 4.0 * SIDE_M / speed_mps]), *ends.T, ALWAYS)
