"""The connection of `rbstab sweep --dask` to a cluster."""

import logging
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from rbstab.sweep.execution.work_queue import Executor
    from rbstab.sweep.plan.plan import Plan


@contextmanager
def connected(address: str, plan: "Plan") -> "Iterator[Executor]":
    """The cluster at an address, for members of a plan; ends the command where there is none."""
    from rbstab.sweep.execution.work_queue import ExecutorError

    try:
        from rbstab.sweep.execution.dask_executor import cluster
    except ModuleNotFoundError as error:
        raise click.UsageError(
            f"--dask needs another package ({error.name} is missing): pip install 'rbstab[cluster]'"
        ) from error
    with ExitStack() as stack:
        stack.enter_context(_without_logs())
        try:
            found = stack.enter_context(cluster(address, plan.engine))
        except ExecutorError as error:
            raise click.UsageError(f"--dask {address}: {error}") from error
        yield found


@contextmanager
def _without_logs() -> Iterator[None]:
    """Keeps Dask from printing tracebacks of what is said here in plain words."""
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(logging.NOTSET)
