"""A member engine in a process of its own: Python code of one process runs on one core at a time.

An interrupt of the terminal reaches all processes; only the first one decides what that means. A
process whose parent is gone, however it went, ends at once.
"""

import os
import pickle
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from multiprocessing.connection import Connection
from queue import SimpleQueue
from threading import Thread
from typing import Any

from rbstab.sweep.engine import EngineError, EngineFactory, Shard
from rbstab.sweep.plan import Plan


class EngineLostError(Exception):
    """The process of an engine has ended, or could not begin."""


class ProcessEngine:
    """A `MemberEngine` for one thread, which waits while another process computes.

    Args:
        plan: The plan.
        factory: Makes the engine, over there.

    Raises:
        EngineLostError: The system has no room for another process.
    """

    def __init__(self, plan: Plan, factory: EngineFactory) -> None:
        # Imported late: only sweeps by several processes need it.
        from loky.backend import get_context

        context = get_context("loky")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, plan, factory), daemon=True)
        try:
            with _no_interrupts():
                self._process.start()
        except OSError as error:
            raise EngineLostError(str(error)) from error
        finally:
            theirs.close()
        self._ready = False

    def ready(self, wait: float) -> bool:
        """Whether the engine is made; waited for a while, s.

        Raises:
            EngineLostError: The process has ended.
            EngineError: The engine cannot be made.
        """
        if not self._ready and self._connection.poll(wait):
            self._received()
            self._ready = True
        return self._ready

    def compute(self, start: int, stop: int) -> Shard:
        """The members from number `start` up to `stop`.

        Raises:
            EngineLostError: The process has ended.
            EngineError: The engine raised an error.
        """
        try:
            self._connection.send((start, stop))
        except OSError as error:
            raise self._lost() from error
        found: Shard = self._received()
        return found

    def close(self) -> None:
        """Ends the process, whatever it is at: it keeps nothing."""
        self._process.terminate()
        self._process.join()
        self._connection.close()

    def _received(self) -> Any:
        try:
            found = _receive(self._connection)
        except (EOFError, OSError) as error:
            raise self._lost() from error
        if isinstance(found, EngineError):
            raise found
        return found

    def _lost(self) -> EngineLostError:
        self.close()
        return EngineLostError(f"its process has ended (exit code {self._process.exitcode})")


def _serve(orders: Connection, plan: Plan, factory: EngineFactory) -> None:
    """What the process does: it makes its engine, and computes what it is asked for."""
    wanted: SimpleQueue[tuple[int, int]] = SimpleQueue()
    Thread(target=_listen, args=(orders, wanted.put), daemon=True).start()
    try:
        engine = factory(plan)
        answer: Any = None
        while True:
            # Nobody may be there any more; whoever listens for that ends the process.
            with suppress(OSError):
                _send(orders, answer)
            start, stop = wanted.get()
            try:
                answer = engine.compute(start, stop)
            except Exception as error:
                answer = EngineError.of(error)
    except Exception as error:
        _send(orders, EngineError.of(error))


def _listen(orders: Connection, put: Any) -> None:
    with suppress(EOFError, OSError):
        while True:
            put(orders.recv())
    os._exit(0)


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


def _send(connection: Connection, message: Any) -> None:
    """Sends anything; large arrays go as they are, without a copy in the message."""
    arrays: list[pickle.PickleBuffer] = []
    head = pickle.dumps(message, protocol=5, buffer_callback=arrays.append)
    connection.send((head, len(arrays)))
    for array in arrays:
        connection.send_bytes(array.raw())


def _receive(connection: Connection) -> Any:
    head, count = connection.recv()
    return pickle.loads(head, buffers=[connection.recv_bytes() for _ in range(count)])  # noqa: S301
