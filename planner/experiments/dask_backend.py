"""Conditions run by Dask: on a cluster of many machines, or one started here."""

import importlib
import logging
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from typing import Any

from planner.errors import InputError
from planner.experiments.condition import Condition
from planner.experiments.processes import TRIES, Done, RunCondition, retried
from planner.experiments.run_condition import Outcome

CONNECT_S = 10.0  # to wait for a scheduler to answer


def by_dask(
    run_one: RunCondition,
    conditions: Sequence[Condition],
    workers: int,
    *,
    address: str | None = None,
) -> Iterator[Done]:
    """Yield conditions as Dask has them done, with what came of them.

    Dask itself runs again elsewhere what a killed worker was at.

    Parameters
    ----------
    workers
        Processes of the cluster that is started if there is no address.
    address
        Of a running scheduler, whose workers have this package, and the scenario at the same
        place as here; a cache that they share (``PLANNER_CACHE``) spares recordings.

    Raises
    ------
    InputError
        If Dask is not installed, or no scheduler answers at the address.
    """
    if not conditions:
        return
    try:
        dask: Any = importlib.import_module("dask.distributed")
    except ImportError as error:
        raise InputError(
            "--backend dask: is not installed; pip install 'sumo-search-planner[cluster]'"
        ) from error
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with ExitStack() as stack:
        place: Any = address
        if address is None:
            cluster = dask.LocalCluster(
                n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None
            )
            place = stack.enter_context(cluster)
        client = stack.enter_context(_connected(dask.Client, place))
        flying = {
            client.submit(run_one, one, key=f"condition-{one.id}", retries=TRIES): one
            for one in conditions
        }
        for done in dask.as_completed(list(flying), loop=client.loop):
            try:
                outcome = done.result()
            except dask.KilledWorker:
                reason = "the workers that ran it were killed; is memory short?"
                outcome = Outcome({"reason": reason}, {}, final=False)
            yield flying.pop(done), retried(outcome, client.run_on_scheduler(_deaths, done.key))
            done.release()


def _deaths(key: str, dask_scheduler: Any) -> int:
    """Return how many workers were killed while they were at a task."""
    return int(dask_scheduler.tasks[key].suspicious)


def _connected(client: Any, place: Any) -> Any:
    try:
        return client(place, timeout=CONNECT_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(
            f"--address {place}: no Dask scheduler answers there; start one, or leave it out"
        ) from error
