"""A process that computes and writes shards: Python code of one runs on one core at a time.

An interrupt of the terminal reaches all processes; only the first one decides what that means. A
process whose parent is gone, however it went, ends at once.
"""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from multiprocessing.connection import Connection
from queue import SimpleQueue
from threading import Thread
from typing import Any

from rbstab.integrate.engines import EngineMissingError
from rbstab.store.errors import StoreError
from rbstab.sweep.execution.compute_shard import compute_shard
from rbstab.sweep.execution.events import EngineFailed, ShardDone
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.members.engine import EngineError, EngineFactory
from rbstab.sweep.plan.plan import Plan

Order = tuple[SweepFolder, int]
"""The shard of this number is wanted in this folder."""


class WorkerDiedError(Exception):
    """The process has ended, or could not begin."""


class ShardProcess:
    """A process beside this one, for one thread, which waits for it.

    Args:
        plan: The plan.
        factory: Makes the engine, over there.

    Raises:
        ProcessLostError: The system has no room for another process.
    """

    def __init__(self, plan: Plan, factory: EngineFactory) -> None:
        try:
            # Imported late: only sweeps by several processes need it, and not every system lets it.
            from loky.backend import get_context

            context = get_context("loky")
            self._connection, theirs = context.Pipe()
        except (ImportError, OSError) as error:
            raise WorkerDiedError(str(error)) from error
        self._process = context.Process(target=_serve, args=(theirs, plan, factory), daemon=True)
        try:
            with _no_interrupts():
                self._process.start()
        except (OSError, AttributeError) as error:
            # The latter where this process has no stdout, which loky wants to flush.
            self._connection.close()
            raise WorkerDiedError(str(error)) from error
        finally:
            theirs.close()
        self._ready = False

    def ready(self, wait: float) -> bool:
        """Whether its engine is made; waited for a while, s.

        Raises:
            ProcessLostError: It has ended.
            EngineError: The engine cannot be made.
        """
        if not self._ready and self._connection.poll(wait):
            self._received()
            self._ready = True
        return self._ready

    def make(self, folder: SweepFolder, number: int) -> list[EngineFailed | ShardDone]:
        """Computes and writes a shard, and returns what happened.

        Raises:
            ProcessLostError: It has ended.
            EngineError: It could not compute the shard at all, and has ended.
            StoreError: The shard cannot be written.
            EngineMissingError: The engine cannot be used.
        """
        order: Order = folder, number
        try:
            self._connection.send(order)
        except OSError as error:
            raise self._lost() from error
        found: list[EngineFailed | ShardDone] = self._received()
        return found

    def close(self) -> None:
        """Ends the process, whatever it is at: what it has not finished is not there."""
        # First of all: where it does not heed the signal, it ends because nobody is there.
        self._connection.close()
        self._process.terminate()
        self._process.join()

    def _received(self) -> Any:
        try:
            found = self._connection.recv()
        except (EOFError, OSError) as error:
            raise self._lost() from error
        if isinstance(found, Exception):
            raise found
        return found

    def _lost(self) -> WorkerDiedError:
        self.close()
        return WorkerDiedError(f"its process has ended (exit code {self._process.exitcode})")


def _serve(orders: Connection, plan: Plan, factory: EngineFactory) -> None:
    """What the process does: it makes its engine, and computes what it is asked for."""
    # Where interrupts cannot be blocked before a process begins.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # What a job script ignores, its processes ignore; this one must be easily ended.
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    wanted: SimpleQueue[Order] = SimpleQueue()
    # Not in the main thread: of that, glibc gives memory back at once, which takes a tenth longer.
    Thread(target=_compute, args=(orders, plan, factory, wanted.get), daemon=True).start()
    with suppress(EOFError, OSError):
        while True:
            wanted.put(orders.recv())
    os._exit(0)


def _compute(
    orders: Connection, plan: Plan, factory: EngineFactory, next_order: Callable[[], Order]
) -> None:
    """One shard after the other; where the engine itself fails, the process ends with that."""
    answer: list[EngineFailed | ShardDone] | Exception = []
    try:
        engine = factory(plan)
        while True:
            # Where nobody is there any more whoever listens ends the process.
            with suppress(OSError):
                orders.send(answer)
            folder, number = next_order()
            try:
                answer = [_in_words(event) for event in compute_shard(plan, folder, number, engine)]
            except (StoreError, EngineMissingError) as error:
                answer = error
    except Exception as error:
        orders.send(EngineError.of(error))
    finally:
        os._exit(1)


def _in_words(event: EngineFailed | ShardDone) -> EngineFailed | ShardDone:
    if isinstance(event, EngineFailed):
        return event._replace(error=EngineError.of(event.error))
    return event


@contextmanager
def _no_interrupts() -> Iterator[None]:
    """A process that begins here does not hear of interrupts."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # Those that watch over shared resources begin with the first process, and let interrupts in.
    for module in ("multiprocessing", "loky.backend"):
        import_module(f"{module}.resource_tracker").ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
