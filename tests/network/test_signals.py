"""Signals and ways through junctions, as the net's file has them."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from planner.errors import InputError
from planner.network.read import read_net
from planner.network.road_network import RoadNetwork
from planner.network.signals import GO, STOP, YIELD, signal_cycle_s, signals_of
from planner.network.sumo import CAR, sumo_home
from support.sumo_instances import grid5x5, town


def berlin() -> RoadNetwork:
    """The town that is delivered with SUMO; its signals are actuated."""
    return read_net(sumo_home() / "tools" / "game" / "DRT" / "osm.net.xml")


def turns(network: RoadNetwork) -> list[tuple[str, str]]:
    return [
        (name, network.edge_ids[end])
        for edge, name in enumerate(network.edge_ids)
        for end in network.turns(edge, back=True)
    ]


def changed(tmp_path: Path, old: str, new: str | Callable[[re.Match[str]], str]) -> RoadNetwork:
    """The town with something in its file changed."""
    text = town().path.read_text(encoding="utf-8")
    assert re.search(old, text)
    path = tmp_path / "changed.net.xml"
    path.write_text(re.sub(old, new, text), encoding="utf-8")
    return read_net(path)


@pytest.mark.parametrize("network", [berlin, town, grid5x5])
def test_all_is_as_sumolib_reads_it(network: object) -> None:
    import sumolib

    roads: RoadNetwork = network()  # type: ignore[operator]
    net = sumolib.net.readNet(str(roads.path), withPrograms=True, withInternal=True)
    found = signals_of(roads)
    for turn, (start, end) in enumerate(turns(roads)):
        ways = net.getEdge(start).getAllowedOutgoing(CAR)
        link = next(links for edge, links in ways.items() if edge.getID() == end)[0]
        shows = found.shows[found.first_second[turn] : found.first_second[turn + 1]]
        letters = {"G": GO, "g": YIELD}
        said: list[int] = []
        if link.getTLSID():
            *_, program = net.getTLS(link.getTLSID()).getPrograms().values()
            for phase in program.getPhases():
                letter = phase.state[link.getTLLinkIndex()]
                actuated = program.getType() == "actuated"
                lasts_s = phase.minDur if actuated and phase.minDur >= 0 else phase.duration
                said += [letters.get(letter, STOP)] * int(lasts_s)
            assert found.actuated[turn] == (program.getType() == "actuated")
        assert shows.tolist() == (said if any(said) else [])
        assert found.minor[turn] == (not link.getTLSID() and link.getState() in "m=sw")
        length_m, via = 0.0, link.getViaLaneID()
        while via:
            length_m += net.getLane(via).getLength()
            via = next((c.getViaLaneID() for c in net.getLane(via).getOutgoing()), "")
        assert found.length_m[len(roads.edge_ids) + turn] == pytest.approx(length_m)


def test_the_cycle_is_that_of_all_signals(tmp_path: Path) -> None:
    assert signal_cycle_s(grid5x5()) == 1
    assert signal_cycle_s(berlin()) == 90
    network = town()
    lengths = {int(c) for c in signals_of(network).cycle_s if c}
    assert lengths == {signal_cycle_s(network)}


def test_cycles_that_never_meet_are_cut(tmp_path: Path) -> None:
    network = changed(tmp_path, r'<phase duration="\d+"', '<phase duration="1999"')
    assert signal_cycle_s(network) == 3600


def test_an_offset_is_read(tmp_path: Path) -> None:
    network = changed(tmp_path, 'offset="0"', 'offset="17"')
    found = signals_of(network)
    assert set(found.offset_s[found.cycle_s > 0]) == {17}
    assert set(found.offset_s[found.cycle_s == 0]) <= {0}


def test_the_program_read_last_counts(tmp_path: Path) -> None:
    text = town().path.read_text(encoding="utf-8")
    program = re.search(r"<tlLogic.*?</tlLogic>", text, re.S)
    assert program
    second = re.sub(r'programID="0"', 'programID="1"', program[0])
    second = re.sub(r'duration="\d+"', 'duration="5"', second)
    network = changed(tmp_path, "</tlLogic>(?s:.*)</tlLogic>|</tlLogic>", f"</tlLogic>{second}")
    phases = second.count("<phase")
    assert set(signals_of(network).cycle_s.tolist()) == {0, 5 * phases}


def never_open(network: RoadNetwork) -> int:
    """How many turns have a signal that is always red."""
    found = signals_of(network)
    parts = zip(found.first_second[:-1], found.first_second[1:], strict=True)
    return sum(end > first and not found.shows[first:end].any() for first, end in parts)


@pytest.mark.parametrize(("shut", "never"), [({1}, 0), ({1, 2}, 1)])
def test_a_turn_is_shut_where_none_of_its_lanes_is_ever_open(
    shut: set[int], never: int, tmp_path: Path
) -> None:
    """Two lanes lead from the north to the south: links 1 and 2."""

    def without(found: re.Match[str]) -> str:
        letters = ("r" if k in shut else letter for k, letter in enumerate(found[1]))
        return f'state="{"".join(letters)}"'

    network = changed(tmp_path, 'state="([ryguGo]{3,})"', without)
    found, turn = signals_of(network), turns(network).index(("n-centre", "centre-s"))
    assert never_open(network) == never
    assert bool(found.cycle_s[turn]) == bool(never)


def test_what_a_fixed_program_never_opens_stays_shut(tmp_path: Path) -> None:
    assert never_open(town()) == 0
    shut = changed(tmp_path, 'state="[rygGuo]+"', lambda found: re.sub("[gG]", "r", found[0]))
    assert never_open(shut) == np.count_nonzero(signals_of(town()).cycle_s) > 0
    by_detectors = re.sub('type="static"', 'type="actuated"', shut.path.read_text("utf-8"))
    shut.path.write_text(by_detectors, encoding="utf-8")
    assert never_open(read_net(shut.path)) == 0


def test_a_second_reading_is_the_first(empty_cache: Path) -> None:
    network = read_net(town().path)
    signals_of.cache_clear()
    first = signals_of(network)
    assert list((empty_cache / "nets").glob("*.signals*.npz"))
    signals_of.cache_clear()
    second = signals_of(network)
    assert second is not first
    assert all(np.array_equal(getattr(first, f), getattr(second, f)) for f in vars(first))


def test_a_number_that_is_none_is_said(tmp_path: Path) -> None:
    network = changed(tmp_path, r'<phase duration="\d+"', '<phase duration="long"')
    with pytest.raises(
        InputError, match=r"changed\.net\.xml: its lanes, links or signals cannot be read"
    ):
        signals_of(network)


def test_a_net_larger_than_numbers_is_refused_without_a_warning(tmp_path: Path) -> None:
    text = town().path.read_text(encoding="utf-8").replace('x="560.00"', 'x="1e308"')
    assert "1e308" in text
    (tmp_path / "huge.net.xml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="more than the Earth"):
        read_net(tmp_path / "huge.net.xml")
