"""Turn probabilities from SUMO's own format, a file of edgeRelations."""

import math
from pathlib import Path
from xml.etree import ElementTree

from planner.belief.prior import TurnTable
from planner.errors import InputError
from planner.messages import as_written


def read_turns(path: Path) -> TurnTable:
    """Return the probabilities of a file of ``edgeRelation`` elements, by its two edges.

    Raises
    ------
    InputError
        If the file is missing, is not such a file, or gives a turn twice (more than one interval).
    """
    turns: TurnTable = {}
    relations = list(_root(path).iter("edgeRelation"))
    if not relations:
        raise InputError(f"{path}: holds no edgeRelation; give a SUMO turn file")
    for relation in relations:
        start, end = relation.get("from"), relation.get("to")
        if start is None or end is None:
            raise InputError(f"{path}: an edgeRelation lacks from or to; add both")
        ways = turns.setdefault(start, {})
        if end in ways:
            raise InputError(
                f"{path}: gives the turn from {start} to {end} twice; keep a single interval"
            )
        ways[end] = _probability(path, f"{start} to {end}", relation.get("probability"))
    return turns


def _root(path: Path) -> ElementTree.Element:
    try:
        return ElementTree.parse(path).getroot()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); correct the path") from error
    except ElementTree.ParseError as error:
        raise InputError(f"{path}: is not XML ({error}); give a SUMO turn file") from error


def _probability(path: Path, turn: str, text: str | None) -> float:
    try:
        probability = float(text or "")
    except ValueError:
        probability = math.nan
    if not 0 <= probability < math.inf:
        what = "no probability" if text is None else f"probability {as_written(text)}"
        raise InputError(f"{path}: the turn from {turn} has {what}; give a number from 0 to 1")
    return probability
