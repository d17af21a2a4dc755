"""The connection of `rbstab sweep --dask` to a Dask cluster."""

import logging
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import click

from rbstab.sweep.execution.computing import ExecutorError
from rbstab.sweep.execution.pools import Pool
from rbstab_cli.errors import require


@contextmanager
def connected_cluster(address: str | None, engine: str) -> Iterator[Pool | None]:
    """Connect to a Dask cluster.

    Args:
        address: The address of the scheduler, or the path of its JSON file; None: use no cluster.
        engine: The name of the engine that integrates members.

    Yields:
        The workers of the cluster, or None.

    Raises:
        UsageError: Dask is not installed, or the cluster cannot be used.
    """
    if address is None:
        yield None
        return
    require("cluster", "--dask", "distributed")
    from rbstab.sweep.execution.dask_cluster import cluster

    with ExitStack() as stack:
        # Dask prints tracebacks; this program prints its own messages instead.
        logging.disable(logging.CRITICAL)
        stack.callback(logging.disable, logging.NOTSET)
        try:
            pool = stack.enter_context(cluster(address, engine))
        except ExecutorError as error:
            raise click.UsageError(f"--dask {address}: {error}") from error
        yield pool
