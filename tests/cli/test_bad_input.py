"""Bad input and interruptions: one clear line, exit code 2 (130), nothing half-written."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pyarrow
import pyarrow.parquet
import pytest

from planner.cli import main
from support.command_line import TOWN, Commands, Said, in_a_process

ROOT = Path(__file__).parents[2]
QUICK = ("--method", "wait", "--targets", "20")


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(capsys)


@pytest.fixture
def refused(run: Commands, tmp_path: Path) -> Callable[..., str]:
    """Runs a command that must be refused, and gives the one line that it says."""

    def line(*arguments: object) -> str:
        before = sorted(tmp_path.rglob("*"))
        said = run(*arguments)
        assert sorted(tmp_path.rglob("*")) == before
        return one_line(said)

    return line


def one_line(said: Said) -> str:
    assert said.code == 2
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert said.err.startswith("planner: ")
    return said.err


@pytest.fixture(scope="module")
def a_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "figure3"
    assert main(["plan", "figure3", *QUICK, "-o", str(folder), "--json"]) == 0
    return folder


@pytest.fixture
def copied_run(a_run: Path, tmp_path: Path) -> Path:
    return shutil.copytree(a_run, tmp_path / "run")


@pytest.fixture(scope="module")
def a_net(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("net") / "figure3.net.xml"
    assert main(["build", "figure3", "-o", str(path), "--json"]) == 0
    return path.read_text()


@pytest.mark.parametrize(
    ("setting", "word"),
    [
        ("sensor.radius_m=0", "greater than 0"),
        ("sensor.radius_m=-5", "greater than 0"),
        ("sensor.radius_m=nan", "finite"),
        ("sensor.radius_m=inf", "finite"),
        ("sensor.radius_m=wide", "number"),
        ("uav.speed_mps=0", "greater than 0"),
        ("uav.speed_mps=nan", "finite"),
        ("target.speed_mps={ constant = 0 }", "above 0"),
        ("target.speed_mps={ list = [5, -5] }", "above 0"),
        ("target.speed_mps={ list = [5, nan] }", "finite"),
        ("target.speed_mps={ constant = 1e300 }", "up to 1000"),
        ("search.depth=0", "at least 1"),
        ("search.particles=0", "at least 1"),
        ("search.particles=1.5", "whole number"),
        ("search.horizon_s=0:00:00", "greater than 0"),
        ("search.horizon_s=1e300", "at most"),
        ("uav.take_off_s=2:00:00", "not after take-off"),
        ("target.last_seen_ago_s=3600", "not after take-off"),
        ('target.start=["CE"]', "no way on"),
        ('target.start=["XY"]', "not an edge"),
        ("target.start=[]", "empty"),
        ("uav.start={ node = 'X' }", "not a node"),
        ("greedy.tick_s=-1", "at least 0"),
        ("nonsense.key=1", "not a known section"),
        ("search.nonsense=1", "not a known key"),
        ("search", "not an override"),
        ("", "not an override"),
    ],
)
def test_settings(refused: Callable[..., str], setting: str, word: str, tmp_path: Path) -> None:
    line = refused("plan", "figure3", *QUICK, "--set", setting, "-o", tmp_path / "deep" / "run")
    assert word in line
    assert setting.partition("=")[0] in line or "search.horizon_s" in line or "network" in line


def test_all_faults_at_once(run: Commands) -> None:
    faults = ("--set", "search.depth=0", "--set", "sensor.radius_m=nan")
    said = run("plan", "figure3", *QUICK, *faults)
    assert said.code == 2
    assert len(said.err.splitlines()) == 2
    assert all(line.startswith("planner: ") for line in said.err.splitlines())


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ((), "COMMAND"),
        (("plan",), "SCENARIO"),
        (("nosuch",), "invalid choice"),
        (("plan", "nosuch"), "neither a file"),
        (("plan", ""), "scenario.toml"),
        (("plan", "nosuch.toml"), "no such file"),
        (("plan", "/dev/null"), "neither a file"),
        (("plan", "grid5"), "did you mean grid5x5"),
        (("plan", "figure3", "--method", "nosuch"), "greedy, "),
        (("plan", "figure3", "--preset", "nosuch"), "presets.nosuch"),
        (("plan", "grid5x5", "--preset", "papr"), "did you mean paper"),
        (("plan", "figure3", "--targets", "0"), "whole number from 1"),
        (("plan", "figure3", "--targets", "1e3"), "whole number from 1"),
        (("plan", "figure3", "-j", "0"), "whole number from 1"),
        (("plan", "figure3", "-s", "-1"), "whole number from 0"),
        (("plan", "figure3", "-s", "one"), "whole number from 0"),
        (("plan", "figure3", "-o", ""), "empty"),
        (("plan", "figure3", "--tick", "1:70"), "H:M:S"),
        (("plan", "figure3", "--tick", "nan"), "H:M:S"),
        (("plan", "figure3", "-n", "nosuch.net.xml"), "no file"),
        (("plan", "figure3", "--futures", "nosuch.parquet"), "no such file"),
        (("plan", "figure3", "--futures", "/dev/null"), "no such file"),
        (("where", "figure3"), "--at"),
        (("where", "figure3", "--at", "soon"), "H:M:S"),
        (("where", "figure3", "--at", "-1"), "from 0 to 3600"),
        (("where", "figure3", "--at", "1e999"), "from 0 to 3600"),
        (("where", "figure3", "--at", "1:00:01"), "from 0 to 3600"),
        (("build", "figure3", "-o", "/dev/null", "--force"), "cannot be replaced"),
        (("build", "figure3", "-o", "/dev/null"), "--force to replace it"),
        (("plan", "figure3", "--time-limit", "-3"), "H:M:S, from 0 on"),
        (("compare", "figure3", "-o", "/dev/null", "--force"), "cannot be replaced"),
        (("fly", "nosuch"), "holds no run"),
        (("fly", TOWN), "holds no run"),
        (("fly", __file__), "holds no run"),
        (("plan", "grid5x5", "--set", "search.particles=999999999999"), "out of memory"),
        (("plan", "figure3", "--free", "--method", "greedy"), "--free"),
        (("plan", "figure3", "--no-free", "--method", "greedy"), "--no-free"),
    ],
)
def test_arguments(refused: Callable[..., str], arguments: tuple[str, ...], word: str) -> None:
    assert word in refused(*arguments).replace("is not a file that can", "cannot")


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ((".+", "hello"), "not a readable SUMO network"),
        ((".+", ""), "not a readable SUMO network"),
        ((".+", "<routes/>"), "no edge for passenger cars"),
        (("</net>.*", ""), "not a readable SUMO network"),
        (("<lane ", "<lone "), "not a readable SUMO network"),
        (('fromLane="0"', 'fromLane="7"'), "not a readable SUMO network"),
        (('length="[0-9.]*"', 'length="0"'), "length"),
        (('length="[0-9.]*"', 'length="long"'), "not a readable SUMO network"),
        (('to="B"', 'to="nosuch"'), "nosuch"),
        (('type="unregulated"', 'type="odd"'), "SUMO failed: Attribute 'type'"),
    ],
)
def test_broken_nets(
    run: Commands, tmp_path: Path, a_net: str, change: tuple[str, str], word: str
) -> None:
    net = tmp_path / "broken.net.xml"
    net.write_text(re.sub(*change, a_net, flags=re.DOTALL))
    line = one_line(run("plan", "figure3", *QUICK, "-n", net, "-o", tmp_path / "run"))
    assert word in line
    assert "Process Error" not in line
    assert not (tmp_path / "run").exists()


def test_broken_sources(run: Commands, tmp_path: Path) -> None:
    scenario = shutil.copytree(ROOT / "sumo_nets" / "figure3", tmp_path / "own")
    edges = scenario / "figure3.edg.xml"
    edges.write_text(edges.read_text().replace('to="B"', 'to="nosuch"'))
    assert "nosuch" in one_line(run("plan", scenario, *QUICK))
    edges.write_text("<edges>")
    assert "netconvert refuses it" in one_line(run("plan", scenario, *QUICK))
    edges.unlink()
    assert "no file" in one_line(run("plan", scenario, *QUICK))
    comma = shutil.copytree(ROOT / "sumo_nets" / "figure3", tmp_path / "a,b")
    (comma / "figure3.edg.xml").write_text("<edges></edges>")
    assert f"{comma}/figure3.edg.xml: netconvert refuses" in one_line(run("plan", comma, *QUICK))
    (scenario / "scenario.toml").write_bytes(b"\xff\xfe")
    assert "UTF-8" in one_line(run("plan", scenario, *QUICK))
    (scenario / "scenario.toml").write_text("[target\n")
    assert "TOML" in one_line(run("plan", scenario, *QUICK))


def test_odd_names_are_fine(run: Commands, tmp_path: Path) -> None:
    odd = shutil.copytree(ROOT / "sumo_nets" / "figure3", tmp_path / "a b&\"'é [x]")
    with (odd / "figure3.edg.xml").open("a") as file:
        file.write("<!-- another content -->")
    assert run("plan", odd, *QUICK, "-o", odd / "run").code == 0
    assert run("fly", odd / "run", "--targets", "5").code == 0


def test_a_slow_uav_is_a_warning(run: Commands) -> None:
    said = run("plan", "figure3", *QUICK, "--set", "uav.speed_mps=89", "--json")
    assert said.json["evaluated"]["targets"] == 20
    assert said.err.startswith("planner: uav.speed_mps: 89 m/s is less than 3 times")
    assert run("plan", "figure3", *QUICK, "--set", "uav.speed_mps=90").err == ""


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("--route", "AB BC"), "--target-speed"),
        (("--target-speed", "5"), "--target-speed"),
        (("--target-offset", "5"), "--target-speed"),
        (("--route", "", "--target-speed", "5"), "empty"),
        (("--route", "AB XX", "--target-speed", "5"), "XX is not an edge"),
        (("--route", "AB CE", "--target-speed", "5"), "does not lead to CE"),
        (("--route", "AB BC", "--target-speed", "0"), "above 0"),
        (("--route", "AB BC", "--target-speed", "nan"), "above 0"),
        (("--route", "AB BC", "--target-speed", "1e300"), "up to 1000"),
        (("--route", "AB", "--target-speed", "5", "--target-offset", "-1"), "is not on AB"),
        (("--route", "AB", "--target-speed", "5", "--target-offset", "5001"), "is not on AB"),
        (("--route", "AB", "--target-speed", "5", "--target-offset", "nan"), "is not on AB"),
        (("--seed", "-1"), "whole number"),
    ],
)
def test_flights(
    refused: Callable[..., str], copied_run: Path, arguments: tuple[str, ...], word: str
) -> None:
    assert word in refused("fly", copied_run, *arguments)


@pytest.mark.parametrize(
    ("name", "change", "word"),
    [
        ("plan.json", (".*", "{"), "is not JSON"),
        ("plan.json", (".*", "[]"), "no plan"),
        ("plan.json", ('"schema": "[^"]*"', '"schema": "other"'), "schema"),
        ("plan.json", (r'"waypoints": \[\s*\[', '"waypoints": [[9e9, 0, 0], ['), "no plan"),
        ("plan.json", (r'"waypoints": \[\s*\[[^,]*', '"waypoints": [[NaN'), "is not JSON"),
        ("plan.json", (r'"radius_m": [0-9.]*', '"radius_m": NaN'), "is not JSON"),
        ("plan.json", (r'"horizon_s": [0-9.]*', '"horizon_s": -1'), "no plan"),
        ("run.json", (".*", "{"), "does not hold a run"),
        ("run.json", (".*", "[]"), "does not hold a run"),
        ("run.json", ('"net": "[0-9a-f]*"', '"net": "0"'), "another network"),
        ("run.json", ('"depth": [0-9]*', '"depth": 0'), "search.depth"),
        (
            "run.json",
            (
                r'"scenario_path": "[^"]*",\s*"scenario_path_from_run": "[^"]*"',
                '"scenario_path": "/x/y"',
            ),
            "no file",
        ),
    ],
)
def test_broken_runs(
    run: Commands, copied_run: Path, name: str, change: tuple[str, str], word: str
) -> None:
    path = copied_run / name
    changed, times = re.subn(*change, path.read_text(), count=1, flags=re.DOTALL)
    assert times == 1
    path.write_text(changed)
    said = run("fly", copied_run)
    assert (said.code, said.out) == (2, "")
    assert word in said.err
    assert "Traceback" not in said.err
    assert not (copied_run / "flights.csv").exists()


def test_a_run_without_its_plan(refused: Callable[..., str], copied_run: Path) -> None:
    (copied_run / "plan.json").unlink()
    assert "plan.json" in refused("fly", copied_run)


FIGURE3 = {"particle": [0, 0], "time_s": [0.0, 500.0], "x_m": [0.0, 5000.0], "y_m": [0.0, 0.0]}


@pytest.mark.parametrize(
    ("columns", "word"),
    [
        ({key: [] for key in FIGURE3}, "no row"),
        ({key: FIGURE3[key] for key in ("particle", "x_m")}, "no column 'time_s'"),
        (FIGURE3 | {"time_s": [5.0, 5.0]}, "sorted"),
        (FIGURE3 | {"particle": [1, 0]}, "sorted"),
        (FIGURE3 | {"x_m": [0.0, float("nan")]}, "NaN"),
        (FIGURE3 | {"x_m": ["a", "b"]}, "numbers"),
        (FIGURE3 | {"edge": ["AB", "r0c0-r0c1"]}, "'r0c0-r0c1' is not in"),
    ],
)
def test_futures_files(
    refused: Callable[..., str], tmp_path: Path, columns: dict[str, list[object]], word: str
) -> None:
    path = tmp_path / "futures.parquet"
    pyarrow.parquet.write_table(pyarrow.table(columns), path)
    assert word in refused("plan", "figure3", *QUICK, "--futures", path)


def test_futures_of_another_net(run: Commands, tmp_path: Path) -> None:
    scenario = shutil.copytree(ROOT / "sumo_nets" / "figure3", tmp_path / "stretched")
    nodes = scenario / "figure3.nod.xml"
    nodes.write_text(nodes.read_text().replace("5000", "4000"))
    assert run("futures", scenario, "-o", tmp_path / "futures").code == 0
    path = tmp_path / "futures" / "futures.parquet"
    assert "another network" in one_line(run("plan", "figure3", *QUICK, "--futures", path))
    assert run("plan", scenario, *QUICK, "--futures", path).code == 0


def test_time_0_of_futures(run: Commands, refused: Callable[..., str], tmp_path: Path) -> None:
    path = tmp_path / "futures.parquet"
    pyarrow.parquet.write_table(pyarrow.table(FIGURE3), path)
    plain = run("plan", "figure3", *QUICK, "--futures", path, "--json").json["planned"]
    later = FIGURE3 | {"time_s": [28_800.0, 29_300.0]}
    pyarrow.parquet.write_table(pyarrow.table(later), path)
    assert "--begin 8:00:00" in refused("plan", "figure3", *QUICK, "--futures", path)
    begun = ("--begin", "8:00:00", "--futures", path)
    said = run("plan", "figure3", *QUICK, *begun, "--json")
    assert (said.err, said.json["planned"]) == ("", plain)
    assert "--futures" in refused("plan", "figure3", *QUICK, "--begin", "8:00:00")


def test_futures_stand_in_for_the_belief(refused: Callable[..., str], tmp_path: Path) -> None:
    path = tmp_path / "futures.parquet"
    pyarrow.parquet.write_table(pyarrow.table(FIGURE3), path)
    anew = ("--set", "greedy.particles=anew")
    assert "--futures" in refused("plan", "figure3", *anew, "--targets", "5", "--futures", path)


@pytest.mark.parametrize(
    ("name", "content", "word"),
    [
        ("fcd.xml", "<fcd-export></fcd-export>", "no vehicle"),
        ("fcd.xml", '<fcd-export><timestep time="0"/></fcd-export>', "no vehicle"),
        ("fcd.xml", "<fcd-export>", "is not XML"),
        ("fcd.xml", "", "is not XML"),
        ("fcd.xml", '<a><timestep time="0"><vehicle id="x"/></timestep></a>', "no floating car"),
        (
            "fcd.xml",
            '<a><timestep time="0"><vehicle id="x" x="0" y="0" lane="r0c0-r0c1_0"/></timestep></a>',
            "not in",
        ),
        (
            "fcd.xml",
            '<a><timestep time="0"><vehicle id="x" x="nan" y="0" lane="AB_0"/></timestep></a>',
            "NaN",
        ),
        ("fcd.parquet", "hello", "no readable Parquet"),
        ("fcd.csv", "hello", "no floating car data"),
    ],
)
def test_fcd_files(
    refused: Callable[..., str], tmp_path: Path, name: str, content: str, word: str
) -> None:
    path = tmp_path / name
    path.write_text(content)
    assert word in refused("plan", "figure3", *QUICK, "--futures", path)


def test_some_particles_never_set_out(run: Commands, tmp_path: Path) -> None:
    both = {name: column * 2 for name, column in FIGURE3.items()}
    late = {"particle": [0, 0, 1, 1], "time_s": [3590.0, 3599.0, 9000.0, 9500.0]}
    path = tmp_path / "futures.parquet"
    pyarrow.parquet.write_table(pyarrow.table(both | late), path)
    for method in ("greedy", "exact", "wait", "random", "exhaustive", "exhaustive-shortest"):
        output = ("-o", tmp_path / "run") if method == "wait" else ()
        options = ("--method", method, "--targets", "20", "--futures", path, "--json")
        told = run("plan", "figure3", *options, *output).json
        assert told["planned"]["detection_probability"] <= 0.5


@pytest.mark.parametrize(
    "setting", ["search.horizon_s=5", "uav.max_flight_time_s=1", "uav.take_off_s=3599.9"]
)
def test_too_short_to_find_anything(run: Commands, setting: str, tmp_path: Path) -> None:
    for method in ("greedy", "exact", "wait"):
        output = ("-o", tmp_path / "run") if method == "greedy" else ()
        options = ("--method", method, "--targets", "20", "--set", setting, "--json")
        told = run("plan", "figure3", *options, *output).json
        assert told["planned"]["detection_probability"] == 0
        horizon_s = told["planned"]["horizon_s"]
        assert told["planned"]["expected_detection_time_s"] == pytest.approx(horizon_s)


@pytest.mark.parametrize("place", ["file", "file/run", "/proc/run"])
def test_folders_that_cannot_be_written(run: Commands, tmp_path: Path, place: str) -> None:
    (tmp_path / "file").touch()
    line = one_line(run("plan", "figure3", *QUICK, "-o", tmp_path / place))
    assert "cannot be written" in line
    assert str(tmp_path / place) in line


@pytest.mark.parametrize("place", ["file", "file/cache", "/proc/cache"])
def test_a_cache_that_cannot_be_written(
    run: Commands, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("PLANNER_CACHE", str(tmp_path / place))
    assert "PLANNER_CACHE" in one_line(run("plan", "figure3", *QUICK))


def test_compiled_code_that_cannot_be_kept(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    closed = str(tmp_path / "file" / "cache")
    said = in_a_process("plan", "figure3", *QUICK, "--json", NUMBA_CACHE_DIR=closed)
    assert said.json["method"] == "wait"  # slower, but it works


def test_a_full_disk(tmp_path: Path, a_run: Path) -> None:
    said = in_a_process_with_files_of(4096, "plan", "figure3", *QUICK, "-o", tmp_path / "run")
    assert "cannot be written" in one_line(said)
    assert not (tmp_path / "run").exists()


def in_a_process_with_files_of(size: int, *arguments: object) -> Said:
    code = f"""import resource, runpy, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))
sys.argv = {["planner", *map(str, arguments)]!r}
runpy.run_module("planner", run_name="__main__")"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    return Said(done.returncode, done.stdout, done.stderr)


def test_a_missing_system_library(tmp_path: Path, empty_cache: Path) -> None:
    missing = "libGL.so.1: cannot open shared object file"
    (tmp_path / "libsumo.py").write_text(f"raise ImportError({missing!r})")
    line = one_line(in_a_process("plan", "figure3", *QUICK, PYTHONPATH=str(tmp_path)))
    assert missing in line
    assert "apt-get install libgl1" in line


@pytest.mark.parametrize("closed", ["> /dev/full", "| true", ">&-", "2>&-"])
@pytest.mark.parametrize("flag", ["", "--json"])
def test_nobody_listens(a_run: Path, closed: str, flag: str) -> None:
    command = f"{sys.executable} -m planner where figure3 --at 600 {flag} {closed}"
    done = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command}"], capture_output=True, text=True, check=False
    )
    assert "Traceback" not in done.stderr
    assert "Exception" not in done.stderr
    assert done.returncode == (2 if "full" in closed else 0) or "|" in closed


# Interruptions


ANSWERED_S = 1.0
MANY = ("--set", "target.driving=free", "--set", "search.particles=4000")


class Running:
    """A command in a process group of its own, as a terminal gives it one."""

    def __init__(self, folder: Path, *arguments: object, cache: Path | None = None) -> None:
        self.cache, self.temporary = cache or folder / "cache", folder / "tmp"
        self.temporary.mkdir()
        here = {"PLANNER_CACHE": str(self.cache), "TMPDIR": str(self.temporary)}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "planner", *map(str, arguments)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, **here},
            start_new_session=True,
        )

    def children(self) -> set[int]:
        """Return its workers, without what they have forked."""
        return {pid for pid, parent in _parents() if parent == self.process.pid}

    def descendants(self) -> set[int]:
        parents = dict(_parents())
        found = {self.process.pid}
        while more := {pid for pid, parent in parents.items() if parent in found} - found:
            found |= more
        return found - {self.process.pid}

    def wait_until(self, there: Callable[[], object]) -> None:
        give_up = time.monotonic() + 60
        while not there():
            assert self.process.poll() is None, self.process.communicate()[1]
            assert time.monotonic() < give_up
            time.sleep(0.02)

    def driving(self) -> bool:
        """Whether SUMO drives."""
        with suppress(FileNotFoundError):  # folders come and go while they are looked through
            return any(self.temporary.rglob("errors.txt"))  # where it writes messages
        return False

    def interrupted(self, number: int = signal.SIGINT) -> tuple[Said, float]:
        """Answer to Ctrl-C, and how long it took."""
        begun = time.monotonic()
        os.killpg(self.process.pid, number)
        out, err = self.process.communicate(timeout=30)
        return Said(self.process.returncode, out, err), time.monotonic() - begun


def _parents() -> Iterator[tuple[int, int]]:
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            text = stat.read_text()
        except OSError:
            continue
        state, parent = text.rpartition(")")[2].split()[:2]
        if state != "Z":
            yield int(text.split()[0]), int(parent)


def alive(pids: set[int]) -> set[int]:
    return pids & {pid for pid, _ in _parents()}


@pytest.mark.parametrize(
    ("jobs", "number"),
    [(1, signal.SIGINT), (2, signal.SIGINT), (2, signal.SIGTERM), (1, signal.SIGHUP)],
)
def test_stopped_while_sumo_drives(tmp_path: Path, jobs: int, number: signal.Signals) -> None:
    output = tmp_path / "runs" / "one"
    running = Running(tmp_path, "plan", TOWN, *QUICK, *MANY, "-j", jobs, "-o", output)
    running.wait_until(running.driving)
    workers, all_of_it = running.children(), running.descendants()
    said, took_s = running.interrupted(number)
    assert len(workers) == jobs  # each is a process of its own
    assert (said.code, said.out) == (128 + number, "")
    *announced, stopped = said.err.splitlines()
    long = "planner: recording futures: 4,000 SUMO runs, about "
    assert [line[: len(long)] for line in announced] == [long] * (jobs == 1)  # two are quick
    assert stopped == "planner: stopped; nothing is half-written"
    assert took_s < ANSWERED_S
    assert not alive(workers | all_of_it)
    assert list(running.temporary.iterdir()) == []
    assert not (tmp_path / "runs").exists()
    few = ("--set", "search.particles=5", "--set", "target.driving=free", "--targets", "5")
    again = in_a_process("plan", TOWN, *QUICK[:2], *few, PLANNER_CACHE=str(running.cache))
    assert again.code == 0


def test_stopped_while_planning(tmp_path: Path) -> None:
    """Compiled code runs, is being compiled, or is loaded."""
    output = tmp_path / "run"
    cache = Path(os.environ["PLANNER_CACHE"])
    assert main(["futures", "figure1", "--json"]) == 0
    arguments = ("plan", "figure1", "--method", "exact", "--set", "search.depth=6")
    running = Running(tmp_path, *arguments, "-o", output, cache=cache)
    running.wait_until(output.exists)
    time.sleep(0.4)
    assert running.process.poll() is None
    said, took_s = running.interrupted()
    assert said == Said(130, "", "planner: stopped; nothing is half-written\n")
    assert took_s < ANSWERED_S
    assert not output.exists()


def test_a_call_that_is_stopped_before_its_first_plan_says_what_there_is(tmp_path: Path) -> None:
    output = tmp_path / "run"
    words = ("--last-seen", "n", "--at", "-1min", "--drone-at", "nw", "--target", "joyride")
    running = Running(tmp_path, "now", TOWN, *words, "-j", 1, "-o", output)
    running.wait_until(running.driving)
    said, _ = running.interrupted()
    assert said.code == 130
    holds, stopped = said.err.splitlines()[-2:]
    assert holds == (
        f"planner: {output} holds the call, without a plan yet; `planner plan {output}` makes one"
    )
    assert stopped == "planner: stopped; nothing is half-written"


@pytest.mark.parametrize("early_s", [0.3, 0.6])
def test_stopped_early(tmp_path: Path, early_s: float) -> None:
    running = Running(tmp_path, "plan", TOWN, *QUICK, *MANY, "-o", tmp_path / "run")
    time.sleep(early_s)
    said, took_s = running.interrupted()
    assert took_s < ANSWERED_S
    assert said == Said(130, "", "planner: stopped; nothing is half-written\n")
    assert not (tmp_path / "run").exists()


def test_a_killed_worker_is_started_again(tmp_path: Path) -> None:
    few = ("--set", "search.particles=300", "--set", "target.driving=free")
    running = Running(tmp_path, "futures", TOWN, *few, "-j", 1)
    running.wait_until(running.driving)
    workers = running.descendants()
    os.kill(min(workers), signal.SIGKILL)
    out, err = running.process.communicate(timeout=60)
    assert running.process.returncode == 0, err
    assert "killed by signal 9" in err
    assert "started again" in err
    assert "particles    300" in out
    assert not alive(workers)
    assert list(running.temporary.iterdir()) == []


def test_what_dies_again_and_again_ends_the_command(tmp_path: Path) -> None:
    running = Running(tmp_path, "plan", TOWN, *QUICK, *MANY, "-j", 1, "-o", tmp_path / "run")
    killed: set[int] = set()
    give_up = time.monotonic() + 60
    while running.process.poll() is None and time.monotonic() < give_up:
        for process in running.descendants() - killed if running.driving() else ():
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
            killed.add(process)
        time.sleep(0.01)
    out, err = running.process.communicate(timeout=30)
    assert (running.process.returncode, out) == (1, "")
    assert "what is recorded is kept" in err.splitlines()[-1]
    assert "signal 9" in err.splitlines()[-1]
    assert not alive(killed)
    assert list(running.temporary.iterdir()) == []
    assert not (tmp_path / "run").exists()


def test_workers_end_with_the_program(tmp_path: Path) -> None:
    running = Running(tmp_path, "plan", TOWN, *QUICK, *MANY, "-j", 2)
    running.wait_until(running.driving)
    workers = running.descendants()
    running.process.kill()
    running.process.communicate()
    give_up = time.monotonic() + 10
    while alive(workers) and time.monotonic() < give_up:
        time.sleep(0.05)
    assert not alive(workers)


def test_a_damaged_cache_is_mended(run: Commands, empty_cache: Path) -> None:
    options = ("plan", "figure3", *QUICK, "--json")
    first = run(*options).json
    for path in empty_cache.rglob("*.parquet"):
        path.write_bytes(path.read_bytes()[:100])
    assert run(*options).json == first
    for path in empty_cache.rglob("*.npz"):
        path.write_bytes(b"")
    assert json.loads(run(*options).out) == first
