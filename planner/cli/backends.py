"""Where a command has its work done: by processes of this machine, or on Dask."""

import argparse
from functools import cache

from planner.errors import InputError
from planner.futures.cluster import Cluster
from planner.futures.on_cluster import OnCluster
from planner.futures.workers import HERE, Backend
from planner.mission.opening import OpenScenario
from planner.mission.recorder import Recorder
from planner.progress import Progress


def cluster_of(arguments: argparse.Namespace) -> Cluster | None:
    """Return the Dask cluster that is asked for; None without one.

    Raises
    ------
    InputError
        If Dask is not installed, the address is not safe, or options do not go together.
    """
    if arguments.backend == "dask":
        if arguments.insecure and arguments.address is None:
            raise InputError("--insecure: goes with --address; leave it out")
        return Cluster(arguments.address, arguments.insecure)
    if arguments.address is not None:
        raise InputError(f"--address {arguments.address}: goes with --backend dask")
    if arguments.insecure:
        raise InputError("--insecure: goes with --backend dask and --address; leave it out")
    return None


def backend_of(arguments: argparse.Namespace) -> Backend:
    """Return where the targets of a command are driven."""
    cluster = cluster_of(arguments)
    return HERE if cluster is None else _on_cluster(cluster)


@cache
def _on_cluster(cluster: Cluster) -> OnCluster:
    """Return the one that holds the connection, for all recordings of a command."""
    return OnCluster(cluster)


def recorder_of(
    arguments: argparse.Namespace, opened: OpenScenario, progress: Progress | None = None
) -> Recorder:
    """Return a command's recorder."""
    return Recorder(opened, arguments.jobs, progress, backend_of(arguments))
