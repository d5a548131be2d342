"""The traffic of a scenario, from its section and the files that it names."""

from collections.abc import Sequence
from pathlib import Path

from planner.futures.sumo_config import read_config
from planner.futures.traffic import Traffic
from planner.provenance import sha256_of_file
from planner.scenario.draft import Draft


def traffic_of(
    draft: Draft, *, allowed: Sequence[Path] = (), control: str | None = None
) -> Traffic | None:
    """Return the traffic in which a scenario's targets drive; None where nothing is said of any.

    Parameters
    ----------
    allowed
        Folders below which its files may lie, beside the scenario's own.
    control
        The function that steers it, as ``module:function``.

    Raises
    ------
    InputError
        If one of its files cannot be read, or is not what can be taken.
    """
    section = draft.traffic
    if section is None or not section.is_given:
        return None
    config = None if section.sumocfg is None else draft.folder / section.sumocfg
    options: tuple[tuple[str, str], ...] = ()
    routes, additional = (
        tuple(draft.folder / name for name in names or ())
        for names in (section.routes, section.additional)
    )
    if config is not None:
        read = read_config(config)
        options, routes, additional = read.options, read.routes, read.additional
    files = tuple((file, sha256_of_file(file)) for file in (*routes, *additional))
    return Traffic(
        at_s=section.at_s,
        realisations=section.realisations,
        seed=draft.search.seed if draft.search is not None else 0,
        depart_offset_s=section.depart_offset_s,
        config=config,
        options=options,
        routes=routes,
        additional=additional,
        allowed=(draft.folder, *allowed),
        control=control,
        files=files,
    )
