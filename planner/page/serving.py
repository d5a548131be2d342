"""The served page: a run, or a net without a plan, with a form for the next call."""

from collections.abc import Iterable, Mapping
from typing import Any

from planner.flight.airspace import Airspace
from planner.network.road_network import RoadNetwork
from planner.page.content import net_content
from planner.page.document import HERE, NO_PARTS, document, filled, instrument, markup, settled
from planner.page.legend import dots


def page_of_net(network: RoadNetwork, title: str, airspace: Airspace | None = None) -> str:
    """Return a page of a net alone, and of where the drone may be."""
    parts = NO_PARTS | {"KIND": "net", "DOTS": dots(), "CREDIT": markup(network.attribution)}
    return document(title=title, data=net_content(network, airspace), parts=parts)


def served(
    text: str, *, profiles: Iterable[str], files: Iterable[str], state: Mapping[str, Any]
) -> str:
    """Return a page with the form.

    Parameters
    ----------
    text
        Of the page.
    profiles
        What may have been seen.
    files
        Names of files to take.
    state
        ``said``: what fields of the form hold, by name; ``plans``: how many there are; ``pages``:
        how many this one knows of.
    """
    text = settled(text)  # its form says when there is a better one
    form = (HERE / "instrument.html").read_text(encoding="utf-8")
    parts = {
        "PROFILES": "".join(f"<option>{markup(name)}</option>" for name in profiles),
        "FILES": "".join(f'<a href="/{name}" download>{name}</a>' for name in files),
    }
    return instrument(text, form=filled(form, parts), state=state)
