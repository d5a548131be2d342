"""Drives particles through SUMO and records their futures."""

import logging
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from planner.arrays import Offsets
from planner.belief.particles import Particles
from planner.belief.sampling import LARGEST_SEED
from planner.checked import number, whole
from planner.errors import InputError
from planner.futures.among_traffic import RIDERS, ridings
from planner.futures.answers import Batch, collected
from planner.futures.forks import CAN_FORK
from planner.futures.futures import Futures
from planner.futures.kept import Kept, recorded_of
from planner.futures.knots import TOLERANCE_M
from planner.futures.riders import Ridden, TrafficSession, drive
from planner.futures.rides import Ride, Session
from planner.futures.simulation import Run
from planner.futures.traffic import Traffic
from planner.futures.vehicles import vehicles_of
from planner.futures.warm_up import Warm, breakdown
from planner.futures.workers import HERE, Backend
from planner.network.road_network import RoadNetwork
from planner.progress import Progress
from planner.streams import stream

log = logging.getLogger(__name__)

# Constants of the recording, never derived from the number of workers: the same particles give
# the same bytes on any machine.
SHARED = 100  # particles in one run, where they can be kept from noticing each other
SESSION = 100  # particles that share a session's seed, where each rides alone
STRAIGHT_STEP_S = 10.0  # knots at the ends of straight roads come from distance and speed
STEP_S = 1.0
LEAST_RIDES = 10  # for which it is worth to load a session
FIRST_NOTED = 250  # particles that a note is made on first; each later one takes twice as many
STANDS_M, STANDS_S = 1.0, 300.0  # who moves less in a time longer than signals are red
TOWN_TOLERANCE_M = 5.0  # how far futures in towns may be from what SUMO recorded

Note = Callable[[Futures], str]


class Way(NamedTuple):
    """How particles are driven."""

    together: bool  # many in one run; otherwise each in a fork of a loaded session
    why: str


def way_of(network: RoadNetwork, particles: Particles) -> Way:
    """Return how particles are driven: the faster way where it is exact."""
    if particles.driving == "traffic":
        copy = "fork" if CAN_FORK else "fresh load"
        return Way(False, f"in the traffic, {RIDERS} in each {copy} of it")
    alone = "one fork of a loaded session each" if CAN_FORK else "one SUMO each, loaded anew"
    if particles.driving != "constant":
        return Way(False, f"{alone}, as SUMO's driver heeds signals")
    if not np.all(network.edge_lanes[particles.route_edge] == 1):
        return Way(False, f"{alone}, as roads have several lanes")
    return Way(True, "in shared runs, as constant speeds on single lanes are exact there")


class How(NamedTuple):
    """How particles are recorded; the result depends on the tolerance and the traffic only."""

    tolerance_m: float | None = None  # how far a future may be from a sample; None: by the net
    workers: int | None = None  # processes; None: as many as the backend has
    progress: Progress | None = None  # called with the particles recorded so far and their number
    # Called with the first particles as soon as some ride alone, as futures that stand for all;
    # what it returns goes with the progress from then on.
    note: Note | None = None
    backend: Backend = HERE  # whose processes drive them
    traffic: Traffic | None = None  # in which they drive, if they do


NO_MATTER = How()


def record(
    network: RoadNetwork,
    particles: Particles,
    *,
    horizon_s: float,
    tolerance_m: float | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Futures:
    """Return the futures of particles, as SUMO drives them up to the horizon.

    Parameters
    ----------
    horizon_s
        Seconds on the target's clock up to which motion is recorded.
    tolerance_m
        How far futures may be from what SUMO recorded, metres; None: as `tolerance_of` has it.
    workers
        Processes; one per core if not given. They change nothing in the result.
    progress
        Called with the particles recorded so far and their number.

    Raises
    ------
    InputError
        If they drive in traffic, which only a `planner.mission.recorder.Recorder` knows.
    SumoError
        With SUMO's own message, or if a process that runs it dies.
    """
    if len(particles) == 0:
        raise InputError("particles: there is none to record; draw at least one")
    horizon_s = number("horizon_s", horizon_s, above=0.0)
    workers = None if workers is None else whole("workers", workers, least=1)
    how = How(tolerance_m, workers, progress)
    return record_into(Kept(len(particles)), network, particles, horizon_s, how)


class Wanted(NamedTuple):
    """Particles to be recorded, of which some may be already."""

    kept: Kept
    particles: Particles
    horizon_s: float


def record_into(
    kept: Kept, network: RoadNetwork, particles: Particles, horizon_s: float, how: How
) -> Futures:
    """Return the futures of particles, of which some may be recorded already; keep the others."""
    (futures,) = record_in_turn([Wanted(kept, particles, horizon_s)], network, how)
    return futures


def record_in_turn(wanted: Sequence[Wanted], network: RoadNetwork, how: How) -> Iterator[Futures]:
    """Yield the futures of several sets of particles in their order, each once it is complete.

    Meanwhile processes go on with those that follow: none waits for the last ride of a set, and
    nothing is yielded before they have begun. What they drive until the next set is asked for is
    kept then, and lost if the program is stopped before.
    """
    sessions = sum(len(np.unique(one.kept.missing // SESSION)) for one in wanted)
    sets = [_Underway(one, network, how, sessions) for one in wanted]
    asked = [(one, batch) for one in sets for batch in one.batches]
    following = deque(sets)
    for task, answer in _answers([batch.task for _, batch in asked], sets, network, how):
        one, batch = asked[task]
        one.take(task, batch, answer)
        if how.progress is not None:
            how.progress(*recorded_of([each.kept for each in sets]), one.said)
        while len(following) > 1 and following[0].is_complete:
            yield following.popleft().futures()
    for one in following:
        yield one.futures()


def _answers(
    tasks: Sequence[Run | Session | TrafficSession],
    sets: Sequence["_Underway"],
    network: RoadNetwork,
    how: How,
) -> Iterator[tuple[int, Any]]:
    """Yield what comes of each task, after its number."""
    if not tasks:
        return
    if not CAN_FORK and not all(one.way.together for one in sets):
        log.warning(
            "this system cannot fork: SUMO is loaded anew for each ride, to the same effect, but "
            "ten times as slow in towns"
        )
    files = {network.path.absolute(): network.sha256}
    if how.traffic is not None and any(isinstance(task, TrafficSession) for task in tasks):
        files |= dict(how.traffic.files)
    workers = how.backend.size(how.workers)
    yield from how.backend.answers(drive, tasks, workers=workers, files=files)


class _Underway:
    """Particles of one use, on their way to become futures."""

    def __init__(self, wanted: Wanted, network: RoadNetwork, how: How, sessions: int) -> None:
        self.kept, self._particles, _ = wanted
        self._network, self._how = network, how
        self.way = way_of(network, self._particles)
        self.said, self._due = "", FIRST_NOTED
        self._warm: dict[int, Warm] = {}
        self.batches: list[Batch] = []
        if not self.is_complete:  # stopped after the last particle, before the files were there
            log.info("%d particles are driven %s", len(self.kept.missing), self.way.why)
            self.batches = [*_batches(wanted, network, how, sessions)]

    @property
    def is_complete(self) -> bool:
        """Whether all particles are recorded."""
        return len(self.kept.missing) == 0

    def take(self, task: int, batch: Batch, answer: bytes | list[Ride] | Ridden) -> None:
        """Keep what has come of a part of them."""
        if isinstance(answer, Ridden) and answer.warm is not None:
            self._warm[task] = answer.warm
        tolerance_m = tolerance_of(self._network, self._how.tolerance_m)
        self.kept.keep(*collected(self._network, self._particles, batch, answer, tolerance_m))
        note, ready = self._how.note, self.kept.ready
        if note is not None and not self.way.together and self._due <= ready < self.kept.count:
            self.said, self._due = note(_weighted(self.kept, self._particles, ready)), 2 * ready

    def futures(self) -> Futures:
        """Return what became of them; what is odd about those driven now is said in the log."""
        futures = _weighted(self.kept, self._particles, self.kept.count)
        traffic = self._how.traffic
        if self.batches and self._particles.driving == "traffic" and traffic is not None:
            _tell_fates(futures, breakdown([*self._warm.values()], traffic))
        elif self.batches and not self.way.together:
            drives = self._particles.stop_s > self._particles.depart_s + STANDS_S
            _tell_standing(futures.take(drives), self._network)
        return futures


def _tell_fates(futures: Futures, broken: str | None) -> None:
    """Say in the log what became of particles in traffic, and whether that flows."""
    fates = futures.fates
    said = () if fates is None else (str(fates), fates.told_share())
    for line in filter(None, (broken, *said)):
        log.warning(line)


def _tell_standing(futures: Futures, network: RoadNetwork) -> None:
    """Say in the log how many particles stood all the time: mostly a signal lets nobody pass."""
    if len(futures) == 0:
        return
    first = futures.first_knot[:-1]
    away_m = np.hypot(
        futures.x_m - futures.x_m[first][futures.particle],
        futures.y_m - futures.y_m[first][futures.particle],
    )
    farthest_m = np.maximum.reduceat(away_m, first)
    stands = (farthest_m < STANDS_M) & (futures.end_s - futures.time_s[first] >= STANDS_S)
    if stands.any():
        log.warning(
            "%d of %d particles stand where they start for all of the time; do the signals of %s "
            "ever let them pass?",
            stands.sum(),
            len(stands),
            network.given_as,
        )


def _weighted(kept: Kept, particles: Particles, count: int) -> Futures:
    """Return the futures of the first so many particles, which stand for all."""
    futures = kept.first(count)
    return replace(
        futures,
        weight=particles.weight[:count] * (kept.count / count),
        gone=particles.take(np.arange(count)).gone_after(futures.end_s),
        target=particles.target[:count],
    )


def tolerance_of(network: RoadNetwork, tolerance_m: float | None) -> float:
    """Return how far futures may be from what SUMO recorded, metres, where it may not be given.

    Raises
    ------
    InputError
        If the one given is not above 0.
    """
    if tolerance_m is not None:
        return number("tolerance_m", tolerance_m, above=0.0)
    return TOLERANCE_M if network.is_abstract else TOWN_TOLERANCE_M


def _batches(wanted: Wanted, network: RoadNetwork, how: How, sessions: int) -> Iterator[Batch]:
    """Yield what there is to do.

    Parameters
    ----------
    sessions
        How many there are in all, in other sets too.
    """
    particles, horizon_s, missing = wanted.particles, wanted.horizon_s, wanted.kept.missing
    together, workers = way_of(network, particles).together, how.backend.size(how.workers)
    if particles.driving == "traffic":
        if how.traffic is None:
            raise InputError('driving: is "traffic"; have a Recorder of the scenario record them')
        copies = ridings(network, particles, missing, how.traffic, horizon_s, workers)
        yield from (Batch(*riding) for riding in copies)
        return
    size = SHARED if together else SESSION
    number, first = np.unique(missing // size, return_index=True)
    for session, some in zip(number.tolist(), np.split(missing, first[1:]), strict=True):
        if together:
            # In a shared run all take part, or none: they share SUMO's random numbers.
            whole_run = np.arange(session * size, min((session + 1) * size, len(particles)))
            yield Batch((whole_run,), _run(network, particles, whole_run, horizon_s))
            continue
        seed = session_seed(particles, session)
        by_phase = some[np.argsort(particles.phase_s[some], kind="stable")]
        for part in np.array_split(by_phase, _shares(len(some), sessions, workers)):
            yield Batch((part,), session_of(network, particles, part, seed, horizon_s))


def session_seed(particles: Particles, session: int) -> int:
    """Return SUMO's seed for a session, of which there is one per `SESSION` particles."""
    rng = stream(int(particles.seed[0]), "session", session)
    return int(rng.integers(1, LARGEST_SEED, endpoint=True))


def _shares(rides: int, sessions: int, workers: int) -> int:
    """Return into how many tasks a session is parted, each of which loads it: none waits idly."""
    return max(1, min(-(-workers // sessions), rides // LEAST_RIDES))


def _run(network: RoadNetwork, particles: Particles, batch: Offsets, horizon_s: float) -> Run:
    return Run(
        net=network.path.absolute(),
        given_as=network.given_as,
        # At the start of the run, all of them: who sets out later drives alike, only later.
        vehicles=tuple(
            replace(vehicle, depart_s=0.0) for vehicle in vehicles_of(network, particles, batch)
        ),
        seed=int(particles.seed[batch[0]]),
        step_s=STRAIGHT_STEP_S if network.is_abstract else STEP_S,
        end_s=horizon_s,
    )


def session_of(
    network: RoadNetwork, particles: Particles, batch: Offsets, seed: int, horizon_s: float
) -> Session:
    """Return the session in which each of some particles rides alone."""
    return Session(
        net=network.path.absolute(),
        given_as=network.given_as,
        vehicles=vehicles_of(network, particles, batch),
        phases_s=tuple(particles.phase_s[batch].tolist()),
        free=particles.driving == "free",
        seed=seed,
        step_s=STEP_S,
        end_s=horizon_s,
    )
