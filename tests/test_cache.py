"""The cache: damage is mended, what others could write is refused, and it has a size."""

import fcntl
import logging
import os
import subprocess
import sys
from pathlib import Path

import pytest

from planner import cache
from planner.cache import cache_folder, clear, is_whole, limit_bytes, seal, sizes
from planner.errors import InputError, OutputError
from planner.mission.opening import open_scenario
from planner.mission.recorder import Recorder


@pytest.fixture
def own(empty_cache: Path) -> Path:
    empty_cache.mkdir(mode=0o700)
    return empty_cache


def entry(name: str, megabytes: float, age_s: float) -> Path:
    """A sealed entry of the nets, last used some time ago."""
    path = cache_folder("nets", name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"x" * int(megabytes * 1e6))
    seal(path)
    record = cache_folder(cache.DIGESTS, "nets", name)
    os.utime(record, (record.stat().st_atime, record.stat().st_mtime - age_s))
    return path


def test_a_flipped_bit_is_seen(own: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = entry("one", 0.01, 0.0)
    assert is_whole(path)
    path.write_bytes(b"y" + path.read_bytes()[1:])
    with caplog.at_level(logging.WARNING):
        assert not is_whole(path)
    assert "made anew" in caplog.text
    assert not is_whole(own / "nets" / "none")


def test_a_damaged_recording_is_made_anew(own: Path) -> None:
    opened = open_scenario("figure1", overrides=["search.particles=5", "search.sampling=iid"])
    first = Recorder(opened, 1).planning()
    content = first.path.read_bytes()
    for damage in (b"", content[: len(content) // 2], b"\0" + content[1:]):
        first.path.write_bytes(damage)
        again = Recorder(opened, 1).planning()
        assert again.path.read_bytes() == content


def test_a_cut_net_is_built_anew(own: Path) -> None:
    first = open_scenario("figure1").network.path
    content = first.read_bytes()
    first.write_bytes(content[:500])
    assert open_scenario("figure1").network.path.read_bytes() == content


@pytest.mark.slow
def test_damaged_compiled_code_is_compiled_anew(own: Path) -> None:
    code = "from planner.cli.doctor import _see_a_target_at_rest as see; print(see())"

    def answer() -> str:
        command = [sys.executable, "-c", code]
        environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
        return done.stdout

    first = answer()
    files = sorted(own.rglob("*.nb?"))
    assert files
    for damage in (lambda whole: whole[:0], lambda whole: whole[:-40], lambda whole: whole + b"x"):
        for file in files:
            file.write_bytes(damage(file.read_bytes()))
        assert answer() == first == "9.0\n"


def test_what_others_can_write_is_refused(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own.chmod(0o777)
    cache._refuse_foreign.cache_clear()
    with pytest.raises(OutputError, match=r"can be written by others.*PLANNER_CACHE_SHARED"):
        cache_folder("nets")
    monkeypatch.setenv("PLANNER_CACHE_SHARED", "1")
    assert cache_folder("nets") == own / "nets"


def test_a_new_cache_is_ones_own(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PLANNER_CACHE", str(own / "new"))
    cache_folder()
    assert (own / "new").stat().st_mode & 0o777 == 0o700


def test_the_least_recently_used_goes_first(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PLANNER_CACHE_GB", "0.003")
    old, new = entry("old", 1.0, 5000.0), entry("new", 1.0, 100.0)
    last = entry("last", 1.5, 0.0)
    assert (old.exists(), new.exists(), last.exists()) == (False, True, True)
    assert 2.4e6 < sum(sizes().values()) < 3e6


def test_all_of_a_cache_is_looked_at_once_until_it_is_full(
    own: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks: list[dict[str, int]] = []

    def look() -> dict[str, int]:
        looks.append(sizes())
        return looks[-1]

    monkeypatch.setattr(cache, "sizes", look)
    for number in range(3):
        entry(f"{number}", 1.0, 1000.0)
    assert len(looks) == 1
    monkeypatch.setenv("PLANNER_CACHE_GB", "0.003")
    entry("4", 1.0, 0.0)
    assert len(looks) == 2
    assert sum(sizes().values()) < 3.1e6


def test_nothing_goes_that_a_running_command_may_use(own: Path) -> None:
    path = entry("held", 1.0, 0.0)
    running = cache_folder(cache.RUNNING, "other")
    running.parent.mkdir(exist_ok=True)
    with running.open("w") as file:
        os.utime(running, (0, path.stat().st_mtime - 1000.0))
        fcntl.flock(file, fcntl.LOCK_EX)
        assert clear() == 0
        assert path.exists()
    assert clear() == pytest.approx(1e6)
    assert not path.exists()
    assert not running.exists()


def test_a_command_that_has_ended_leaves_no_note(own: Path) -> None:
    code = "from planner.cache import cache_folder, note_running as note; note(); note(); "
    code += "print(len(list(cache_folder('running').glob('*'))))"
    told = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert told.stdout.strip() == "1"
    assert list(cache_folder(cache.RUNNING).glob("*")) == []


def test_the_limit_is_a_number(monkeypatch: pytest.MonkeyPatch) -> None:
    assert limit_bytes() == 5e9
    for said in ("much", "-1", "nan"):
        monkeypatch.setenv("PLANNER_CACHE_GB", said)
        with pytest.raises(InputError, match="PLANNER_CACHE_GB"):
            limit_bytes()
