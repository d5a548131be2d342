"""Conditions run by Dask: on a cluster of many machines, or one started here."""

import importlib
from collections.abc import Iterator, Sequence
from typing import Any

from planner.experiments.condition import Condition
from planner.experiments.processes import TRIES, Done, RunCondition, retried
from planner.experiments.run_condition import Outcome
from planner.futures.cluster import Cluster


def by_dask(
    run_one: RunCondition, conditions: Sequence[Condition], workers: int, *, cluster: Cluster
) -> Iterator[Done]:
    """Yield conditions as Dask has them done, with what came of them.

    Dask itself runs again elsewhere what a killed worker was at.

    Parameters
    ----------
    workers
        Processes of the cluster, if it is started here.
    cluster
        Its workers have this package, and the scenario at the same place as here; a cache that
        they share (``PLANNER_CACHE``) spares recordings.

    Raises
    ------
    InputError
        If no scheduler answers at the address.
    """
    if not conditions:
        return
    dask: Any = importlib.import_module("dask.distributed")
    with cluster.connected(workers) as client:
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
