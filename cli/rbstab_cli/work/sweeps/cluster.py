"""The connection of `rbstab sweep --dask` to a Dask cluster."""

import logging
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import click

from rbstab.sweep.execution.computing import ExecutorError
from rbstab.sweep.execution.pools import Pool


@contextmanager
def connected_cluster(address: str, engine: str) -> Iterator[Pool]:
    """Connect to a Dask cluster.

    Args:
        address: The address of the scheduler, or the path of its JSON file.
        engine: The name of the engine that integrates members.

    Yields:
        The workers of the cluster.

    Raises:
        UsageError: Dask is not installed, or the cluster cannot be used.
    """
    try:
        from rbstab.sweep.execution.dask_cluster import cluster
    except ModuleNotFoundError as error:
        raise click.UsageError(
            f'--dask needs the package {error.name}. Run: pip install "rbstab[cluster]"'
        ) from error
    with ExitStack() as stack:
        stack.enter_context(_logging_off())
        try:
            pool = stack.enter_context(cluster(address, engine))
        except ExecutorError as error:
            raise click.UsageError(f"--dask {address}: {error}") from error
        yield pool


@contextmanager
def _logging_off() -> Iterator[None]:
    """Keep Dask from printing tracebacks: this program prints its own messages instead."""
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(logging.NOTSET)
