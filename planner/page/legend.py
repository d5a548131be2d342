"""What dots on the map are: where a target may be, several told apart by shape and colour."""

import math
from collections.abc import Mapping

from planner.page.document import markup

CIRCLE = '<circle class="dot" cx="6" cy="6" r="4"/>'
# As ``marks.js`` draws them: corners, and how far they are turned.
CORNERS = ((0, 0.0), (4, 0.0), (4, math.pi / 4), (3, math.pi))


def dots(names: Mapping[int, str] | None = None) -> str:
    """Return the legend of targets as markup.

    Parameters
    ----------
    names
        What those are called that are searched for, by number, if there are several in all.
    """
    if not names:
        return _one(CIRCLE, "may be here")
    return " ".join(_one(_shape(kind), f"{name} may be here") for kind, name in names.items())


def _one(shape: str, said: str) -> str:
    return f'<span><svg viewBox="0 0 12 12" aria-hidden="true">{shape}</svg>{markup(said)}</span>'


def _shape(kind: int) -> str:
    """Return the shape of a target's dots."""
    corners, turn = CORNERS[kind % len(CORNERS)]
    if not corners:
        return CIRCLE
    turns = [turn + 2.0 * math.pi * corner / corners for corner in range(corners)]
    places = [f"{6 + 5 * math.sin(at):.1f} {6 - 5 * math.cos(at):.1f}" for at in turns]
    return f'<path class="t{kind % len(CORNERS)}" d="M{"L".join(places)}z"/>'
