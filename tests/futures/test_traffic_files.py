"""A SUMO scenario from elsewhere: it is read, and writes, connects and reads nowhere else."""

import re
import socket
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import pytest

from planner import xml_guard
from planner.errors import InputError
from planner.futures.traffic import Permit, traffic_options
from planner.futures.traffic_files import ELEMENT, SUSPECTS, InputFiles
from planner.locks import temporary_folder
from planner.network.read import read_net
from planner.network.sumo import binary, sumo_environment, sumo_home
from planner.xml_guard import xml_elements
from support.sumo_instances import town
from support.user_traffic import seen_of, traffic_at, write_traffic

DETECTOR = '<e1Detector id="d" lane="w-nw_0" pos="9" period="5" file="{}"/>'
SSM = '<vType id="{}"><param key="has.ssm.device" value="true"/>{}</vType>'
IN_SSM = '<vehicle id="{}" type="ssm" depart="0"><route edges="nw-n n-centre"/></vehicle>'
PHASES = '<phase duration="9" state="{}" minDur="5" maxDur="50"/>'.format("G" * 20)


@dataclass(frozen=True)
class Host:
    """Where hostile files would write, if they could."""

    outside: Path
    port: int
    listening: socket.socket

    def was_called(self) -> bool:
        with suppress(TimeoutError, BlockingIOError):
            self.listening.accept()[0].close()
            return True
        return False


@pytest.fixture
def host(tmp_path: Path) -> Iterator[Host]:
    outside = tmp_path / "outside"
    outside.mkdir()
    with socket.create_server(("127.0.0.1", 0)) as listening:
        listening.settimeout(0)
        yield Host(outside, listening.getsockname()[1], listening)


# What each adds to a file of the scenario; @ stands for the folder outside, PORT for the port.
WRITERS = {
    "an output": {"config": '<fcd-output value="@/fcd.xml"/>'},
    "an output by its other name": {"config": '<ndump value="@/dump.xml"/>'},
    "an output as text": {"config": "<fcd-output>@/fcd.xml</fcd-output>"},
    "an output upwards": {"config": '<fcd-output v="../outside/fcd.xml"/>'},
    "an output to a host": {"config": '<summary-output value="127.0.0.1:PORT"/>'},
    "a prefix": {"config": '<output-prefix value="../outside/"/>'},
    "a log": {"config": '<message-log value="@/log.txt"/>'},
    "a state": {"config": '<save-state.times value="5"/><save-state.files value="@/s.xml"/>'},
    "a configuration": {"config": '<save-configuration value="@/again.sumocfg"/>'},
    "a device for all": {
        "config": '<device.ssm.probability value="1"/><device.ssm.file value="@/ssm.xml"/>'
    },
    "weights of routes": {
        "config": '<device.rerouting.probability value="1"/><device.rerouting.period value="5"/>'
        '<device.rerouting.output value="@/weights.xml"/>'
    },
    "a detector": {"stops": DETECTOR.format("@/e1.xml")},
    "a detector upwards": {"stops": DETECTOR.format("../outside/e1.xml")},
    "means": {"stops": '<edgeData id="e" file="@/edges.xml" period="5"/>'},
    "signals": {"stops": '<timedEvent type="SaveTLSStates" source="centre" dest="@/tls.xml"/>'},
    "a probe": {"stops": '<vTypeProbe id="p" type="car" period="5" file="@/probe.xml"/>'},
    "a probe of routes": {
        "stops": '<routeProbe id="p" edge="nw-n" period="5" file="@/routes.xml"/>'
    },
    "a calibrator": {
        "stops": '<calibrator id="c" edge="nw-n" pos="0" period="5" output="@/c.xml">'
        '<flow begin="0" end="30" speed="9"/></calibrator>'
    },
    "a parameter of signals": {
        "stops": '<tlLogic id="centre" type="actuated" programID="a" offset="0">'
        f'<param key="&#102;ile" value="@/act.xml"/><param key="freq" value="5"/>{PHASES}</tlLogic>'
    },
    "a parameter of a vehicle's type": {
        "cars": SSM.format("ssm", '<param key="device.ssm.file" value="@/ssm.xml"/>')
        + IN_SSM.format("a")
    },
    "a vehicle's name": {"cars": SSM.format("ssm", "") + IN_SSM.format("/../../outside/name")},
}


def written(text: str, host: Host) -> str:
    return text.replace("@", host.outside.as_posix()).replace("PORT", str(host.port))


def run_sumo(words: list[str], folder: Path) -> None:
    sumo_environment()
    words = [str(binary("sumo")), *words, "--end=15"]
    subprocess.run(words, cwd=folder, capture_output=True, timeout=60, check=False)


@pytest.mark.parametrize("kind", WRITERS)
def test_nothing_is_written_elsewhere_and_nobody_called(
    kind: str, host: Host, tmp_path: Path
) -> None:
    more = {file: written(text, host) for file, text in WRITERS[kind].items()}
    folder, here = write_traffic(tmp_path / "own", **more), tmp_path / "here"
    here.mkdir()
    before = seen_of(tmp_path)
    opened = traffic_at(folder)
    assert opened.traffic is not None
    with temporary_folder() as work:
        words = traffic_options(opened.traffic, opened.network.path, 0, work)
        run_sumo(words[1:], here)
    assert seen_of(tmp_path) == before
    assert not host.was_called()

    (here / "ssm_").mkdir()  # where the name of a file with .. would begin
    obeyed = seen_of(tmp_path / "outside")
    run_sumo(["-c", str(folder / "run.sumocfg"), "--xml-validation=never"], here)
    assert seen_of(tmp_path / "outside") != obeyed or host.was_called()


OUTSIDE = {
    "an include": {"stops": '<include href="../outside/more.xml"/>'},
    "an include by its whole name": {"stops": '<include href="@/more.xml"/>'},
    "a file of speeds": {"stops": '<variableSpeedSign id="v" lanes="nw-n_0" file="@/more.xml"/>'},
    "a file of detours": {"stops": '<rerouter id="r" edges="nw-n" file="@/more.xml"/>'},
    "routes": {"config": '<route-files value="../outside/more.xml"/>'},
    "weights": {"config": '<weight-files value="@/more.xml"/>'},
    "a link": {"stops": '<include href="link.xml"/>'},
}


@pytest.mark.parametrize("kind", OUTSIDE)
def test_files_outside_are_not_read(kind: str, host: Host, tmp_path: Path) -> None:
    (host.outside / "more.xml").write_text("<routes/>")
    more = {file: written(text, host) for file, text in OUTSIDE[kind].items()}
    folder = write_traffic(tmp_path / "own", **more)
    (folder / "link.xml").symlink_to(host.outside / "more.xml")
    with pytest.raises(InputError, match=r"does not lie below .*own; .* --allow .*outside"):
        traffic_at(folder)
    traffic_at(folder, Permit((host.outside,)))


REFUSED = {
    "a socket": ({"stops": DETECTOR.format("127.0.0.1:PORT")}, "over the network"),
    "an entity": ({}, "document type"),
    "a circle": ({"stops": '<include href="stops.add.xml"/>'}, "leads to .* again"),
    "mesosim": ({"config": '<mesosim value="TRUE"/>'}, "mesosim = TRUE is another traffic"),
    "walkers elsewhere": ({"config": '<pedestrian.model value="remote"/>'}, "on the network"),
    "the environment": ({"config": '<scale value="${HOME}"/>'}, r"without \$"),
    "no file": ({"stops": '<include href="nothing.xml"/>'}, "cannot be read"),
    "a begin before 0": ({"config": '<begin value="-1"/>'}, "begins at -1 s, .* or before 0"),
    "no step": ({"config": '<step-length value="0"/>'}, "step-length is 0 s; give one from 0.01"),
    "a long step": ({"config": '<step-length value="1e9"/>'}, "its step-length is 1"),
    "no time": ({"config": '<begin value="soon"/>'}, r"run.sumocfg: begin: should be seconds or"),
    "a late begin": ({"config": '<b value="0:02:00"/>'}, "begins at 120 s, after traffic.at, 60 s"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_cannot_be_had_is_one_line(kind: str, host: Host, tmp_path: Path) -> None:
    more, said = REFUSED[kind]
    folder = write_traffic(tmp_path / "own", **{k: written(v, host) for k, v in more.items()})
    if kind == "an entity":
        (folder / "bus.rou.xml").write_text('<!DOCTYPE r [<!ENTITY a "b">]><routes>&a;</routes>')
    with pytest.raises(InputError, match=said) as refused:
        traffic_at(folder)
    assert str(refused.value).count("\n") == 0
    assert not host.was_called()


USELESS = {"edgeData", "laneData", "timedEvent", "vTypeProbe"}  # they write and do nothing else


def test_what_sumo_knows_is_kept_or_useless() -> None:
    schemas = sumo_home() / "data" / "xsd"
    known: set[str] = set()
    for name in ("additional_file", "routes_file", "types/route", "taz_file", "types/taz"):
        text = (schemas / f"{name}.xsd").read_text()
        known |= set(re.findall(r'element\s+name="([^"]+)"', text))
    assert {name for name in known if not ELEMENT.fullmatch(name)} == {*USELESS, "metadata"}


def test_files_that_name_nothing_are_not_copied(tmp_path: Path) -> None:
    folder = write_traffic(tmp_path / "own")
    files = InputFiles((folder,), tmp_path)
    assert files.named(folder / "cars.rou.xml.gz", "a test").is_symlink()
    copy = files.named(folder / "stops.add.xml", "a test")
    assert not copy.is_symlink()
    elements = {one.tag: dict(one.attrib) for one in xml_elements(copy)}
    own = {one.tag: dict(one.attrib) for one in xml_elements(folder / "stops.add.xml")}
    assert own.pop("edgeData")
    for tag in ("e1Detector", "e2Detector"):
        own[tag]["file"] = "NUL"
    assert elements == own


@pytest.mark.parametrize(
    "suspect",
    [
        '<edgeData id="e"/>',
        '<e1Detector id="e" file="a"/>',
        f"<{'a' * 200}/>",
        '<param key="a"/>',
        '<include href="a"/>',
        "<timedEvent\t/>",
    ],
)
def test_a_suspect_is_seen_wherever_it_is_read_in_two(
    suspect: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(xml_guard, "BLOCK", 128)
    file = tmp_path / "a.xml"
    for shift in range(130):
        ordinary = f"<routes>{' ' * shift}{'<vehicle/><routeDistribution/>' * 8}"
        file.write_text(f"{ordinary}</routes>")
        assert not xml_guard.holds(file, SUSPECTS)
        file.write_text(f"{ordinary}{suspect}{'<vehicle/>' * 30}</routes>")
        assert xml_guard.holds(file, SUSPECTS)


@pytest.mark.parametrize(
    ("parameter", "refused"),
    [
        ('key="file" value="/tmp/e1.xml"', True),
        ('key="&#102;ile" value="../e1.xml"', True),
        ('key="file" value="127.0.0.1:80"', True),
        ('key="whetherOutputState" value="1"', True),
        ('key="file" value="NUL"', False),
        ('key="max-gap" value="3"', False),
    ],
)
def test_signals_of_a_net_write_nowhere(parameter: str, refused: bool, tmp_path: Path) -> None:
    net = tmp_path / "town.net.xml"
    text = town().path.read_text()
    net.write_text(re.sub(r"(<tlLogic [^>]*>)", rf"\1<param {parameter}/>", text, count=1))
    if refused:
        with pytest.raises(InputError, match="by which signals write files"):
            read_net(net)
    else:
        read_net(net)
