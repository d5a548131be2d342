"""Networks that netconvert makes from sources, once per content and SUMO version."""

import hashlib
import logging
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from planner.errors import InputError
from planner.files import cache_folder, written_whole
from planner.network.sumo import netconvert, sumo_version

log = logging.getLogger(__name__)

# Coordinates and lengths come out as they went in: no shift, no cut at junctions, no inner lanes,
# no slowing in turns, and digits enough for lengths that are not whole centimetres.
ABSTRACT = (
    "--offset.disable-normalization",
    "--junctions.minimal-shape",
    "--no-internal-links",
    "--no-turnarounds",
    "--junctions.limit-turn-speed=-1",
    "--precision=9",
)
STREETS = ("--offset.disable-normalization",)
TOWN = (
    "--geometry.remove",
    "--ramps.guess",
    "--junctions.join",
    "--tls.guess-signals",
    "--keep-edges.by-vclass=passenger",
    "--remove-edges.isolated",
    "--output.street-names",
)
# netconvert writes when and from which files it made a net; without that, the same sources give
# the same bytes.
MADE_AT = re.compile(rb"\A(<\?xml[^>]*\?>\s*)<!-- generated on .*?-->\s*", re.DOTALL)


def build_net(
    nodes: Path,
    edges: Path,
    *,
    connections: Path | None = None,
    signals: Path | None = None,
    abstract: bool = True,
) -> Path:
    """Return the ``.net.xml`` of plain-XML sources; netconvert runs on first use only.

    Parameters
    ----------
    nodes, edges, connections, signals
        Files as netconvert reads them (``.nod.xml``, ``.edg.xml``, ``.con.xml``, ``.tll.xml``).
    abstract
        True: every coordinate and length as in the sources, junctions are points. False: streets
        with lanes and junctions that have a size.

    Raises
    ------
    InputError
        If a source is missing or netconvert refuses it.
    """
    sources = {"--node-files": nodes, "--edge-files": edges}
    if connections is not None:
        sources["--connection-files"] = connections
    if signals is not None:
        sources["--tllogic-files"] = signals
    return _build(sources, ABSTRACT if abstract else STREETS)


def import_osm(osm: Path) -> Path:
    """Return the ``.net.xml`` of an OpenStreetMap extract (``.osm``, ``.osm.gz``): its car roads.

    Raises
    ------
    InputError
        If the file is missing or netconvert refuses it.
    """
    return _build({"--osm-files": osm}, TOWN)


def _build(sources: Mapping[str, Path], options: Sequence[str]) -> Path:
    net = cache_folder("nets") / f"{_key(sources, options)}.net.xml"
    subject = ", ".join(str(path) for path in sources.values())
    if net.exists():
        return net
    if any("," in str(path) for path in sources.values()):
        raise InputError(f"{subject}: netconvert takes no comma in a path; rename it")
    log.info("netconvert builds the network of %s", subject)
    with written_whole(net) as new:
        given = [f"{option}={path}" for option, path in sources.items()]
        netconvert([*given, *options, f"--output-file={new}"], subject=subject)
        new.write_bytes(MADE_AT.sub(rb"\1", new.read_bytes(), count=1))
    return net


def _key(sources: Mapping[str, Path], options: Sequence[str]) -> str:
    digest = hashlib.sha256(repr((sumo_version(), tuple(options))).encode())
    for option, path in sources.items():
        content = hashlib.sha256(_content(path)).hexdigest()
        # A compressed extract is recognised by its name alone.
        digest.update(repr((option, path.suffixes[-1:], content)).encode())
    return digest.hexdigest()[:32]


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({error.strerror or error}); "
            "correct the path, relative paths start at the scenario's folder"
        ) from error
