"""Recordings that are interrupted go on from what is kept, to the same bytes."""

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.belief.particles import Particles
from planner.belief.recipe import Given
from planner.futures import record as recording
from planner.futures import store
from planner.futures.futures import Futures
from planner.futures.kept import Kept
from planner.futures.record import How, Wanted, record, record_in_turn, record_into
from planner.futures.store import FILES, recorded
from planner.futures.workers import Here
from support.command_line import TOWN
from support.sumo_instances import town, walkers

HORIZON_S = 200.0


def particles_of(count: int) -> Particles:
    some = walkers(town(), count, np.random.default_rng(3), start="nw-n", roads=12)
    return replace(some, driving="free", phase_s=(7 + 13 * np.arange(count)) % 90)


def same(one: Futures, other: Futures) -> bool:
    columns = [(getattr(f, c)) for c in ("time_s", "x_m", "y_m", "weight") for f in (one, other)]
    edges = [getattr(f.edges, c) for c in ("first_change", "time_s", "edge") for f in (one, other)]
    pairs = zip((columns + edges)[::2], (columns + edges)[1::2], strict=True)
    return all(a.tobytes() == b.tobytes() for a, b in pairs)


@pytest.fixture
def small_sessions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording, "SESSION", 10)


@pytest.mark.usefixtures("small_sessions")
def test_what_is_kept_is_not_driven_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    particles = particles_of(40)
    whole = record(town(), particles, horizon_s=HORIZON_S, workers=1)

    class Stopped(Exception):
        pass

    def stop(done: int, _total: int, _note: str = "", /) -> None:
        if done >= 20:
            raise Stopped

    with pytest.raises(Stopped):
        record_into(Kept(40, tmp_path), town(), particles, HORIZON_S, How(workers=1, progress=stop))
    (tmp_path / "9999.npz").write_bytes(b"not one of ours")
    found = Kept(40, tmp_path)
    assert found.ready == 20
    assert not (tmp_path / "9999.npz").exists()
    tasks: list[int] = []

    class Counting(Here):
        def answers(self, function: Any, tasks_given: Any, **more: Any) -> Any:
            tasks.append(len(tasks_given))
            return super().answers(function, tasks_given, **more)

    how = How(workers=1, backend=Counting())
    assert same(record_into(found, town(), particles, HORIZON_S, how), whole)
    assert tasks == [2]


def test_nothing_is_left_to_drive(tmp_path: Path) -> None:
    """As after a kill between the last particle and the files of the recording."""
    particles = particles_of(6)
    whole = record_into(Kept(6, tmp_path), town(), particles, HORIZON_S, How(workers=1))
    again = record_into(Kept(6, tmp_path), town(), particles, HORIZON_S, How(workers=1))
    assert same(again, whole)


@pytest.mark.usefixtures("small_sessions")
def test_parts_of_a_session_count_with_any_number_of_workers(tmp_path: Path) -> None:
    particles = particles_of(40)
    whole = record(town(), particles, horizon_s=HORIZON_S, workers=3)
    some = Kept(40, tmp_path)
    record_into(some, town(), particles, HORIZON_S, How(workers=3))
    kept = sorted(tmp_path.iterdir())
    kept[1].unlink()
    assert len(Kept(40, tmp_path).missing) > 0
    again = record_into(Kept(40, tmp_path), town(), particles, HORIZON_S, How(workers=1))
    assert same(again, whole)


@pytest.mark.usefixtures("small_sessions")
@pytest.mark.parametrize("workers", [1, 2])
def test_several_sets_are_driven_as_one_and_come_in_their_order(workers: int) -> None:
    all_of_them = particles_of(40)
    several = [all_of_them.take(some) for some in np.split(np.arange(40), [14, 18])]
    wanted = [Wanted(Kept(len(one)), one, HORIZON_S) for one in several]
    said: list[tuple[int, int]] = []
    asked: list[int] = []

    class Counting(Here):
        def answers(self, function: Any, tasks: Any, **more: Any) -> Any:
            asked.append(len(tasks))
            return super().answers(function, tasks, **more)

    def progress(done: int, total: int, _note: str = "", /) -> None:
        said.append((done, total))

    how = How(workers=workers, progress=progress, backend=Counting())
    made = record_in_turn(wanted, town(), how)
    first = next(made)
    assert said[-1][0] < 40  # it is there before the others are
    for one, together in zip(several, [first, *made], strict=True):
        alone = record(town(), one, horizon_s=HORIZON_S, workers=1)
        assert same(alone, together)
        np.testing.assert_array_equal(alone.gone, together.gone)
    assert asked == [6]  # each session is loaded once: 10 + 4, 4 and 10 + 10 + 2
    assert said[-1] == (40, 40)


def test_a_killed_command_goes_on(tmp_path: Path) -> None:
    here = {"PLANNER_CACHE": str(tmp_path / "cache")}
    many = ("--set", "target.driving=free", "--set", "search.particles=600", "-j", "2")
    command = [sys.executable, "-m", "planner", "futures", TOWN, *many]
    running = subprocess.Popen(
        command,
        env={**os.environ, **here},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    unfinished = tmp_path / "cache" / "unfinished"
    give_up = time.monotonic() + 60
    while len(list(unfinished.rglob("[0-9]*.npz"))) < 2 and time.monotonic() < give_up:
        time.sleep(0.02)
    os.killpg(running.pid, signal.SIGKILL)
    running.wait()
    kept = list(unfinished.rglob("[0-9]*.npz"))
    assert 2 <= len(kept) < 6
    out = [*command, "-o", str(tmp_path / "again"), "-v"]
    done = subprocess.run(out, env={**os.environ, **here}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (told,) = [int(line.split()[1]) for line in done.stderr.splitlines() if "are driven" in line]
    assert told == 600 - 100 * len(kept)
    assert list(unfinished.iterdir()) == []
    whole = [*command, "-o", str(tmp_path / "whole")]
    fresh = {"PLANNER_CACHE": str(tmp_path / "other")}
    subprocess.run(whole, env={**os.environ, **fresh}, check=True, stdout=subprocess.DEVNULL)
    for name in FILES:
        first, second = (tmp_path / folder / name for folder in ("again", "whole"))
        assert first.read_bytes() == second.read_bytes(), name


@pytest.mark.usefixtures("small_sessions")
def test_two_at_once_record_once(empty_cache: Path) -> None:
    """The second one waits, and takes what the first one has recorded."""
    recipe = Given(particles_of(20), HORIZON_S)
    code = (
        "import sys, pickle; from planner.futures.store import recorded;"
        "network, recipe = pickle.load(sys.stdin.buffer);"
        "print(recorded(network, recipe, scenario={}).path.stat().st_ino)"
    )
    network = town()
    both = [
        subprocess.Popen(
            [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        for _ in range(2)
    ]
    for process in both:
        assert process.stdin is not None
        pickle.dump((network, recipe), process.stdin)
        process.stdin.close()
    said = {process.stdout.read() for process in both if process.stdout is not None}
    assert [process.wait() for process in both] == [0, 0]
    assert len(said) == 1
    assert said == {f"{recorded(network, recipe, scenario={}).path.stat().st_ino}\n".encode()}
    assert list((empty_cache / "unfinished").iterdir()) == []


@pytest.mark.usefixtures("small_sessions", "empty_cache")
def test_a_full_disk_in_the_middle_then_room(monkeypatch: pytest.MonkeyPatch) -> None:
    particles = particles_of(40)
    recipe = Given(particles, HORIZON_S)
    written = []
    keep = Kept.keep

    def full(self: Kept, some: np.ndarray, part: Futures) -> None:
        if len(written) == 2:
            raise OSError(28, "No space left on device", "somewhere")
        written.append(len(some))
        keep(self, some, part)

    monkeypatch.setattr(Kept, "keep", full)
    with pytest.raises(OSError, match="No space left"):
        recorded(town(), recipe, scenario={}, how=How(workers=1))
    monkeypatch.setattr(Kept, "keep", keep)
    left: list[int] = []
    in_turn = store.record_in_turn

    def counted(wanted: Sequence[Wanted], *given: object) -> Iterator[Futures]:
        left.extend(len(one.kept.missing) for one in wanted)
        return in_turn(wanted, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(store, "record_in_turn", counted)
    made = recorded(town(), recipe, scenario={}, how=How(workers=1))
    assert left == [20]
    assert same(made.futures, record(town(), particles, horizon_s=HORIZON_S, workers=1))
