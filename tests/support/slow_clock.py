"""The kinematic clock as a car that looks ahead in small steps of time: slow, and obvious."""

import math

import numpy as np

from planner.belief.particles import Particles
from planner.futures.kinematic import Calibration
from planner.network.road_network import RoadNetwork
from planner.network.signals import STOP, YIELD, Signals

STEP_S = 0.01
SHORT_M = 0.01  # of a stop line, where who stops stands
DRIVER = Calibration()


class Car:
    """One particle: which lines it drives, where it is, and what it decided at signals."""

    def __init__(
        self, network: RoadNetwork, particles: Particles, signals: Signals, k: int
    ) -> None:
        self.signals, self.phase_s = signals, int(particles.phase_s[k])
        self.edges = len(network.edge_ids)
        route, speeds = particles.route(k).tolist(), particles.speeds(k).tolist()
        self.lines, drawn = [route[0]], [speeds[0]]
        for i in range(1, len(route)):
            ways = network.turns(route[i - 1], back=True).tolist()
            self.lines.append(self.edges + network.first_turn[route[i - 1]] + ways.index(route[i]))
            self.lines.append(route[i])
            drawn += [speeds[i - 1], speeds[i]]
        limits = signals.limit_mps[self.lines]
        self.length_m = signals.length_m[self.lines].tolist()
        may = np.minimum(limits, drawn)
        self.even_mps = np.maximum(may - DRIVER.dawdles_mps, 0.75 * may).tolist()
        self.at, self.along_m = 0, min(float(particles.start_m[k]), self.length_m[0])
        self.decided: dict[int, float] = {}  # by line: when its green begins; -inf: drive on
        self.yields: set[int] = set()
        for m, line in enumerate(self.lines[:-1]):
            if line < self.edges and signals.minor[self.lines[m + 1] - self.edges]:
                self.yields.add(m)
        self.speed_mps = self.even_mps[0]
        self.speed_mps = self.allowed(-math.inf, signals_too=False)

    @property
    def arrived(self) -> bool:
        return self.at == len(self.lines)

    def step(self, time_s: float) -> None:
        """Drive on for a step that begins at a time."""
        faster = self.speed_mps + DRIVER.accel * STEP_S
        self.speed_mps = max(min(faster, self.allowed(time_s)), 0.0)
        self.along_m += self.speed_mps * STEP_S
        while not self.arrived and self.along_m >= self.length_m[self.at]:
            self.along_m -= self.length_m[self.at]
            self.at += 1

    def allowed(self, time_s: float, *, signals_too: bool = True) -> float:
        """Return the speed from which all that lies ahead can be braked for."""
        most, ahead_m = self.even_mps[self.at], -self.along_m
        for m in range(self.at, len(self.lines) - 1):
            ahead_m += self.length_m[m]
            end_mps = min(self.even_mps[m], self.even_mps[m + 1])
            if m in self.yields:
                end_mps = min(end_mps, DRIVER.yields_mps)
            if signals_too and self.has_signal(m):
                self.decide(m, time_s, ahead_m)
                if time_s < self.decided.get(m, -math.inf):
                    end_mps = 0.0
                    most = min(most, 0.5 * max(ahead_m - SHORT_M, 0.0) / STEP_S)
            most = min(most, math.sqrt(end_mps**2 + 2 * DRIVER.decel * max(ahead_m, 0.0)))
            if 2 * DRIVER.decel * ahead_m > self.even_mps[self.at] ** 2:
                break
        return most

    def has_signal(self, m: int) -> bool:
        return self.lines[m] < self.edges and len(self.seconds(m)) > 0

    def seconds(self, m: int) -> np.ndarray:
        turn = self.lines[m + 1] - self.edges
        first, last = self.signals.first_second[turn : turn + 2]
        return np.roll(self.signals.shows[first:last], self.signals.offset_s[turn])

    def decide(self, m: int, time_s: float, ahead_m: float) -> None:
        """Decide once whether to stop: where the car would have to brake for it."""
        if m in self.decided or self.speed_mps**2 < 2 * DRIVER.decel * ahead_m:
            return
        shows = self.seconds(m)
        sample = math.floor(time_s + DRIVER.late_s) + 1
        wait_s = 0
        while shows[(sample + self.phase_s + wait_s) % len(shows)] == STOP:
            wait_s += 1
        if shows[(sample + self.phase_s + wait_s) % len(shows)] == YIELD:
            self.yields.add(m)
        # The car is moved by the sample's second in the second before the sample.
        self.decided[m] = sample - 1 + wait_s - DRIVER.early_s if wait_s else -math.inf

    def xy(self) -> tuple[float, float]:
        line = self.lines[min(self.at, len(self.lines) - 1)]
        points = slice(*self.signals.first_point[line : line + 2])
        xy_m = self.signals.xy_m[points]
        steps = np.hypot(*np.diff(xy_m, axis=0).T)
        drawn_m = np.concatenate(([0.0], np.cumsum(steps)))
        share = 1.0 if self.arrived else self.along_m / max(self.signals.length_m[line], 1e-9)
        x, y = (np.interp(share * drawn_m[-1], drawn_m, column) for column in xy_m.T)
        return float(x), float(y)


def slow_clock(
    network: RoadNetwork, particles: Particles, signals: Signals, k: int, *, seconds: int
) -> np.ndarray:
    """Return where one particle is at each second until it arrives, (s, 2) metres."""
    car = Car(network, particles, signals, k)
    places = [car.xy()]
    per_s = round(1 / STEP_S)
    for second in range(seconds):
        for step in range(per_s):
            if not car.arrived:
                car.step(second + step * STEP_S)
        if car.arrived:
            break
        places.append(car.xy())
    return np.array(places)
