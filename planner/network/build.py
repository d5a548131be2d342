"""Networks that netconvert makes from sources, once per content and SUMO version."""

import hashlib
import logging
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import escape

from planner.cache import cache_folder, is_whole, seal
from planner.errors import InputError, OutputError
from planner.files import written_whole
from planner.guard import opened
from planner.network.names import refuse_unusable_names
from planner.network.sumo import netconvert, plain_names, sumo_version
from planner.scenario.sections import OF_OSM
from planner.xml_guard import xml_elements

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
FOR_CARS = "export an area in which there are roads for cars"
WITH_NAMES = ("--node-files", "--edge-files")
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
    folder: Path | None = None,
) -> Path:
    """Return the ``.net.xml`` of plain-XML sources; netconvert runs on first use only.

    Parameters
    ----------
    nodes, edges, connections, signals
        Files as netconvert reads them (``.nod.xml``, ``.edg.xml``, ``.con.xml``, ``.tll.xml``).
    abstract
        True: every coordinate and length as in the sources, junctions are points. False: streets
        with lanes and junctions that have a size.
    folder
        The scenario's, below which lies what the files include; the files' own if not given.

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
    return _build(sources, ABSTRACT if abstract else STREETS, folder or edges.parent)


def import_osm(osm: Path) -> Path:
    """Return the ``.net.xml`` of an OpenStreetMap extract (``.osm``, ``.osm.gz``): its car roads.

    Raises
    ------
    InputError
        If the file is missing or netconvert refuses it.
    """
    return _build({"--osm-files": osm}, TOWN, osm.parent, credit=OF_OSM, remedy=FOR_CARS)


def _build(
    sources: Mapping[str, Path],
    options: Sequence[str],
    folder: Path,
    *,
    credit: str = "",
    remedy: str = "",
) -> Path:
    subject = ", ".join(str(path) for path in sources.values())
    contents = {option: _content(path) for option, path in sources.items()}
    with plain_names(list(sources.values()), folder) as links:
        key = _key(sources, contents, [*options, *([credit] if credit else [])], links)
        net = cache_folder("nets") / f"{key}.net.xml"
        if is_whole(net):
            return net
        log.info("netconvert builds the network of %s", subject)
        with written_whole(net) as new:
            given = [f"{option}={links[path]}" for option, path in sources.items()]
            made = next(iter(links.values())).parent / "made.net.xml"
            try:
                netconvert(
                    [*given, *options, f"--output-file={made}"], subject=subject, links=links
                )
            except InputError as error:
                refuse_unusable_names([p for o, p in sources.items() if o in WITH_NAMES])
                if not remedy:
                    raise
                raise InputError(f"{str(error).removesuffix('.')}; {remedy}") from error
            if not made.read_bytes().rstrip().endswith(b"</net>"):
                raise OutputError(f"{subject}: netconvert wrote half a net; is the disk full?")
            # Whose data it is stays with the net, wherever it is copied to.
            head = f"<!-- {credit} -->\n".encode() if credit else b""
            content = MADE_AT.sub(lambda found: found[1] + head, made.read_bytes(), count=1)
            if "--edge-files" in sources:
                refuse_spoilt_names(sources["--edge-files"], content)
                refuse_spoilt_names(sources["--node-files"], content)
            new.write_bytes(content)
        seal(net)
    return net


def refuse_spoilt_names(path: Path, net: bytes) -> None:
    """Raise InputError where netconvert has written another name than a source gives."""
    content = path.read_bytes()
    if content.isascii() and b"&#" not in content:
        return
    known = net.decode("utf-8", "replace")
    for element in xml_elements(path):
        name = element.get("id", "")
        if element.tag in ("edge", "node") and not name.isascii():
            written = escape(name, {'"': "&quot;"})
            if element.tag == "edge" and f'id="{written}"' not in known:
                raise InputError(f"{path}: netconvert spoils the name {name}; use another")
            if element.tag == "node" and f'"{written}"' not in known and "\ufffd" in known:
                raise InputError(f"{path}: netconvert spoils the name {name}; use another")


def _key(
    sources: Mapping[str, Path],
    contents: Mapping[str, bytes],
    options: Sequence[str],
    links: Mapping[Path, Path],
) -> str:
    digest = hashlib.sha256(repr((sumo_version(), tuple(options))).encode())
    for option, path in sources.items():
        content = hashlib.sha256(contents[option]).hexdigest()
        # A compressed extract is recognised by its name alone.
        digest.update(repr((option, path.suffixes[-1:], content)).encode())
    for link in sorted(_others(links)):
        digest.update(repr((link.name, hashlib.sha256(link.read_bytes()).hexdigest())).encode())
    return digest.hexdigest()[:32]


def _others(links: Mapping[Path, Path]) -> list[Path]:
    """Return the links to what the sources include."""
    tops = {next(p for p in link.parents if p.name.isdecimal()).parent for link in links.values()}
    every = [path for top in tops for path in top.rglob("*") if path.is_file()]
    return [path for path in every if path not in links.values()]


def _content(path: Path) -> bytes:
    with opened(path) as file:
        return file.read()
